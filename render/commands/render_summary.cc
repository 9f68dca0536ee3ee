#include "render/commands/render_summary.h"

#include <fmt/format.h>

#include "render/settings_json.h"

namespace lumi {
namespace {

// A row of the table; missing values stay empty.
std::string HoldoutLine(const std::string& name, const HoldoutScore& own, const std::optional<double>& seen,
                        const HoldoutScore& nearest) {
  const auto db = [](const std::optional<double>& value) { return value ? fmt::format("{:.2f}", *value) : ""; };
  const auto share = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.1f}%", 100 * *value) : "";
  };
  return fmt::format("{:<28} {:>9} {:>9} {:>7} {:>7.4f} {:>9} {:>13} {:>9} {:>9}\n", name, db(own.psnr_db),
                     db(own.psnr_seen_db), share(seen), own.ssim, share(own.coverage), db(nearest.psnr_db) + " dB",
                     db(nearest.psnr_seen_db), share(nearest.coverage));
}

std::string DescribeHoldout(const HoldoutSummary& s) {
  std::string text =
      fmt::format("{:<28} {:>9} {:>9} {:>7} {:>7} {:>9} {:>13} {:>9} {:>9}\n", "held-out photo", "PSNR dB", "over seen",
                  "seen", "SSIM", "coverage", "nearest photo", "over seen", "coverage");
  for (const HoldoutView& v : s.views) text += HoldoutLine(v.name, v, v.seen, v.nearest);
  text += HoldoutLine("mean", s.mean, s.seen, s.nearest_mean);
  if (s.mean.psnr_object_db)
    text += fmt::format("{:<28} {:>9.2f} {:>9} {:>7} {:>7} {:>9} {:>10.2f} dB\n", "mean over the object",
                        *s.mean.psnr_object_db, "", "", "", "", s.nearest_mean.psnr_object_db.value_or(0));
  return text;
}

}  // namespace

// ---- what --json has

void ListKeys(JsonKeys& j, PixelPhoto& p) { j("photo", p.photo, "weight", p.weight, "color", p.color); }
void ListKeys(JsonKeys& j, AskedPixel& p) {
  j("x_px", p.x_px, "alpha", p.alpha).IfAny("point", p.point)("photos", p.photos);
}

void ListKeys(JsonKeys& j, ViewFigures& v) {
  j("name", v.name, "left_out", v.left_out);
  j.IfAny("time_s", v.time_s).IfAny("psnr_db", v.psnr_db).IfAny("ssim", v.ssim);
  j.IfAny("mean_absolute_difference", v.mean_absolute_difference);
  j.IfAny("mean_absolute_difference_seen", v.mean_absolute_difference_seen)("coverage", v.coverage);
  j.IfAny("legend", v.legend).IfAny("pixels", v.pixels);
}

void ListKeys(JsonKeys& j, HoldoutView& v) {
  j("name", v.name, "psnr_db", v.psnr_db).IfAny("psnr_seen_db", v.psnr_seen_db).IfAny("seen", v.seen);
  j("ssim", v.ssim, "coverage", v.coverage, "nearest_photo", v.nearest_name, "nearest_photo_psnr_db",
    v.nearest.psnr_db);
  j.IfAny("nearest_photo_psnr_seen_db", v.nearest.psnr_seen_db);
  j("nearest_photo_ssim", v.nearest.ssim, "nearest_photo_coverage", v.nearest.coverage, "ms", v.ms);
  j("file", v.file).IfAny("psnr_object_db", v.psnr_object_db);
  j.IfAny("nearest_photo_psnr_object_db", v.nearest.psnr_object_db);
}

static void ListKeys(JsonKeys& j, KeptBudget& k) {
  ListKeys(j, k.choice);
  j("met", k.met).IfAny("meets_it", k.meets_it);
}

void ListKeys(JsonKeys& j, MeasureScale& s) { j("measure", s.measure, "low", s.low, "high", s.high, "unit", s.unit); }

void ListKeys(JsonKeys& j, OptimumCounts& o) {
  j("samples", o.samples);
  j.Say("cameras_mean", static_cast<double>(o.cameras) / static_cast<double>(o.samples));
  j("dense", o.dense, "nugget_raised", o.nugget_raised, "indefinite", o.indefinite, "small_sums", o.small_sums);
}

void ListKeys(JsonKeys& j, CorrelationBin& b) {
  j.Say("angle_deg", b.angle_rad / kRadPerDeg)("correlation", b.correlation, "pairs", b.pairs);
}
void ListKeys(JsonKeys& j, CorrelationKind& k) {
  j.Say("r_min_deg", k.leaves.r_min_rad / kRadPerDeg).Say("r_max_deg", k.leaves.r_max_rad / kRadPerDeg);
  j("noise", k.leaves.noise, "share", k.share, "bins", k.bins);
}
void ListKeys(JsonKeys& j, MeasuredCorrelation& c) {
  j.Say("r_min_deg", c.r_min_rad / kRadPerDeg).Say("r_max_deg", c.r_max_rad / kRadPerDeg);
  j("noise", c.noise, "rms", c.rms, "points", c.points, "bins", c.bins).IfAny("kinds", c.kinds);
}

void ListKeys(JsonKeys& j, PhotosInMemory& p) {
  j("read", p.read, "most_halved", p.most_halved, "most_mb", p.most_mb, "seconds", p.seconds);
}

void ListKeys(JsonKeys& j, RenderSummary& s) {
  j("frames", s.frames, "ms_per_frame", s.ms_per_frame, "coverage", s.coverage);
  if (s.path) {
    PathFigures& p = *s.path;
    j("frames_reused", p.reused, "width", p.size_px.x(), "height", p.size_px.y());
    if (p.ms_first > 0) j("first_ms", p.ms_first);
    if (p.ms_slowest > 0) j("slowest_ms", p.ms_slowest);
    if (p.widened) j("coverage_window", p.coverage_window, "coverage_wider", p.coverage_wider);
    j.IfAny("video", p.video);
  }
  j.IfAny("views", s.views);
  if (s.holdout) {
    HoldoutSummary& e = s.holdout->errors;
    if (s.holdout->n == kHoldoutEach)
      j.Say("holdout", "each");
    else
      j("holdout", s.holdout->n, "fold", s.holdout->fold);
    j("proxy_evaluated", s.holdout->proxy_evaluated).IfAny("seen_proxy", s.holdout->seen_proxy);
    j("psnr_mean_db", e.mean.psnr_db).IfAny("psnr_seen_mean_db", e.mean.psnr_seen_db).IfAny("seen", e.seen);
    j("ssim_mean", e.mean.ssim, "nearest_photo_psnr_mean_db", e.nearest_mean.psnr_db);
    j.IfAny("nearest_photo_psnr_seen_mean_db", e.nearest_mean.psnr_seen_db);
    j("nearest_photo_ssim_mean", e.nearest_mean.ssim, "nearest_photo_coverage_mean", e.nearest_mean.coverage, "views",
      e.views);
    j.IfAny("psnr_object_mean_db", e.mean.psnr_object_db);
    j.IfAny("nearest_photo_psnr_object_mean_db", e.nearest_mean.psnr_object_db);
  }
  j("proxy", s.proxy).IfAny("frame", s.frame);
  if (s.window_frames >= 0) j("window_frames", s.window_frames);
  j("device", s.device).Say("settings", KeysOf(s.settings, s.own_times, s.backend));
  j.IfAny("budget", s.budget).IfAny("fidelity", s.fidelity).IfAny("scale", s.scale)("effects", s.effects);
  j.IfAny("correlation", s.correlation).IfAny("photos_in_memory", s.photos_in_memory);
  if (s.samples > 0) j("samples", s.samples);
  if (s.optimum.samples > 0) j("optimum", s.optimum);
}

// A budget is judged by the measured time of a frame or, where no frame was rendered, by the expected one.
static std::string Describe(const KeptBudget& k) {
  const BudgetChoice& b = k.choice;
  std::string text = fmt::format("{:g} ms a frame: {}, {:.1f} ms expected{}; {}\n", b.budget_ms, b.name, b.ms,
                                 b.fits ? "" : ", the fastest settings there are", b.why);
  if (k.met) return text;
  text += k.ms ? fmt::format("budget not met: {:.1f} ms a frame, {:g} ms asked for", *k.ms, b.budget_ms)
               : fmt::format("budget not met: {:.1f} ms a frame expected, {:g} ms asked for", b.ms, b.budget_ms);
  return text + fmt::format("; {} would meet it\n", k.meets_it);
}

static std::string DescribeView(const ViewFigures& v) {
  std::string text = v.name + ": ";
  if (v.psnr_db) text += fmt::format("PSNR {:.2f} dB, SSIM {:.4f}, ", *v.psnr_db, *v.ssim);
  text += fmt::format("coverage {:.1f}%", 100 * v.coverage);
  if (v.psnr_db && !v.left_out) text += " (made of that photo itself; --leave-out compares with the others' picture)";
  return text;
}

static std::string DescribePixels(const ViewFigures& v) {
  std::string text;
  for (const AskedPixel& p : v.pixels) {
    text += fmt::format("\npixel {:g},{:g}: ", p.x_px.x(), p.x_px.y());
    if (!(p.alpha > 0)) text += "a hole: no photo in use sees it";
    if (p.point.size() == 3 && p.alpha > 0)
      text += fmt::format("at {:.4g} {:.4g} {:.4g}, of ", p.point[0], p.point[1], p.point[2]);
    for (std::size_t i = 0; i < p.photos.size(); ++i)
      text += fmt::format("{}{} {:.3f}", i > 0 ? ", " : "", p.photos[i].photo, p.photos[i].weight);
  }
  return text;
}

std::string ResultLine(const RenderSummary& s) {
  if (!s.views.empty()) return DescribeView(s.views.front()) + DescribePixels(s.views.front());
  if (!s.holdout) return {};
  const HoldoutSummary& e = s.holdout->errors;
  std::string line = fmt::format("{} held-out photos: ", e.views.size());
  if (e.mean.psnr_object_db) line += fmt::format("over the object {:.2f} dB; ", *e.mean.psnr_object_db);
  line += fmt::format("PSNR {:.2f} dB, ", e.mean.psnr_db);
  if (e.mean.psnr_seen_db) line += fmt::format("{:.2f} dB over what is seen, ", *e.mean.psnr_seen_db);
  line += fmt::format("SSIM {:.4f}, coverage {:.1f}%", e.mean.ssim, 100 * e.mean.coverage);
  return line + fmt::format("; nearest photo {:.2f} dB", e.nearest_mean.psnr_db);
}

std::string Describe(const RenderSummary& s) {
  std::string text;
  if (s.holdout) text += DescribeHoldout(s.holdout->errors);
  for (const ViewFigures& v : s.views) text += DescribeView(v) + DescribePixels(v) + "\n";
  if (s.budget) text += Describe(*s.budget);
  if (s.fidelity) text += Describe(*s.fidelity) + "\n";
  for (const Effect& e : s.effects)
    text += fmt::format("{:<13} {:<4} {}{}\n", e.name, e.on ? "on" : "off", Reason(e),
                        e.on && e.cost_ms ? fmt::format(" ({:.1f} ms)", *e.cost_ms) : "");
  const std::string each = s.ms_per_frame ? fmt::format("{:.1f} ms each", *s.ms_per_frame) : "all there already";
  if (s.scale)
    text += fmt::format("{:<13} dark {:g} to bright {:g} {}\n", s.scale->measure, s.scale->low, s.scale->high,
                        s.scale->unit);
  text += fmt::format("{} frames, {}, proxy {}, {}", s.frames, each, s.proxy, s.device);
  return s.wrote.empty() ? text : text + "\nwrote " + s.wrote.string();
}

}  // namespace lumi
