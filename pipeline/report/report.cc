#include "pipeline/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/report/cameras_from_above.h"
#include "pipeline/report/contact_sheet.h"
#include "pipeline/report/fronts.h"
#include "pipeline/report/html.h"
#include "pipeline/sibling_summaries.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/version.h"
#include "scene/program/with_error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using namespace sibling;

constexpr int kThumbnailWidthPx = 320;
constexpr std::size_t kMaxSheetRows = 16;  // spread evenly over what there is
constexpr std::size_t kMaxMissingRows = 200;
constexpr std::size_t kMaxGaps = 12;
constexpr std::size_t kMaxStandingRows = 12;

// The stage's own summary; defaults where there was no such stage.
template <typename Summary>
Summary SummaryOf(const ReportInput& input, const std::string& name) {
  for (const StageResult& stage : input.stages)
    if (stage.name == name) return stage.summary.As<Summary>();
  return {};
}

// The stage that gave the cameras: reconstruct (timeperiodic starts it itself), or import.
CamerasSummary CamerasOf(const ReportInput& input) {
  if (const auto timed = SummaryOf<TimedSummary>(input, "timeperiodic"); timed.reconstruct) return *timed.reconstruct;
  const bool reconstructed =
      std::ranges::any_of(input.stages, [](const StageResult& s) { return s.name == "reconstruct"; });
  return SummaryOf<CamerasSummary>(input, reconstructed ? "reconstruct" : "import");
}

template <typename T>
std::vector<T> SpreadEvenly(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(all[i * all.size() / most]);
  return some;
}

std::vector<SheetRow> SheetRows(const ReportInput& input, const Scene& scene, const HoldoutSummary& holdout) {
  std::vector<SheetRow> rows;
  std::map<std::string, int> orientation_of;
  for (const View& view : scene.views) orientation_of[view.name] = view.orientation;
  for (const HeldOutView& view : holdout.views)
    rows.push_back({view.name, scene.image_folder / view.name, input.holdout_folder / (view.file + "_render.jpg"),
                    input.holdout_folder / (view.file + "_difference.jpg"), orientation_of[view.name]});
  if (rows.empty())
    for (const View& view : scene.views) rows.push_back({view.name, scene.ImagePath(view), {}, {}, view.orientation});
  return SpreadEvenly(rows, kMaxSheetRows);
}

std::string ContactSheetHtml(const std::vector<SheetThumbnails>& rows) {
  if (rows.empty()) return {};
  const bool compared = rows.front().pictures.size() == 3;
  std::string html = compared
                         ? "<p class=\"soft\">Photos that were left out, and what the others make of the same view. "
                           "Differences are amplified.</p>\n<div class=\"frame\"><div class=\"sheet\">"
                           "<div class=\"head\">photo</div><div class=\"head\">rendered from the others</div><div "
                           "class=\"head\">difference</div>\n"
                         : "<div class=\"frame\"><div class=\"sheet photos\">\n";
  static constexpr const char* kWhat[] = {"photo", "rendered", "difference"};
  for (const SheetThumbnails& row : rows) {
    if (compared) html += "<div class=\"name\">" + EscapeHtml(row.name) + "</div>";
    for (std::size_t k = 0; k < row.jpegs.size(); ++k)
      html += HtmlInlineJpeg(row.jpegs[k], row.name + ", " + kWhat[std::min<std::size_t>(k, 2)]) + "\n";
  }
  return html + "</div></div>\n";
}

// Figures as the table has them; what there is not stays empty.
std::string Decibels(const std::optional<double>& db) { return db ? fmt::format("{:.2f}", *db) : std::string(); }
std::string Percent(const std::optional<double>& share) {
  return share ? fmt::format("{:.1f} %", 100 * *share) : std::string();
}

std::string HoldoutHtml(const HoldoutSummary& holdout) {
  if (holdout.views.empty()) return {};
  std::vector<std::vector<std::string>> rows;
  constexpr double kBarPxADecibel = 4;
  for (const HeldOutView& v : holdout.views)
    rows.push_back(
        {EscapeHtml(v.name),
         fmt::format("<span class=\"bar\" style=\"width:{:.0f}px\"></span>", std::max(0.0, v.psnr_db) * kBarPxADecibel),
         Decibels(v.psnr_db), Decibels(v.psnr_seen_db), Percent(v.seen), fmt::format("{:.3f}", v.ssim),
         Percent(v.coverage), Decibels(v.nearest_photo_psnr_db), Decibels(v.nearest_photo_psnr_seen_db),
         Percent(v.nearest_photo_coverage)});
  rows.push_back({"mean", "", Decibels(holdout.psnr_mean_db.value_or(0)), Decibels(holdout.psnr_seen_mean_db),
                  Percent(holdout.seen), fmt::format("{:.3f}", holdout.ssim_mean), Percent(holdout.coverage),
                  Decibels(holdout.nearest_photo_psnr_mean_db), Decibels(holdout.nearest_photo_psnr_seen_mean_db),
                  Percent(holdout.nearest_photo_coverage_mean)});
  std::string proxy;
  if (!holdout.proxy_evaluated.empty())
    proxy = holdout.proxy_evaluated == holdout.proxy
                ? " The proxy was made of all photos, the held-out ones among them."
                : " The proxy was made without the held-out photos (" + EscapeHtml(holdout.proxy_evaluated) + ").";
  return "<p class=\"soft\">PSNR over all pixels at the photo's own size, where a hole counts as black; then over the "
         "pixels that at least two of the other photos see, and their share. SSIM is over all pixels. The baseline is "
         "the nearest photo alone, reprojected through the same proxy: over all pixels, over the same seen ones, and "
         "what it covers." +
         proxy + "</p>\n" +
         HtmlTable({{"held-out photo"},
                    {""},
                    {"PSNR, dB", true},
                    {"over seen", true},
                    {"seen", true},
                    {"SSIM", true},
                    {"coverage", true},
                    {"nearest photo, dB", true},
                    {"over seen", true},
                    {"its coverage", true}},
                   rows, true);
}

std::string MissingHtml(const CamerasSummary& cameras) {
  if (cameras.missing.empty()) return {};
  std::vector<std::vector<std::string>> rows;
  for (const MissingPhoto& photo : cameras.missing) {
    if (rows.size() == kMaxMissingRows) {
      rows.push_back({fmt::format("and {} more", cameras.missing.size() - kMaxMissingRows), "see report.json", ""});
      break;
    }
    rows.push_back({EscapeHtml(photo.name), EscapeHtml(photo.reason), EscapeHtml(photo.hint)});
  }
  std::string html = HtmlTable({{"photo"}, {"why"}, {"what to try"}}, rows);
  if (cameras.components.size() > 1)
    html +=
        "<p>COLMAP split the photos into parts that do not hang together; this scene is one of them (lumi-pipeline "
        "--component picks another).</p>\n";
  return html;
}

// What a reader is to think of the table below.
std::string StandingVerdict(const std::vector<StandingCamera>& standings) {
  const auto doubtful =
      std::ranges::count_if(standings, [](const StandingCamera& s) { return !s.remark.empty() || s.placed_anew; });
  if (doubtful > 0)
    return fmt::format("{} of {} cameras have a remark, and stand first; their photos may show ghosts.", doubtful,
                       standings.size());
  double largest = 0;
  for (const StandingCamera& s : standings) largest = std::max(largest, s.sigma_percent.value_or(0));
  return fmt::format(
      "No camera gives cause for doubt: the least certain position is known to {:.2g} % of the extent of all cameras.",
      largest);
}

// The cameras that stand worst; they come in that order.
std::string StandingHtml(const CamerasSummary& cameras) {
  if (cameras.standings.empty()) return {};
  std::vector<std::vector<std::string>> rows;
  for (const StandingCamera& s : cameras.standings) {
    if (rows.size() == kMaxStandingRows) break;
    rows.push_back({EscapeHtml(s.name), fmt::format("{} of {}", s.points, s.offered),
                    fmt::format("{:.0f} %", 100 * s.spread), fmt::format("{:.1f}", s.angle_deg),
                    s.sigma_percent ? fmt::format("{:.3f}", *s.sigma_percent) : "?",
                    EscapeHtml((s.placed_anew ? std::string("placed anew ") : std::string()) + s.remark)});
  }
  return "<p>" + StandingVerdict(cameras.standings) +
         "</p>\n<p class=\"soft\">Points that two other photos hold, and that the camera shows where its matches have "
         "them, of so many; the share of its photo that they cover; the median angle at which others see them; one "
         "standard deviation of its position.</p>\n" +
         HtmlTable({{"camera"},
                    {"points that hold it", true},
                    {"of the photo", true},
                    {"angle, deg", true},
                    {"uncertainty, % of the extent", true},
                    {""}},
                   rows) +
         (cameras.standings.size() > rows.size()
              ? fmt::format("<p>The {} least certain of {}; all are in report.json.</p>\n", rows.size(),
                            cameras.standings.size())
              : std::string());
}

std::string TimeHtml(const ReportInput& input) {
  std::vector<std::vector<std::string>> rows;
  double total = 0, largest = 1e-9;
  for (const StageResult& s : input.stages)
    total += s.computed_seconds, largest = std::max(largest, s.computed_seconds);
  constexpr double kBarPx = 320;
  for (const StageResult& s : input.stages)
    rows.push_back(
        {EscapeHtml(s.name),
         fmt::format("<span class=\"bar\" style=\"width:{:.0f}px\"></span>", s.computed_seconds / largest * kBarPx),
         fmt::format("{:.1f}", s.computed_seconds)});
  rows.push_back({"together", "", fmt::format("{:.1f}", total)});
  std::string html = HtmlTable({{"stage"}, {""}, {"seconds", true}}, rows, true);
  if (input.colmap_seconds > 0)
    html +=
        fmt::format("<p class=\"soft\">COLMAP itself took {:.1f} s; preparation and proxy around it {:.1f} s.</p>\n",
                    input.colmap_seconds, input.around_colmap_seconds);
  return html;
}

// What each program recorded: version and options, one table a stage.
struct StageRecord {
  std::string version;
  std::map<std::string, std::string> options;
  double seconds = 0;
};
void ListKeys(JsonKeys& j, StageRecord& r) { j("options", r.options, "seconds", r.seconds, "version", r.version); }
using StageRecords = std::map<std::string, StageRecord>;

StageRecords ReadRecords(const fs::path& scene_folder) {
  StageRecords all;
  std::error_code error;
  for (fs::directory_iterator it(scene_folder / "provenance", error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != ".json") continue;
    if (it->path().stem().string().starts_with(kMeasured)) continue;  // no stage's
    const auto record = JsonKeys::Parse(ReadText(it->path()));
    if (record && record->Has("options")) all[it->path().stem().string()] = record->As<StageRecord>();
  }
  return all;
}

std::string OptionsHtml(const ReportInput& input, const StageRecords& records) {
  std::string html, commands;
  for (const StageResult& s : input.stages)
    if (!s.command.empty()) commands += EscapeHtml(s.command) + "\n";
  if (!commands.empty()) html += "<p>The stages' own commands:</p><pre>" + commands + "</pre>\n";
  for (const auto& [stage, record] : records) {
    std::vector<std::vector<std::string>> rows{{"version", EscapeHtml(record.version)}};
    for (const auto& [key, value] : record.options) rows.push_back({EscapeHtml(key), EscapeHtml(value)});
    html += "<details><summary>" + EscapeHtml(stage) + "</summary>" + HtmlTable({{"option"}, {"value"}}, rows) +
            "</details>\n";
  }
  return html;
}

// How a scene that moves is covered in space and time, as lumi-timeperiodic says it; its plots are in the page.
std::string SamplingHtml(const ReportInput& input) {
  const auto timed = SummaryOf<TimedSummary>(input, "timeperiodic");
  if (!timed.sampling) return {};
  const SpaceTimeSampling& sampling = *timed.sampling;
  std::vector<std::vector<std::string>> rows{
      {"period", fmt::format("{} frames, {:.4g} s (from the {})",
                             WithError(timed.period_frames, timed.period_sigma_frames, " &#177; "), timed.period_s,
                             EscapeHtml(timed.period_from))},
      {"photos in a window of one frame",
       fmt::format("{:.3g} on average, {:.0f} to {:.0f}", sampling.samples_per_window, sampling.window_least,
                   sampling.window_most)},
      {"uniformity of the space-time plane",
       fmt::format("{:.2f} (1: as good as chance; {:.0f} % of its cells have a photo)", sampling.uniformity,
                   100 * sampling.covered)}};
  if (timed.masks.moving_share)
    rows.push_back({"of the picture moves", fmt::format("{:.1f} %", 100 * *timed.masks.moving_share)});
  std::string html = HtmlTable({{"space and time"}, {""}}, rows);
  for (const char* plot : {"sampling.svg", "period.svg"}) {
    std::error_code error;
    const fs::path file = input.scene_folder / "timeperiodic" / plot;
    if (!fs::is_regular_file(file, error)) continue;
    html += "<div class=\"frame\">" + HtmlInlineSvg(ReadText(file), plot) + "</div>\n";
  }
  std::string list;
  for (const std::string& w : timed.warnings) list += "<li>" + EscapeHtml(w) + "</li>";
  const std::size_t gaps = sampling.gaps.size();
  for (std::size_t i = 0; i < std::min(gaps, kMaxGaps); ++i)
    list += "<li>gap: " + EscapeHtml(sampling.gaps[i].what_to_film) + "</li>";
  if (gaps > kMaxGaps) list += fmt::format("<li>and {} more gaps: report.json has them</li>", gaps - kMaxGaps);
  return list.empty() ? html : html + "<ul>" + list + "</ul>\n";
}

std::string CardsHtml(const ReportInput& input, const CamerasSummary& cameras, const HoldoutSummary& holdout) {
  std::string cards = "<div class=\"cards\">";
  cards += HtmlCard(fmt::format("{} of {}", cameras.images_registered, cameras.images_total), "photos have a camera",
                    cameras.backend.empty() ? "" : "by " + EscapeHtml(cameras.backend));
  cards += HtmlCard(fmt::format("{:.2f} px", cameras.mean_reprojection_error_px), "mean reprojection error");
  if (holdout.psnr_mean_db) {
    const double psnr = *holdout.psnr_mean_db, nearest = holdout.nearest_photo_psnr_mean_db.value_or(psnr);
    cards += HtmlCard(fmt::format("{:.1f} dB", psnr), "PSNR of held-out photos",
                      fmt::format("{:+.1f} dB against the nearest photo", psnr - nearest));
    if (holdout.psnr_seen_mean_db)
      cards += HtmlCard(fmt::format("{:.1f} dB", *holdout.psnr_seen_mean_db), "PSNR over seen pixels",
                        Percent(holdout.seen) + " of them: two other photos see them");
    cards += HtmlCard(fmt::format("{:.3f}", holdout.ssim_mean), "SSIM");
    cards += HtmlCard(fmt::format("{:.1f} %", 100 * holdout.coverage), "coverage");
  }
  if (const auto calibration = SummaryOf<CalibratedSummary>(input, "calibrate"); calibration.fx)
    cards += HtmlCard(fmt::format("{:.1f} &#177; {:.1f} px", *calibration.fx, calibration.sigma_fx),
                      "focal length, calibrated", "see <a href=\"calibration/report.html\">its report</a>");
  if (const auto proxy = SummaryOf<MadeProxySummary>(input, "proxy"); proxy.faces)
    cards += HtmlCard(std::to_string(*proxy.faces), "faces in the proxy", EscapeHtml(proxy.name));
  return cards + "</div>\n";
}

// What both backends found, where both have run in this folder.
std::string BackendsHtml(const CamerasSummary& cameras) {
  if (!cameras.compared_with) return {};
  const ComparedBackend& other = *cameras.compared_with;
  const auto row = [](const std::string& backend, double error_px, double seconds) {
    return std::vector<std::string>{EscapeHtml(backend), fmt::format("{:.2f}", error_px),
                                    fmt::format("{:.1f}", seconds)};
  };
  return HtmlTable({{"backend"}, {"reprojection error, px"}, {"seconds"}},
                   {row(cameras.backend, cameras.mean_reprojection_error_px, cameras.seconds),
                    row(other.backend, other.mean_reprojection_error_px, other.seconds)}) +
         fmt::format(
             "<p>After alignment, over the {} photos that both placed: centres {:.3f} % of their extent apart (rms), "
             "rotations {:.3f} degrees.</p>\n",
             other.views, other.centre_rms_percent, other.rotation_rms_deg);
}

std::string NextHtml(const ReportInput& input, const CamerasSummary& cameras) {
  const std::string scene = input.scene_folder.string();
  std::string html = "<p>Walk through it:</p><pre>lumi-view " + EscapeHtml(scene) + "</pre>\n";
  if (!input.web.empty()) {
    const std::string file = EscapeHtml(input.web.filename().string());
    html += "<p>Or in a browser, here or on any other machine: <a href=\"" + file + "\">" + file +
            "</a> is all that it needs.</p>\n";
  }
  if (!input.video.empty()) {
    const std::string file = EscapeHtml(input.video.filename().string()),
                      how = EscapeHtml(DescribeFrames(SummaryOf<FramesSummary>(input, "video")));
    html += "<p>A fly-through is in <a href=\"" + file + "\">" + file + "</a>" + (how.empty() ? "" : ": " + how) +
            ".</p>\n";
  }
  html += "<p>See which photo is used where, or render a path of your own:</p><pre>lumi-render " + EscapeHtml(scene) +
          " -o false-color.mp4 --show false-color\nlumi-render " + EscapeHtml(scene) +
          " -o frames --path PATH.json</pre>\n";
  if (cameras.images_registered < cameras.images_total)
    html +=
        "<p>Photos that are missing can come in with more overlap: shoot between them and their neighbours, and run "
        "the same command again.</p>\n";
  return html;
}

// What accuracy costs at each stage that has measured it; how to measure, where none has.
std::string FrontsHtml(const ReportInput& input, const std::string& proxy) {
  const std::string scene = EscapeHtml(input.scene_folder.string());
  const std::string folder = fs::weakly_canonical(fs::absolute(input.scene_folder)).filename().string();
  const auto film = SummaryOf<FramesSummary>(input, "video").fidelity.value_or(FaithfulSettings());
  const std::string svg = FrontsSvg(input.scene_folder, {folder, proxy, film.name});
  const std::string how = "<pre>lumi-render tradeoff " + scene + " -o OUT          every setting of the renderer\n" +
                          "lumi-proxy dense " + scene + " --tradeoff        depth maps, meshes\n" +
                          "lumi-reconstruct PHOTOS -o " + scene + " --tradeoff     cameras</pre>\n";
  if (svg.empty())
    return "<p class=\"soft\">No stage of this scene has measured yet what its accuracy costs. These do, and the next "
           "report shows it:</p>" +
           how;
  return "<p class=\"soft\">A mark a setting; the steps are the front, where nothing is both cheaper and better. "
         "Diamonds are the "
         "settings that a stage measured from, and this scene's own.</p>\n<div class=\"frame\">" +
         HtmlInlineSvg(svg, "accuracy against time") + "</div>\n";
}

struct ReportedStage {
  std::string name;
  double seconds;
  JsonKeys summary;
};
void ListKeys(JsonKeys& j, ReportedStage& s) { j("name", s.name, "seconds", s.seconds, "summary", s.summary); }

}  // namespace

std::string DescribeFrames(const FramesSummary& s) {
  if (!std::isfinite(s.ms_per_frame)) return {};
  if (!s.fidelity) return fmt::format("a weight at every pixel, {:.1f} ms a frame", s.ms_per_frame);
  const FaithfulSettings& f = *s.fidelity;
  if (!f.db) return fmt::format("a weight at every pixel, {:.1f} ms a frame: {}", s.ms_per_frame, f.why);
  return fmt::format("{}, {:.1f} ms a frame (a weight at every pixel: {:.1f} ms, {:.1f} dB from it)", f.name,
                     s.ms_per_frame, f.pixel_ms, *f.db);
}

ReportFiles WriteReport(const ReportInput& input, ProgressSink& progress) {
  OpenOptions open;
  open.check_photos = false;
  open.undistort = false;
  const Scene scene = OpenScene(input.scene_folder, open, progress);
  const CamerasSummary cameras = CamerasOf(input);
  const auto holdout = SummaryOf<HoldoutSummary>(input, "holdout");
  const StageRecords records = ReadRecords(input.scene_folder);
  std::set<std::string> held_out;
  for (const HeldOutView& view : holdout.views) held_out.insert(view.name);

  const std::vector<SheetThumbnails> thumbnails =
      MakeThumbnails(SheetRows(input, scene, holdout), kThumbnailWidthPx, progress);

  ReportFiles files;
  files.html = input.scene_folder / "report.html";
  files.json = input.scene_folder / "report.json";

  const std::string title = fs::weakly_canonical(fs::absolute(input.scene_folder)).filename().string();
  std::string map = CamerasFromAboveSvg(scene, held_out);
  if (!map.empty())
    map = "<div class=\"frame\">" + map +
          "</div><p class=\"soft\"><span class=\"key\" style=\"background:var(--cool)\"></span>camera" +
          (held_out.empty() ? ""
                            : "<span class=\"key\" style=\"background:var(--accent)\"></span>held out for evaluation") +
          fmt::format("<span class=\"key\" style=\"background:var(--soft)\"></span>{} points in space</p>\n",
                      scene.points.size());

  std::string body = "<h1>" + EscapeHtml(title) + "</h1>\n<p class=\"soft\">A lumigraph of " +
                     EscapeHtml(input.source.string()) + ", made by lumi-pipeline " + kVersion + "</p>\n";
  body += CardsHtml(input, cameras, holdout);
  body += HtmlSection("What to do next", NextHtml(input, cameras));
  body += HtmlSection("Cameras seen from above", map);
  body += HtmlSection("The two backends", BackendsHtml(cameras));
  body += HtmlSection("Space and time", SamplingHtml(input));
  body += HtmlSection("Photos without a camera", MissingHtml(cameras));
  body += HtmlSection("The cameras that stand worst", StandingHtml(cameras));
  body += HtmlSection("Contact sheet", ContactSheetHtml(thumbnails));
  body += HtmlSection("Held-out photos", HoldoutHtml(holdout));
  body += HtmlSection("Time", TimeHtml(input));
  body += HtmlSection("Accuracy against time", FrontsHtml(input, scene.active_proxy));
  body += HtmlSection("Options and versions", OptionsHtml(input, records));

  JsonKeys report, provenance;
  std::vector<ReportedStage> stages;
  for (const StageResult& stage : input.stages) stages.push_back({stage.name, stage.computed_seconds, stage.summary});
  for (const auto& [stage, record] : records) provenance.Say(stage.c_str(), record);
  report.Say("schema", "lumi-pipeline-report")
      .Say("version", kVersion)
      .Say("scene", input.scene_folder)
      .Say("source", input.source)("stages", stages);
  report.Say("colmap_seconds", input.colmap_seconds)
      .Say("around_colmap_seconds", input.around_colmap_seconds)("provenance", provenance);

  const FolderLock lock(input.scene_folder);
  if (!thumbnails.empty()) {
    files.contact_sheet = input.scene_folder / "contact-sheet.jpg";
    WriteImage(files.contact_sheet, ComposeSheet(thumbnails, 4));
  }
  WriteTextAtomically(files.html, HtmlPage(title + " - lumigraph", body));
  WriteTextAtomically(files.json, report.Text(2) + "\n");
  return files;
}

}  // namespace lumi
