#include "render/tradeoff/methods.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "render/comparators/comparators.h"
#include "render/holdout/evaluation_proxy.h"
#include "render/holdout/holdout.h"
#include "render/holdout/seen_pixels.h"
#include "render/picture/convert.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/ray_bench.h"
#include "render/tradeoff/ray_figures.h"
#include "render/tradeoff/sweep.h"
#include "render/tradeoff/table_3_1.h"
#include "render/world/visibility_maps.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"
#include "scene/tradeoff/table.h"

namespace lumi {
namespace {

constexpr const char* kMethodsMarker = "methods.json";
constexpr std::string_view kCandidates25 = "ulr-candidates", kOptimum = "ulr-optimum";
constexpr int kChoosingWidth = 400, kChoosingViews = 4;
constexpr double kAloneMs = 1000;  // a frame that takes longer is drawn once

// The settings that a method is chosen from: as many for this renderer as for the published ones, at most 12.
std::vector<RadianceSettings> Choices(std::string_view name, const RadianceSettings& base) {
  for (const Algorithm a : Algorithms())
    if (a != Algorithm::kUlr && Name(a) == name) return SettingsToChooseFrom(a, base);
  std::vector<RadianceSettings> all;
  const auto add = [&](Method way, Resolution resolution, double feather) -> RadianceSettings& {
    RadianceSettings& s = all.emplace_back(WithMethod(base, way));
    s.resolution = resolution;
    s.fov_feather = feather;
    return s;
  };
  // A wide feather hides a photo's border, and gives the point to photos farther away; the others have none.
  constexpr double kNarrowFeather = 0.005;
  for (const Resolution resolution : {Resolution::kOff, Resolution::kJacobian})
    for (const double feather : {base.fov_feather, kNarrowFeather})
      if (name == kOptimum)
        for (const double r_max_deg : {0.25, 2.5, 10.0}) {  // photos of a light field are as close as the first
          RadianceSettings& s = add(Method::kOptimumPixel, resolution, feather);
          s.r_max_rad = r_max_deg * kRadPerDeg;
          s.r_min_rad = std::min(s.r_min_rad, s.r_max_rad);
        }
      else
        for (const int k : {2, 4, 8})
          add(name == kCandidates25 ? Method::kCandidates : Method::kPixel, resolution, feather).k = k;
  return all;
}

// What a method reads of the settings, in short.
std::string Chosen(const RadianceSettings& s) {
  if (s.method != Algorithm::kUlr) {
    std::string text;
    if (s.method_count >= 0) text += fmt::format("count {:g}", s.method_count);
    if (s.method_parameter >= 0) text += fmt::format("{}parameter {:g}", text.empty() ? "" : ", ", s.method_parameter);
    return text.empty() ? "as published" : text;
  }
  if (s.similarity == Similarity::kFull)
    return fmt::format("r_max {:g} deg, resolution {}, feather {:g}", std::round(s.r_max_rad / kRadPerDeg * 100) / 100,
                       Name(s.resolution), s.fov_feather);
  return fmt::format("k {}, resolution {}, feather {:g}", s.k, Name(s.resolution), s.fov_feather);
}

// A held-out photo, the renderer over a proxy that was made without it, and the pixels that two photos see.
struct Judged {
  TestView view;
  Renderer* renderer = nullptr;
  Image8 seen;
};

struct ViewScore {
  std::string name;
  double psnr_db = 0, ssim = 0, coverage = 0, ms = 0;
  std::optional<double> psnr_seen_db;
};

void ListKeys(JsonKeys& j, ViewScore& v) {
  j("name", v.name, "psnr_db", v.psnr_db, "psnr_seen_db", v.psnr_seen_db, "ssim", v.ssim, "coverage", v.coverage, "ms",
    v.ms);
}

struct MethodRow {
  std::string method, chosen, refused;
  JsonKeys settings;
  int tried = 0;
  std::optional<double> choosing_psnr_seen_db;
  std::vector<ViewScore> views;

  double Mean(double ViewScore::*figure) const {
    double sum = 0;
    for (const ViewScore& v : views) sum += v.*figure;
    return views.empty() ? std::numeric_limits<double>::quiet_NaN() : sum / static_cast<double>(views.size());
  }
  std::optional<double> Seen() const {
    double sum = 0;
    int n = 0;
    for (const ViewScore& v : views)
      if (v.psnr_seen_db) sum += *v.psnr_seen_db, ++n;
    return n > 0 ? std::optional(sum / n) : std::nullopt;
  }
  double Ms() const {
    std::vector<double> ms;
    for (const ViewScore& v : views) ms.push_back(v.ms);
    return Median(ms);
  }
};

void ListKeys(JsonKeys& j, MethodRow& r) {
  j("method", r.method, "settings", r.settings, "choosing_psnr_seen_db", r.choosing_psnr_seen_db, "views", r.views);
}

class MethodBench {
 public:
  MethodBench(const MethodsOptions& o, ProgressSink& sink)
      : o_(o), sink_(sink), bench_(o, kMethodsMarker, sink), proxy_(bench_.proxies().front()) {
    few_ = bench_.scene().views.size() < 24;
    const int width = bench_.Width();
    choosing_ = Photos(Fold::kChoose, kChoosingViews, std::min(width, kChoosingWidth));
    reporting_ = Photos(Fold::kReport, o.most_views, width);
  }

  MethodRow Nearest() {
    MethodRow row{"nearest photo", "one photo", {}, {}, 1, {}, {}};
    for (const Judged& j : reporting_) {
      RenderRequest r = bench_.Request(j.view, bench_.settings());
      const ViewId nearest = NearestPhoto(bench_.scene(), j.view.id, j.view.use, r.settings);
      r.settings = WithMethod(r.settings, Method::kPixel);
      r.settings.method = Algorithm::kUlr;
      r.settings.k = 1;
      r.use.assign(bench_.scene().views.size(), false);
      r.use[static_cast<std::size_t>(nearest.value)] = true;
      row.views.push_back(Judge(j, r, o_.repeats));
    }
    return row;
  }

  MethodRow Run(const std::string& name) {
    MethodRow row;
    row.method = name;
    try {
      const std::vector<RadianceSettings> choices = Choices(name, bench_.settings());
      row.tried = static_cast<int>(choices.size());
      const RadianceSettings* best = &choices.front();
      double most = -std::numeric_limits<double>::infinity();
      for (const RadianceSettings& s : choices) {
        MethodRow of;
        if (choices.size() > 1)
          for (const Judged& j : choosing_) of.views.push_back(Judge(j, bench_.Request(j.view, s), 0));
        if (const double seen = of.Seen().value_or(of.Mean(&ViewScore::psnr_db)); seen > most) {
          most = seen;
          best = &s;
          row.choosing_psnr_seen_db = of.Seen();
        }
      }
      row.chosen = Chosen(*best);
      row.settings = bench_.Keys(*best);
      for (const Judged& j : reporting_) row.views.push_back(Judge(j, bench_.Request(j.view, *best), o_.repeats));
    } catch (const DataError& e) {
      row.refused = e.what();
    }
    return row;
  }

  // Properties of the method with its published settings; of this renderer with its own defaults.
  MethodProperties Properties(const std::string& name) {
    MethodProperties row{name, {}};
    if (!rays_) {
      rays_ = std::make_unique<RayBench>(bench_.scene(), bench_.mesh(proxy_));
      // If the proxy is a plane, comparing it with a plane says nothing.
      if (CanOcclude(bench_.mesh(proxy_)))
        plane_ = bench_.lumigraph().NewRenderer(MakeCpuRenderer, FacingPlane(bench_.scene(), 1));
    }
    RadianceSettings s = WithMethod(bench_.settings(), Method::kPixel);
    for (const Algorithm a : Algorithms())
      if (Name(a) == name) s.method = a;
    if (s.k == 0) s.k = 4;
    s.method_count = s.method_parameter = -1;
    const Frames drawn = Draw(s);
    if (!ours_) ours_ = DrawOurs();
    const double ms = s.method == Algorithm::kUlr ? ours_->ms : drawn.ms;
    // Resolution is switched on to show that the method can use it, even if the scene does not need it.
    if (s.method == Algorithm::kUlr && s.resolution == Resolution::kOff) s.resolution = Resolution::kJacobian;
    RayFigures rays;
    try {
      rays = MeasureRays(*rays_, s);
    } catch (const DataError&) {  // the method accepts the held-out views, but no views beside the cameras
    }
    std::optional<double> correspondence;
    if (plane_) {
      correspondence = 0;
      for (const Judged& j : choosing_) {
        const RenderRequest request = bench_.Request(j.view, s);  // accepted at full size, so accepted here
        const Judged flat{j.view, plane_.get(), j.seen};
        *correspondence +=
            (Judge(j, request, 0).psnr_seen_db.value_or(0) - Judge(flat, request, 0).psnr_seen_db.value_or(0)) /
            static_cast<double>(choosing_.size());
      }
    }
    row.figures = {rays.photos_used,
                   drawn.coverage / ours_->coverage,
                   ms,
                   correspondence,
                   rays.direction_error,
                   rays.own_weight,
                   rays.ray_difference,
                   rays.jump,
                   rays.border_weight,
                   rays.coarse_weight_ratio,
                   rays.hidden_weight};
    return row;
  }

  const std::string& proxy() const { return proxy_.empty() ? bench_.scene().active_proxy : proxy_; }
  std::string device() { return reporting_.front().renderer->Device(); }
  std::size_t views() const { return reporting_.size(); }
  int width() const { return bench_.Width(); }
  double seen_share() const {
    double sum = 0;
    for (const Judged& j : reporting_) sum += ShareOf(j.seen) / static_cast<double>(reporting_.size());
    return sum;
  }

 private:
  // If there are few photos, each is left out alone: settings are chosen on every second one, and reported on the
  // others.
  std::vector<Judged> Photos(Fold fold, int most, int width) {
    std::vector<TestView> views;
    const Scene& scene = bench_.scene();
    if (!few_) {
      views = HeldOutViews(scene, o_.holdout, fold, most, width);
    } else {
      for (std::int32_t i = fold == Fold::kReport ? 0 : 1; i < static_cast<std::int32_t>(scene.views.size()); i += 2) {
        views.push_back(TestViewOf(scene, {i}, width));
        views.back().use.assign(scene.views.size(), true);
        views.back().use[static_cast<std::size_t>(i)] = false;
      }
      if (static_cast<int>(views.size()) > most) views.resize(static_cast<std::size_t>(most));
    }
    if (views.empty()) throw DataError("too few photos to hold any out", "add photos", scene.folder);
    std::vector<Judged> judged;
    for (TestView& v : views) {
      Over& over = RendererFor(v.id);
      Image8 seen = over.seen->Mask(v.view, v.use);
      judged.push_back({std::move(v), over.renderer.get(), std::move(seen)});
    }
    return judged;
  }

  struct Over {
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<SeenPixels> seen;
  };
  Over& RendererFor(ViewId photo) {
    const Scene& scene = bench_.scene();
    const std::string name =
        few_ ? ProxyFor(scene.folder, proxy_, kHoldoutEach, photo, static_cast<int>(scene.views.size())) : proxy_;
    Over& over = over_[name];
    if (over.renderer) return over;
    // Workbench already uses the proxy that was made without the folds' photos.
    const Mesh mesh = few_ ? LoadProxy(scene, name) : bench_.mesh(proxy_);
    over.renderer = bench_.lumigraph().NewRenderer(MakeCpuRenderer, mesh);
    over.seen = std::make_unique<SeenPixels>(*WorldOf(scene, mesh));
    return over;
  }

  // The reported views, drawn with these settings.
  struct Frames {
    double ms = 0, coverage = 0;
  };
  Frames Draw(const RadianceSettings& s) {
    Frames mean;
    for (const Judged& j : reporting_) {
      const TimedFrame frame = TimeFrame(*j.renderer, bench_.Request(j.view, s), o_.repeats, kAloneMs);
      mean.ms += frame.ms / static_cast<double>(reporting_.size());
      mean.coverage += Coverage(frame.image) / static_cast<double>(reporting_.size());
    }
    return mean;
  }
  // This renderer's time is that of its faster way: a weight a pixel, or candidates on sparse samples.
  Frames DrawOurs() {
    Frames pixel = Draw(WithMethod(bench_.settings(), Method::kPixel));
    pixel.ms = std::min(pixel.ms, Draw(WithMethod(bench_.settings(), Method::kCandidates)).ms);
    return pixel;
  }

  // repeats: timed frames; 0: the picture is drawn once.
  ViewScore Judge(const Judged& j, const RenderRequest& request, int repeats) {
    ViewScore score{j.view.name, 0, 0, 0, 0, std::nullopt};
    const TimedFrame frame = TimeFrame(*j.renderer, request, repeats, kAloneMs);
    const Image8 picture = ToRgb8(frame.image);
    const ImageDifference d = Compare(picture, j.view.photo);
    score.psnr_db = d.psnr_db;
    score.ssim = d.ssim;
    score.coverage = Coverage(frame.image);
    score.ms = frame.ms;
    if (!j.seen.empty()) score.psnr_seen_db = PsnrWithin(picture, j.view.photo, j.seen);
    return score;
  }

  const MethodsOptions& o_;
  ProgressSink& sink_;
  Workbench bench_;
  std::string proxy_;
  bool few_ = false;
  std::map<std::string, Over> over_;
  std::vector<Judged> choosing_, reporting_;
  std::unique_ptr<RayBench> rays_;   // made when first wanted
  std::optional<Frames> ours_;       // the same
  std::unique_ptr<Renderer> plane_;  // over a plane through the scene; none if the proxy is a plane
};

TradeoffTable TableOf(const std::vector<MethodRow>& rows, double nearest_ms) {
  using enum TradeoffRole;
  const auto of = [](auto value) {
    return [=](const MethodRow& r) { return r.refused.empty() ? TradeoffValue(value(r)) : TradeoffValue(); };
  };
  TradeoffTable table = TradeoffTableOf<MethodRow>(
      {{{"method", kSetting, "method", -20}, &MethodRow::method},
       {{"chosen", kSetting, "settings", -36}, &MethodRow::chosen},
       {{"tried", kSetting, "of", 3, "{}"}, &MethodRow::tried},
       {{"psnr_seen_db", kMoreIsBetter, "seen dB", 9, "{:.2f}"}, of([](const MethodRow& r) { return r.Seen(); })},
       {{"psnr_db", kMoreIsBetter, "all dB", 8, "{:.2f}"},
        of([](const MethodRow& r) { return r.Mean(&ViewScore::psnr_db); })},
       {{"ssim", kFigure, "SSIM", 7, "{:.3f}"}, of([](const MethodRow& r) { return r.Mean(&ViewScore::ssim); })},
       {{"coverage", kFigure, "covered", 9, "{:.1f}%"},
        of([](const MethodRow& r) { return r.Mean(&ViewScore::coverage); })},
       {{"ms", kCost, "ms", 9, "{:.1f}"}, of([](const MethodRow& r) { return r.Ms(); })},
       {{"ms_over_nearest", kFigure, "x bare loop", 12, "{:.2f}"},
        of([=](const MethodRow& r) { return r.Ms() / nearest_ms; })},
       {{"refused", kFailed, "", 0, "not available: {}"}, &MethodRow::refused}},
      rows);
  table.rows_key = "methods";
  return table;
}

// A row a method and view.
std::string CsvOfViews(const std::vector<MethodRow>& rows) {
  std::string csv = "method,view,psnr_seen_db,psnr_db,ssim,coverage,ms\n";
  for (const MethodRow& r : rows)
    for (const ViewScore& v : r.views)
      csv += fmt::format("{},\"{}\",{},{:.4f},{:.5f},{:.5f},{:.3f}\n", r.method, v.name,
                         v.psnr_seen_db ? fmt::format("{:.4f}", *v.psnr_seen_db) : "", v.psnr_db, v.ssim, v.coverage,
                         v.ms);
  return csv;
}

// Whether this renderer is ahead of all the others, and by how much.
std::string WhoIsAhead(const std::vector<MethodRow>& rows) {
  const MethodRow *ours = nullptr, *theirs = nullptr;
  for (const MethodRow& r : rows) {
    if (!r.Seen()) continue;
    const MethodRow*& best = r.method.starts_with("ulr") ? ours : theirs;
    if (!best || *r.Seen() > *best->Seen()) best = &r;
  }
  if (!ours || !theirs) return {};
  const double ahead = *ours->Seen() - *theirs->Seen();
  return fmt::format("{} is {:.2f} dB {} {}, over seen pixels", ours->method, std::abs(ahead),
                     ahead >= 0 ? "ahead of the best of the others," : "behind", theirs->method);
}

}  // namespace

std::vector<std::string> MethodNames() {
  std::vector<std::string> names{std::string(Name(Algorithm::kUlr)), std::string(kCandidates25), std::string(kOptimum)};
  for (const Algorithm a : Algorithms())
    if (a != Algorithm::kUlr) names.emplace_back(Name(a));
  return names;
}

Answer RunMethods(const MethodsOptions& o, ProgressSink& sink) {
  const std::vector<std::string> known = MethodNames(), wanted = o.methods.empty() ? known : o.methods;
  for (const std::string& name : wanted)
    if (std::ranges::find(known, name) == known.end())
      throw UsageError(fmt::format("--methods: {} is none of {}", name, fmt::join(known, ", ")));
  MethodBench bench(o, sink);
  Progress progress(sink, "measuring methods", static_cast<long>(wanted.size() + 1));
  std::vector<MethodRow> rows{bench.Nearest()};
  progress.Step();
  for (const std::string& name : wanted) {
    rows.push_back(bench.Run(name));
    progress.Step();
  }
  TradeoffTable table = TableOf(rows, rows.front().Ms());
  table.facts = {{"scene", o.scene.filename().string()},
                 {"proxy", bench.proxy()},
                 {"device", bench.device()},
                 {"width", bench.width()},
                 {"views", bench.views()},
                 {"seen", bench.seen_share()}};
  JsonKeys keys = KeysOf(table);
  keys.Say("per_view", rows);
  SceneFigures figures{o.scene.filename().string(), {}};
  if (o.properties) {
    // In a table of ticks this renderer is one row.
    Progress measuring(sink, "measuring properties", static_cast<long>(rows.size()));
    for (const MethodRow& r : rows) {
      if (&r != &rows.front() && r.method != kCandidates25 && r.method != kOptimum)
        figures.properties.push_back(r.refused.empty() ? bench.Properties(r.method) : MethodProperties{r.method, {}});
      measuring.Step();
    }
    keys.Say("properties", figures.properties);
  }
  if (!o.output.empty()) {
    TradeoffPanel panel{"Quality against time",
                        "held-out photos, seen pixels",
                        "ms",
                        {"milliseconds a frame", true},
                        "psnr_seen_db",
                        {"PSNR, dB"},
                        {{""}}};
    WriteTradeoff(o.output / "methods", table, {PlotOf(table, panel)}, keys.Text(1) + "\n");
    WriteTextAtomically(o.output / "methods-views.csv", CsvOfViews(rows));
  }
  const std::string verdict = WhoIsAhead(rows);
  std::string text = TextOf(table) + (verdict.empty() ? "" : "\n" + verdict);
  if (o.properties) text += "\n\n" + TableText({figures});
  return {keys, text};
}

}  // namespace lumi
