// The rows of Fig. 5-3: the optimum, and one of the five optimisations of sec. 5.1 after the other.
#include <fmt/format.h>

#include "render/picture/convert.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/sweep.h"
#include "render/tradeoff/tradeoff.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"
#include "scene/tradeoff/table.h"

namespace lumi {
namespace {

constexpr const char* kAblationMarker = "ablation.json";
constexpr int kNearest = 5;  // k of the thesis's fourth row
constexpr int kGrid = 25;    // samples a side of its fifth

struct Row {
  std::string name, what;
  RadianceSettings settings;
  std::string refused = {};  // why there is no picture; empty: there is one
  JsonKeys keys = {};        // of the settings
  double ms = 0;
  FrameError error = {};  // against the first
  std::optional<double> psnr_photo_db = {};
  std::string image = {}, false_color = {}, difference = {};  // files
};

void ListKeys(JsonKeys& j, Row& r) {
  j("name", r.name, "what", r.what, "settings", r.keys).IfAny("refused", r.refused);
  if (!r.refused.empty()) return;
  j("ms", r.ms);
  ListKeys(j, r.error);
  j("psnr_photo_db", r.psnr_photo_db, "coverage", r.error.coverage, "image", r.image, "false_color", r.false_color,
    "difference", r.difference);
}

struct Ablation {
  std::string view, proxy, backend, device;
  Eigen::Vector2i size_px;
  std::string compared_with = {};
  std::vector<Row> rows = {};
};

void ListKeys(JsonKeys& j, Ablation& a) {
  j("view", a.view, "proxy", a.proxy, "backend", a.backend, "device", a.device, "width", a.size_px.x(), "height",
    a.size_px.y(), "rows", a.rows, "compared_with", a.compared_with);
}

TradeoffTable TableOf(const Ablation& a) {
  using enum TradeoffRole;
  const auto error = [](double FrameError::*figure) { return [=](const Row& r) { return r.error.*figure; }; };
  return TradeoffTableOf<Row>(
      {{{"row", kSetting, "row", -12}, &Row::name},
       {{"what", kSetting, "", -58}, &Row::what},
       {{"ms", kCost, "ms", 10, "{:.2f}"},
        [](const Row& r) { return r.refused.empty() ? TradeoffValue(r.ms) : TradeoffValue(); }},
       {{"psnr_db", kMoreIsBetter, "PSNR dB", 9, "{:.2f}"}, error(&FrameError::psnr_db)},
       {{"mse", kLessIsBetter, "sq. error", 12, "{:.4g}"}, error(&FrameError::mse)},
       {{"false_color_mse", kLessIsBetter, "false colour", 12, "{:.4g}"}, error(&FrameError::false_color_mse)},
       {{"ssim"}, error(&FrameError::ssim)},
       {{"psnr_photo_db"}, &Row::psnr_photo_db},
       {{"coverage"}, error(&FrameError::coverage)},
       {{"", kFailed, "", 0, "not available: {}"}, &Row::refused}},
      a.rows);
}

std::vector<Row> Rows(const RadianceSettings& base) {
  std::vector<Row> rows;
  RadianceSettings s = WithMethod(base, Method::kOptimumPixel);
  s.alpha = s.beta = 1;
  s.k = kNearest;
  s.resolution = Resolution::kJacobian;
  s.resolution_low = 0.5;
  s.resolution_high = 2;
  rows.push_back({"optimum", "all cameras, angle and resolution, at every pixel", s});
  s.similarity = Similarity::kIdentity;
  s.k = 0;
  rows.push_back({"identity", "+ the similarity matrix is the identity", s});
  s.resolution = Resolution::kDistance;
  s.resolution_low = 0.7;
  rows.push_back({"distance", "+ resolution by distance", s});
  s.k = kNearest;
  s.correlation = Correlation::kInverse;
  rows.push_back({"nearest", fmt::format("+ the {} nearest cameras, 1/h", kNearest), s});
  s.grid_columns = s.grid_rows = kGrid;
  s.sampling = Sampling::kInterpolated;
  s.epipoles = true;
  rows.push_back({"sparse", fmt::format("+ {0}x{0} samples and epipoles, interpolated", kGrid), s});
  s.sampling = Sampling::kCandidates;
  rows.push_back({"candidates", fmt::format("the {0}x{0} samples choose cameras, pixels weigh them (ours)", kGrid), s});
  return rows;
}

struct Subject {
  std::string name;
  RenderRequest request;
  std::optional<Image8> photo;
};

Subject Choose(Workbench& bench, const MeasureOptions& o) {
  Subject s;
  const Scene& scene = bench.scene();
  const int width = bench.Width();
  if (!o.path.empty()) {
    s.name = o.path.stem().string();
    s.request.view = FirstOfPath(scene, o.path, width);
    return s;
  }
  TestView t = o.view.empty() ? HeldOutViews(scene, o.holdout, Fold::kReport, 1, width).front()
                              : TestViewOf(scene, ViewId{ViewCalled(scene, o.view)}, width);
  s.name = t.name;
  s.request.view = t.view;
  s.request.use = t.use;
  if (!o.view.empty()) {
    s.request.use.assign(scene.views.size(), true);
    s.request.use[static_cast<std::size_t>(t.id.value)] = false;
  }
  s.photo = std::move(t.photo);
  return s;
}

std::string Html(const Ablation& a) {
  std::string html = fmt::format(
      "<!doctype html><html lang='en'><meta charset='utf-8'><title>Fig. 5-3: {0}</title>\n"
      "<style>body{{font:15px/1.45 "
      "system-ui,sans-serif;margin:2rem;color:#24292f}}table{{border-collapse:collapse}}td,th{{padding:.4rem "
      ".6rem;text-align:left;"
      "vertical-align:top;border-bottom:1px solid "
      "#e4e7ea}}img{{width:300px;display:block}}small{{color:#6a737d}}</style>\n"
      "<h1>What each optimisation costs</h1><p>{0}, {1} px wide, proxy {2}, {3}. Differences are from the first row, "
      "times 4; the squared "
      "error is summed over the "
      "channels, mean over pixels.</p>\n<table><tr><th>row<th>picture<th>false colours<th>difference<th>figures\n",
      Escaped(a.view), a.size_px.x(), Escaped(a.proxy), Escaped(a.device));
  for (const Row& r : a.rows) {
    html += fmt::format("<tr><td><b>{}</b><br><small>{}</small>", Escaped(r.name), Escaped(r.what));
    if (!r.refused.empty()) {
      html += fmt::format("<td colspan='4'>not available: {}\n", Escaped(r.refused));
      continue;
    }
    for (const std::string& file : {r.image, r.false_color, r.difference})
      html += fmt::format("<td><img src='{0}' alt='{0}'>", file);
    html += fmt::format("<td>{:.1f} ms<br>PSNR {:.2f} dB<br>squared error {:.3g}<br>false colours {:.3g}", r.ms,
                        r.error.psnr_db, r.error.mse, r.error.false_color_mse);
    if (r.psnr_photo_db) html += fmt::format("<br>photo {:.2f} dB", *r.psnr_photo_db);
    html += "\n";
  }
  return html + "</table></html>\n";
}

}  // namespace

Answer RunAblation(const MeasureOptions& o, ProgressSink& sink) {
  RequireConsistent(o);
  if (o.output.empty()) throw UsageError("-o says where the pictures go");
  Workbench bench(o, kAblationMarker, sink);
  const std::string& proxy = bench.proxies().front();
  Subject subject = Choose(bench, o);
  Renderer& renderer = bench.Measured(proxy);
  Ablation ablation{subject.name, proxy.empty() ? bench.scene().active_proxy : proxy, o.backend, renderer.Device(),
                    subject.request.view.size_px};
  ablation.rows = Rows(bench.settings());
  std::vector<std::pair<std::string, Image8>> pictures;
  std::optional<ImageF> first, first_false_color;
  Progress progress(sink, "rendering the rows", static_cast<long>(ablation.rows.size()));
  for (std::size_t i = 0; i < ablation.rows.size(); ++i, progress.Step()) {
    Row& row = ablation.rows[i];
    subject.request.settings = bench.For(subject.request.view, row.settings);
    // The optimum at every pixel is what the others are compared with: from the CPU where OpenGL does not draw it.
    const bool from_cpu = o.backend == "gl" && MethodOf(row.settings) == Method::kOptimumPixel;
    row.keys = bench.Keys(row.settings);
    if (from_cpu) row.keys.Say("backend", "cpu");
    TimedFrame frame;
    ImageF false_color;
    try {
      Renderer& drawing = from_cpu ? bench.Cpu(proxy) : renderer;
      subject.request.show = Show::kColor;
      frame = TimeFrame(drawing, subject.request, o.repeats);
      subject.request.show = Show::kFalseColor;
      false_color = drawing.Render(subject.request);
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& e) {
      row.refused = e.what();
      sink.Message(row.name + " is not available: " + e.what());
      continue;
    }
    if (!first) {
      first = frame.image;
      first_false_color = false_color;
      ablation.compared_with = row.name;
    }
    row.ms = frame.ms;
    row.error = ErrorBetween(frame.image, *first);
    row.error.false_color_mse = SquaredError(false_color, *first_false_color);
    if (subject.photo) row.psnr_photo_db = ErrorAgainstPhoto(frame.image, *subject.photo).psnr_db;
    const std::string stem = fmt::format("{}-{}", i + 1, row.name);
    row.image = stem + ".png";
    row.false_color = stem + "-false-color.png";
    row.difference = stem + "-difference.png";
    pictures.emplace_back(row.image, ToRgb8(frame.image));
    pictures.emplace_back(row.false_color, ToRgb8(false_color));
    pictures.emplace_back(row.difference, DifferenceImage(ToRgb8(frame.image), ToRgb8(*first)));
  }
  if (!first) throw DataError("no row could be rendered: " + ablation.rows.front().refused);
  const JsonKeys keys(ablation);
  const TradeoffTable table = TableOf(ablation);
  // The marker is written first: if the run ends early, the next one may write into this folder.
  WriteTextAtomically(o.output / kAblationMarker, keys.Text(1) + "\n");
  for (const auto& [name, image] : pictures) WriteImage(o.output / name, image);
  WriteTextAtomically(o.output / "ablation.csv", CsvOf(table));
  WriteTextAtomically(o.output / "index.html", Html(ablation));
  return {keys, TextOf(table) + fmt::format("\n{}, {} px wide, against the row \"{}\"", ablation.view,
                                            ablation.size_px.x(), ablation.compared_with)};
}

}  // namespace lumi
