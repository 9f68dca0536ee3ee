// How wide the time window should be (thesis sec. 7.2): a narrow one leaves few photos, taken from other directions, a
// wide one blends moments that differ. Both errors are measured on the weights themselves, their sum on held-out
// photos.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/picture/convert.h"
#include "render/radiance/frame_plan.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/tradeoff.h"
#include "render/world/visibility_maps.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/angle.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"
#include "scene/tradeoff/table.h"

namespace lumi {
namespace {

constexpr const char* kWindowsMarker = "time-windows.json";
constexpr int kWindowRays = 32;  // a side of the view, at which weights are read

double CircularDistance(double a, double b, double period) {
  const double d = std::abs(a - b);
  if (!(period > 0)) return d;
  const double r = std::fmod(d, period);
  return std::min(r, period - r);
}

// Mask of the moving pixels of a ground-truth photo: SCENE/truth/moving/NAME.png as lumi-simulate writes it, or the
// black pixels of SCENE/masks; empty: unknown.
Image8 MovingPixels(const Scene& scene, const View& view, Eigen::Vector2i size_px) {
  if (scene.folder.empty()) return {};
  const bool simulated = !FindMask(scene.folder / "truth" / "moving", view.name).empty();
  const std::filesystem::path file =
      FindMask(simulated ? scene.folder / "truth" / "moving" : scene.folder / "masks", view.name);
  if (file.empty()) return {};
  const Image8 rgb = Resize(ReadImage8(file, 3), size_px.x(), size_px.y());
  Image8 mask(rgb.width, rgb.height, 1);
  for (std::size_t p = 0; p < mask.data.size(); ++p)  // simulated: 128 where something is at another moment only
    mask.data[p] = simulated ? (rgb.data[3 * p] > 191 ? 255 : 0) : static_cast<std::uint8_t>(255 - rgb.data[3 * p]);
  return mask;
}

struct Moment {
  TestView view;
  Image8 moving;
};

std::vector<Moment> MomentsOf(const Workbench& bench, const MeasureOptions& o, int width, ProgressSink& sink) {
  std::vector<Moment> moments;
  if (o.against.empty()) {
    for (TestView& t : HeldOutViews(bench.scene(), o.holdout, Fold::kReport, o.views, width)) {
      const View& view = bench.scene().views[static_cast<std::size_t>(t.id.value)];
      Image8 moving = MovingPixels(bench.scene(), view, t.view.size_px);
      moments.push_back({std::move(t), std::move(moving)});
    }
    return moments;
  }
  const Scene truth = OpenScene(o.against, {}, sink);
  RequireMetric(truth, "--against");
  const auto n = static_cast<int>(truth.views.size()), most = std::min(n, o.views);
  for (int i = 0; i < most; ++i) {
    const ViewId id{(2 * i + 1) * n / (2 * most)};
    TestView t = TestViewOf(truth, id, width);
    t.use.assign(bench.scene().views.size(), true);
    Image8 moving = MovingPixels(truth, truth.views[static_cast<std::size_t>(id.value)], t.view.size_px);
    moments.push_back({std::move(t), std::move(moving)});
  }
  return moments;
}

// Sums over rays that meet the proxy, of weighted means over photos.
struct Blur {
  double time_s = 0, angle_rad = 0;
  long rays = 0;
};

void AddBlur(const TracedProxy& proxy, const RenderRequest& request, const std::vector<View>& views, Blur& blur) {
  RadianceSettings settings = request.settings;
  settings.grid_columns = settings.grid_rows = 0;
  if (settings.k == 0) settings.k = kMaxBlend;
  const ViewSetup setup = MakeViewSetup(proxy.sources, request.view, settings, request.use);
  std::vector<Eigen::Vector3f> direction, normal(kWindowRays * kWindowRays);
  for (int y = 0; y < kWindowRays; ++y)
    for (int x = 0; x < kWindowRays; ++x)
      direction.push_back(
          (setup.ray_from_pixel * Eigen::Vector3d((x + 0.5) / kWindowRays * request.view.size_px.x(),
                                                  (y + 0.5) / kWindowRays * request.view.size_px.y(), 1))
              .normalized()
              .cast<float>());
  std::vector<float> t(direction.size());
  proxy.tracer.Trace(setup.desired.centre.cast<float>(), direction, t, normal);
  WeighScratch scratch;
  Measures m;
  for (std::size_t i = 0; i < direction.size(); ++i) {
    if (!std::isfinite(t[i]) || !(t[i] > 0)) continue;
    const RayWeights w = Weigh({setup.sources, settings.visibility ? &proxy.maps : nullptr, settings},
                               {direction[i], t[i], normal[i]}, scratch);
    if (w.count == 0) continue;
    EvaluateMeasures(setup.sources, settings, direction[i], t[i], normal[i], m);
    for (std::size_t c = 0; c < static_cast<std::size_t>(w.count); ++c) {
      const auto j = static_cast<std::size_t>(w.camera[c]);
      blur.angle_rad += static_cast<double>(w.weight[c]) * static_cast<double>(m.theta[j]);
      blur.time_s += static_cast<double>(w.weight[c]) *
                     CircularDistance(views[j].time_s.value_or(settings.time_s), settings.time_s, settings.period_s);
    }
    ++blur.rays;
  }
}

struct WindowRow {
  double width_s = 0;  // 0: without time
  double frame_s = 0;  // of the photos
  double psnr_db = 0, ms = 0, photos = 0, blur_s = 0, angle_deg = 0;
  std::optional<double> psnr_moving_db = {};

  // By the moving pixels where they are known.
  double Quality() const { return psnr_moving_db.value_or(psnr_db); }
  std::optional<double> Seconds() const { return width_s > 0 ? std::optional(width_s) : std::nullopt; }
  std::optional<double> Frames() const { return width_s > 0 ? std::optional(width_s / frame_s) : std::nullopt; }
  double BlurFrames() const { return blur_s / frame_s; }
};

TradeoffTable WindowTable(const std::vector<WindowRow>& rows) {
  using enum TradeoffRole;
  TradeoffTable table = TradeoffTableOf<WindowRow>(
      {{{"", kSetting, "window s", 12},
        [](const WindowRow& r) { return r.width_s > 0 ? fmt::format("{:.4f}", r.width_s) : "without time"; }},
       {{"window_s", kSetting}, &WindowRow::Seconds},
       {{"window_frames", kSetting, "frames", 8, "{:.1f}"}, &WindowRow::Frames},
       {{"photos_in_window", kFigure, "photos in it", 16, "{:.1f}"}, &WindowRow::photos},
       {{"temporal_blur_frames", kLessIsBetter, "blur, frames", 14, "{:.3f}"}, &WindowRow::BlurFrames},
       {{"angle_deg", kLessIsBetter, "angle deg", 10, "{:.3f}"}, &WindowRow::angle_deg},
       {{"psnr_db", kMoreIsBetter, "PSNR dB", 10, "{:.2f}"}, &WindowRow::psnr_db},
       {{"psnr_moving_db", kMoreIsBetter, "moving dB", 10, "{:.2f}"}, &WindowRow::psnr_moving_db},
       {{"ms", kCost, "ms", 9, "{:.2f}"}, &WindowRow::ms}},
      rows);
  table.rows_key = "rows";
  return table;
}

// Plots over the window's width: blur, and the error that follows.
std::vector<Plot> WindowPlots(const TradeoffTable& table, double best_frames, double without_db) {
  const PlotAxis x{"window, frames", true};
  const auto series = [](const char* name, const char* color, const char* y) {
    return TradeoffSeries{"", name, color, Marker::kCircle, true, y};
  };
  TradeoffPanel off{"What a photo is off",
                    "weighted means over the picture",
                    "window_frames",
                    x,
                    "temporal_blur_frames",
                    {"frames; degrees", false, true},
                    {series("temporal blur, frames", "#c0392b", ""), series("angle, degrees", "#2471a3", "angle_deg")}};
  TradeoffPanel error{"Error",
                      fmt::format("without time {:.2f} dB", without_db),
                      "window_frames",
                      x,
                      "psnr_db",
                      {"PSNR, dB"},
                      {series("all pixels", "#2471a3", ""), series("moving pixels", "#c0392b", "psnr_moving_db")}};
  off.label_front_only = error.label_front_only = true;  // there is none: a line's points need no labels
  error.marks = {{best_frames, "best"}};
  return {PlotOf(table, off), PlotOf(table, error)};
}

std::vector<double> Widths(double span_s, double frame_s, bool periodic) {
  std::vector<double> widths;
  // From the whole time span down to one photo's.
  for (double w = span_s; w >= frame_s && widths.size() < 12; w /= 2) widths.push_back(w);
  if (!periodic && !widths.empty()) widths.front() = span_s * 2;
  std::reverse(widths.begin(), widths.end());
  return widths;
}

}  // namespace

Answer RunTimeWindows(const MeasureOptions& o, ProgressSink& sink) {
  Workbench bench(o, kWindowsMarker, sink);
  const Scene& scene = bench.scene();
  std::vector<double> times;
  for (const View& v : scene.views)
    if (v.time_s) times.push_back(*v.time_s);
  if (times.size() < 3)
    throw DataError("the photos carry no times", "lumi-reconstruct VIDEO and lumi-timeperiodic give them", o.scene);
  std::sort(times.begin(), times.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
  if (steps.empty()) throw DataError("all photos carry the same time", "", o.scene);
  const double frame_s = Median(steps), period_s = scene.period_s.value_or(0),
               span_s = period_s > 0 ? period_s : times.back() - times.front();
  const std::string& proxy = bench.proxies().front();
  Renderer& renderer = bench.Measured(proxy);
  const int width = bench.Width();
  const std::vector<Moment> moments = MomentsOf(bench, o, width, sink);
  for (const Moment& m : moments)
    if (!m.view.view.time_s)
      throw DataError(m.view.name + " carries no time", "", o.against.empty() ? o.scene : o.against);
  const TracedProxy traced(scene, bench.mesh(proxy));

  // In a periodic scene, photos of all periods are neighbours in phase.
  const double nearest_s =
      period_s > 0 ? std::min(frame_s, period_s) * std::min(1.0, period_s / static_cast<double>(times.size()) / frame_s)
                   : frame_s;
  std::vector<double> widths = Widths(span_s, std::max(2 * nearest_s, span_s / 512), period_s > 0);
  widths.push_back(0);
  Progress progress(sink, "measuring time windows", static_cast<long>(widths.size() * moments.size()));
  std::vector<WindowRow> rows;
  for (const double w : widths) {
    WindowRow row{.width_s = w, .frame_s = frame_s};
    Blur blur;
    double moving_sum = 0;
    int moving_n = 0;
    std::vector<double> ms;
    const double n = static_cast<double>(moments.size());
    for (const Moment& m : moments) {
      RenderRequest request;
      request.view = m.view.view;
      request.use = m.view.use;
      request.settings = bench.settings();
      request.settings.time = w > 0;
      if (w > 0) request.settings.time_window_s = w;
      request.settings.time_s = *m.view.view.time_s;
      const TimedFrame frame = TimeFrame(renderer, request, o.repeats);
      const Image8 picture = ToRgb8(frame.image);
      row.psnr_db += Compare(picture, m.view.photo).psnr_db / n;
      if (!m.moving.empty())
        if (const auto psnr = PsnrWithin(picture, m.view.photo, m.moving)) moving_sum += *psnr, ++moving_n;
      ms.push_back(frame.ms);
      for (std::size_t v = 0; v < scene.views.size(); ++v)
        if (m.view.use[v] && scene.views[v].time_s &&
            (w == 0 || CircularDistance(*scene.views[v].time_s, *m.view.view.time_s, period_s) <= w / 2))
          row.photos += 1 / n;
      AddBlur(traced, request, scene.views, blur);
      progress.Step();
    }
    if (moving_n > 0) row.psnr_moving_db = moving_sum / moving_n;
    row.ms = Median(ms);
    if (blur.rays > 0) {
      row.blur_s = blur.time_s / static_cast<double>(blur.rays);
      row.angle_deg = blur.angle_rad / static_cast<double>(blur.rays) / kRadPerDeg;
    }
    rows.push_back(row);
  }
  const WindowRow& best = *std::max_element(
      rows.begin(), rows.end() - 1, [](const WindowRow& a, const WindowRow& b) { return a.Quality() < b.Quality(); });
  const double best_frames = best.width_s / frame_s, gain_db = best.Quality() - rows.back().Quality();
  TradeoffTable table = WindowTable(rows);
  table.facts = {{"proxy", proxy},         {"backend", o.backend},          {"device", renderer.Device()},
                 {"width", width},         {"views", moments.size()},       {"period_s", period_s},
                 {"frame_s", frame_s},     {"best.window_s", best.width_s}, {"best.window_frames", best_frames},
                 {"best.gain_db", gain_db}};
  if (!o.output.empty())
    WriteTradeoff(o.output / "time-windows", table, WindowPlots(table, best_frames, rows.back().Quality()));
  return {KeysOf(table),
          TextOf(table) +
              fmt::format("\n{} views, {} px wide; best: a window of {:.1f} frames, {:+.2f} dB against no window",
                          moments.size(), width, best_frames, gain_db)};
}

}  // namespace lumi
