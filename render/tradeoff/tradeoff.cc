#include "render/tradeoff/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "render/holdout/holdout.h"
#include "render/picture/convert.h"
#include "render/settings_json.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/front.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"
#include "scene/tradeoff/json_rows.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTradeoffMarker = "tradeoff.json";
constexpr double kBudgetsMs[] = {8, 16, 33, 100};
constexpr int kReferenceWidth = 480, kProbeWidth = 64, kLeastReferenceWidth = 160;
constexpr double kSlowMs = 2000;
constexpr double kLeastShown =
    1e-3;  // squared error that the logarithmic axis of Fig. 5-4 ends at: no screen shows less
constexpr double kReferenceMs = 30000;  // what the reference pictures may take together

struct Pair {
  ImageF color, false_color;
};

struct MeasuredPoint {
  std::string name, proxy;
  RadianceSettings settings;
  double ms = 0, plan_ms = 0, coverage = 0;  // times: medians
  std::vector<double> times, plan_times;
  FrameError holdout;
  std::optional<FrameError> optimum,
      pixel;  // against the optimum; against the same weights at every pixel (sparse points)
  double false_color_optimum = 0, false_color_pixel = 0;
  double pixel_worst_db = 0;  // of the views

  FrontPoint ForFront() const {
    FrontPoint p{name, settings, ms, std::nullopt, holdout.psnr_db};
    if (optimum) p.psnr_optimum_db = optimum->psnr_db;
    return p;
  }
};

Json ErrorJson(const FrameError& e, double false_color) {
  return {{"psnr_db", e.psnr_db}, {"ssim", e.ssim}, {"mse", e.mse}, {"false_color_mse", false_color}};
}

Json PointJson(const MeasuredPoint& p, const Workbench& bench) {
  Json j = {{"name", p.name},
            {"method", Name(MethodOf(p.settings))},
            {"proxy", p.proxy},
            {"settings", bench.ToJson(p.settings)},
            {"ms", p.ms},
            {"plan_ms", p.plan_ms},
            {"psnr_optimum_db", p.optimum ? Json(p.optimum->psnr_db) : Json(nullptr)},
            {"psnr_holdout_db", p.holdout.psnr_db},
            {"ssim_holdout", p.holdout.ssim},
            {"mse_holdout", p.holdout.mse},
            {"coverage", p.coverage},
            {"frames_timed", p.times.size()}};
  if (p.optimum) j["against_optimum"] = ErrorJson(*p.optimum, p.false_color_optimum);
  if (p.pixel) j["against_pixel"] = ErrorJson(*p.pixel, p.false_color_pixel);
  return j;
}

// "candidates 25x25, k 4 (mesh)", under this heading.
TradeoffField<Json> SettingField(const char* heading, int width) {
  return {{"", TradeoffRole::kSetting, heading, -width}, [](const Json& p) {
            return fmt::format("{} ({})", p["name"].get<std::string>(), p["proxy"].get<std::string>());
          }};
}

TradeoffTable PointTable(const Json& points) {
  using enum TradeoffRole;
  std::vector<TradeoffField<Json>> fields = {SettingField("setting (proxy)", 52)};
  for (const char* key :
       {"name", "method", "proxy", "settings.k", "settings.grid", "settings.epipoles", "settings.resolution"})
    fields.push_back(FromJson<Json>({key, kSetting}));
  for (const TradeoffColumn& column :
       {TradeoffColumn{"ms", kCost, "ms", 9, "{:.2f}"}, TradeoffColumn{"plan_ms", kCost},
        TradeoffColumn{"psnr_optimum_db", kMoreIsBetter, "optimum dB", 13, "{:.2f}"},
        TradeoffColumn{"psnr_holdout_db", kMoreIsBetter, "held-out dB", 13, "{:.2f}"}, TradeoffColumn{"ssim_holdout"},
        TradeoffColumn{"mse_holdout"}, TradeoffColumn{"coverage"}})
    fields.push_back(FromJson<Json>(column));
  for (const std::string reference : {"optimum", "pixel"})
    for (const std::string figure : {"psnr", "ssim", "mse", "false_color_mse"}) {
      const std::string unit = figure == "psnr" ? "_db" : "";
      if (reference + figure == "optimumpsnr") continue;  // is there
      fields.push_back(FromJson<Json>(
          {"against_" + reference + "." + figure + unit, kFigure, "", 0, "", figure + "_" + reference + unit}));
    }
  return TradeoffTableOf<Json>(fields, points.get<std::vector<Json>>());
}

class Tradeoff {
 public:
  Tradeoff(const MeasureOptions& o, ProgressSink& sink) : o_(o), sink_(sink), bench_(o, kTradeoffMarker, sink) {
    width_ = bench_.Width();
    views_ = HeldOutViews(bench_.scene(), o_.holdout, Fold::kChoose, o_.views, width_);
    // Fig. 5-4 is of one virtual view where one is given.
    first_figure_view_ = o_.path.empty() ? 0 : views_.size();
    last_figure_view_ = o_.path.empty() ? views_.size() : views_.size() + 1;
    if (!o_.path.empty()) FirstOfPath(bench_.scene(), o_.path, 16);  // its failure now, not after the sweep's
  }

  std::string Run() {
    DecideReference();
    std::vector<std::pair<std::string, SweepPoint>> table;
    for (std::size_t i = 0; i < bench_.proxies().size(); ++i)
      for (SweepPoint& p : SweepTable(bench_.settings(), i > 0      ? SweepSize::kMethods
                                                         : o_.quick ? SweepSize::kQuick
                                                                    : SweepSize::kFull))
        table.emplace_back(bench_.proxies()[i], std::move(p));
    {
      // Repeats come in rounds over a proxy's settings: what else the machine does for a moment slows all of them, not
      // one.
      Progress progress(sink_, "measuring settings", static_cast<long>(table.size()) * o_.repeats);
      for (std::size_t begin = 0, end = 0; begin < table.size(); begin = end) {
        const std::string proxy = table[begin].first;
        const std::size_t first_point = points_.size();
        for (end = begin; end < table.size() && table[end].first == proxy; ++end) {
          Measure(proxy, table[end].second);
          progress.Step();
        }
        references_.clear();
        for (int round = 1; round < o_.repeats; ++round) {
          for (std::size_t i = first_point; i < points_.size(); ++i) Again(points_[i]);
          progress.Step(static_cast<long>(end - begin));
        }
        if (end < table.size()) bench_.Drop(proxy);
      }
    }
    for (MeasuredPoint& p : points_) {
      p.ms = Median(p.times);
      p.plan_ms = Median(p.plan_times);
    }
    if (points_.empty()) throw DataError("no setting could be rendered: " + refusals_.begin()->second);
    for (const auto& [what, why] : refusals_) sink_.Message(what + " was left out: " + why);
    Json j = Summary();
    Write(j);
    return j.dump();
  }

 private:
  const View& ViewOf(const TestView& t) const { return bench_.scene().views[static_cast<std::size_t>(t.id.value)]; }

  RenderRequest Request(const TestView& t, const RadianceSettings& settings, bool reference) const {
    RenderRequest r;
    r.view = t.view;
    if (reference && reference_width_ < t.camera.width_px) {
      r.view = t.AtWidth(reference_width_, ViewOf(t).cam_from_world);
      r.view.time_s = t.view.time_s;
      r.view.gain = t.view.gain;
    }
    r.settings = bench_.For(r.view, settings);
    r.use = t.use;
    return r;
  }

  // Whether the optimum is there, and how large its reference pictures may be: by a small picture's time.
  void DecideReference() {
    const std::string& proxy = bench_.proxies().front();
    reference_width_ = std::min(width_, o_.reference_width_px > 0 ? o_.reference_width_px
                                        : o_.quick                ? kReferenceWidth / 2
                                                                  : kReferenceWidth);
    RenderRequest request = Request(views_.front(), ReferenceSettings(bench_.settings()), false);
    const int small = std::min(kProbeWidth, width_);
    request.view = views_.front().AtWidth(small, ViewOf(views_.front()).cam_from_world);
    try {
      const TimedFrame probe = TimeFrame(bench_.Cpu(proxy), request, 1);
      optimum_ = true;
      if (o_.reference_width_px > 0) return;
      // Colour and false colour, for each view and proxy.
      const double frames = 2.0 * static_cast<double>(views_.size() * bench_.proxies().size());
      const double most = small * std::sqrt((o_.quick ? 0.3 : 1.0) * kReferenceMs / (frames * probe.ms));
      reference_width_ =
          std::clamp(static_cast<int>(most), std::min(kLeastReferenceWidth, reference_width_), reference_width_);
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& e) {
      no_optimum_ = e.what();
      sink_.Message("no figures against the optimum: " + no_optimum_);
    }
  }

  // The reference pictures of one view for these settings; made once a proxy. The view after the last is the path's.
  const Pair& Reference(const std::string& proxy, const RadianceSettings& settings, std::size_t view) {
    auto& kept = references_[ToJson(settings).dump()];
    if (kept.size() <= view) kept.resize(view + 1);
    if (kept[view].color.empty()) kept[view] = RenderPair(bench_.Cpu(proxy), view, settings);
    return kept[view];
  }

  Pair RenderPair(Renderer& renderer, std::size_t view, const RadianceSettings& settings) {
    RenderRequest r;
    if (view < views_.size()) {
      r = Request(views_[view], settings, true);
    } else {
      r.view = FirstOfPath(bench_.scene(), o_.path, reference_width_);
      r.settings = bench_.For(r.view, settings);
    }
    Pair pair;
    pair.color = renderer.Render(r);
    r.show = Show::kFalseColor;
    pair.false_color = renderer.Render(r);
    return pair;
  }

  void Measure(const std::string& proxy, const SweepPoint& point) {
    MeasuredPoint m;
    m.name = point.name;
    m.proxy = proxy;
    m.settings = point.settings;
    try {
      Renderer& renderer = bench_.Measured(proxy);
      std::vector<FrameError> holdout, optimum, pixel;
      const double n = static_cast<double>(views_.size());
      for (std::size_t v = 0; v < views_.size(); ++v) {
        TimedFrame frame = TimeFrame(renderer, Request(views_[v], m.settings, false), 1);
        m.times.insert(m.times.end(), frame.all_ms.begin(), frame.all_ms.end());
        m.plan_times.push_back(renderer.Statistics().plan_ms);
        holdout.push_back(ErrorAgainstPhoto(frame.image, views_[v].photo));
        m.coverage += Coverage(frame.image) / n;
        if (!optimum_) continue;
        const Pair mine = RenderPair(renderer, v, m.settings);
        const Pair& best = Reference(proxy, ReferenceSettings(bench_.settings()), v);
        optimum.push_back(ErrorBetween(mine.color, best.color));
        m.false_color_optimum += SquaredError(mine.false_color, best.false_color) / n;
      }
      const bool per_pixel_is_there = m.settings.similarity == Similarity::kIdentity || optimum_;
      if (m.settings.Sparse() && per_pixel_is_there) {
        const double views = static_cast<double>(last_figure_view_ - first_figure_view_);
        for (std::size_t v = first_figure_view_; v < last_figure_view_; ++v) {
          const Pair mine = RenderPair(renderer, v, m.settings);
          const Pair& dense = Reference(proxy, PerPixel(m.settings), v);
          pixel.push_back(ErrorBetween(mine.color, dense.color));
          m.false_color_pixel += SquaredError(mine.false_color, dense.false_color) / views;
        }
      }
      m.holdout = Mean(holdout);
      if (!optimum.empty()) m.optimum = Mean(optimum);
      if (!pixel.empty()) {
        m.pixel = Mean(pixel);
        m.pixel_worst_db = std::min_element(pixel.begin(), pixel.end(), [](const FrameError& a, const FrameError& b) {
                             return a.psnr_db < b.psnr_db;
                           })->psnr_db;
      }
      points_.push_back(std::move(m));
    } catch (const Interrupted&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {
      refusals_.emplace(point.name, e.what());
    }
  }

  // Another round's frames. What takes seconds is not noise any more.
  void Again(MeasuredPoint& m) {
    if (Median(m.times) > kSlowMs) return;
    Renderer& renderer = bench_.Measured(m.proxy);
    for (const TestView& t : views_) {
      const TimedFrame frame = TimeFrame(renderer, Request(t, m.settings, false), 0);
      m.times.push_back(frame.first_ms);
      m.plan_times.push_back(renderer.Statistics().plan_ms);
    }
  }

  // Of all points; those that are not of the proxy (empty: any), or of no front, have no axes.
  std::vector<CostAndQuality> AxesOf(const std::string& proxy) const {
    std::vector<CostAndQuality> axes;
    for (const MeasuredPoint& p : points_) {
      // What an effect costs is shown, but evidence switches effects, not a budget.
      const bool traded = WithTradedSettings(bench_.settings(), p.settings) == p.settings;
      axes.push_back(traded && (proxy.empty() || p.proxy == proxy) ? CostAndQuality{p.ms, p.holdout.psnr_db}
                                                                   : CostAndQuality());
    }
    return axes;
  }

  // What a recommended setting does on photos that nothing was chosen on.
  Json Report(const MeasuredPoint& p) {
    std::vector<FrameError> errors;
    double coverage = 0;
    Renderer& renderer = bench_.Measured(p.proxy);
    for (const TestView& t : report_views_) {
      const ImageF image = renderer.Render(Request(t, p.settings, false));
      errors.push_back(ErrorAgainstPhoto(image, t.photo));
      coverage += Coverage(image) / static_cast<double>(report_views_.size());
    }
    const FrameError e = Mean(errors);
    return {{"psnr_db", e.psnr_db}, {"ssim", e.ssim}, {"coverage", coverage}};
  }

  Json NearestPhotoReport() {
    std::vector<FrameError> errors;
    for (const TestView& t : report_views_) {
      RadianceSettings s = WithMethod(bench_.settings(), Method::kPixel);
      s.k = 1;
      RenderRequest r = Request(t, s, false);
      const ViewId nearest = NearestPhoto(bench_.scene(), t.id, t.use, s);
      r.use.assign(t.use.size(), false);
      r.use[static_cast<std::size_t>(nearest.value)] = true;
      errors.push_back(ErrorAgainstPhoto(bench_.Cpu(bench_.proxies().front()).Render(r), t.photo));
    }
    const FrameError e = Mean(errors);
    return {{"psnr_db", e.psnr_db}, {"ssim", e.ssim}};
  }

  // Samples against pixels: what they lose, and how much faster they are.
  Json SparseTable() const {
    Json table = Json::array();
    for (const MeasuredPoint& p : points_) {
      if (!p.pixel) continue;
      const auto dense = std::find_if(points_.begin(), points_.end(), [&](const MeasuredPoint& q) {
        return q.proxy == p.proxy && !q.settings.Sparse() && PerPixel(q.settings) == PerPixel(p.settings);
      });
      Json row = {{"name", p.name},
                  {"proxy", p.proxy},
                  {"samples_a_side", p.settings.grid_columns},
                  {"sampling", Name(p.settings.sampling)},
                  {"similarity", Name(p.settings.similarity)},
                  {"epipoles", p.settings.epipoles},
                  {"psnr_pixel_db", p.pixel->psnr_db},
                  {"psnr_pixel_worst_db", p.pixel_worst_db},
                  {"mse_pixel", p.pixel->mse},
                  {"false_color_mse_pixel", p.false_color_pixel},
                  {"ms", p.ms}};
      row["speed_up"] = dense != points_.end() && p.ms > 0 ? Json(dense->ms / p.ms) : Json(nullptr);
      table.push_back(row);
    }
    return table;
  }

  Json Summary() {
    const std::string& first = bench_.proxies().front();
    device_ = bench_.Measured(first).Device();
    Json points = Json::array();
    for (const MeasuredPoint& p : points_) points.push_back(PointJson(p, bench_));
    table_ = PointTable(points);
    Json j = {{"scene", o_.scene.generic_string()},
              {"backend", o_.backend},
              {"device", device_},
              {"width", width_},
              {"height", views_.front().camera.height_px},
              {"reference_width", optimum_ || !o_.quick ? reference_width_ : 0},
              {"holdout", o_.holdout},
              {"fold", "choose"},
              {"repeats", o_.repeats}};
    if (!optimum_) j["no_optimum"] = no_optimum_;
    for (const TestView& t : views_) j["views"].push_back(t.name);
    j["figure_view"] = o_.path.empty() ? Json(nullptr) : Json(o_.path.stem().string());
    j["points"] = points;
    const std::vector<CostAndQuality> axes = AxesOf("");
    j["front"] = Json::array();
    for (const std::size_t i : ParetoFront(axes)) j["front"].push_back(points[i]);

    j["sparse"] = SparseTable();
    report_views_ = HeldOutViews(bench_.scene(), o_.holdout, Fold::kReport, o_.views, width_);
    for (const TestView& t : report_views_) j["report_views"].push_back(t.name);
    j["report_nearest_photo"] = NearestPhotoReport();
    std::map<std::size_t, Json> reports;
    j["recommended"] = Json::array();
    const auto recommend = [&](std::optional<double> budget) {
      const Recommended best = RecommendedRow(axes, budget);
      if (!reports.contains(best.row)) reports[best.row] = Report(points_[best.row]);
      Json r = {{"budget_ms", budget ? Json(*budget) : Json(nullptr)}, {"fits", best.fits}};
      r.update(points[best.row]);
      r["report"] = reports[best.row];
      j["recommended"].push_back(r);
    };
    for (const double budget : kBudgetsMs) recommend(budget);
    recommend(std::nullopt);
    j["refused"] = Json::object();
    for (const auto& [what, why] : refusals_) j["refused"][what] = why;
    return j;
  }

  Plot Scatter(bool against_optimum) const {
    TradeoffPanel panel{
        against_optimum ? "Against the optimum at every pixel" : "Against held-out photos",
        fmt::format("{} wide, {} views, {}", against_optimum ? reference_width_ : width_, views_.size(), device_),
        "ms",
        {"milliseconds a frame", true},
        against_optimum ? "psnr_optimum_db" : "psnr_holdout_db",
        {"PSNR, dB"},
        {{"identity", "", "#1f6feb"},
         {"interpolated", "", "#d97706", Marker::kDiamond},
         {"candidates", "", "#15803d", Marker::kSquare},
         {"optimum on the grid", "", "#9333ea"},
         {"optimum", "", "#be123c"}},
        "method"};
    panel.front = table_.Front(panel.x, panel.y);
    panel.label_front_only = true;
    if (bench_.proxies().size() == 1) panel.label = "name";
    for (const double b : kBudgetsMs) panel.marks.push_back({b, fmt::format("{:g} ms", b)});
    return PlotOf(table_, panel);
  }

  // Error against samples a side, the thesis's Fig. 5-4: a, of the picture; b, of its false colours.
  std::vector<Plot> Figure54() const {
    TradeoffTable table{{{"name"}, {"line"}, {"samples"}, {"picture"}, {"false_color"}}};
    for (const MeasuredPoint& p : points_) {
      const Method method = MethodOf(p.settings);
      RadianceSettings alike = WithMethod(bench_.settings(), method, p.settings.grid_columns);
      if (method != Method::kCandidates) alike.epipoles = p.settings.epipoles;
      if (!p.pixel || p.proxy != bench_.proxies().front() || !(alike == p.settings)) continue;
      const bool without = method != Method::kCandidates && !alike.epipoles;
      table.Add({p.name, std::string(Name(method)) + (without ? " without epipoles" : ""), p.settings.grid_columns,
                 p.pixel->mse, p.false_color_pixel});
    }
    TradeoffPanel panel{
        "(a) The picture",
        fmt::format(
            "squared error against a weight a pixel, {} px wide, {}", reference_width_,
            o_.path.empty() ? fmt::format("mean of {} held-out views", views_.size()) : o_.path.stem().string()),
        "samples",
        {"samples a side", true},
        "picture",
        {"squared error a pixel (code values, summed over channels)", true},
        {{"interpolated", "interpolated, with epipoles", "#1f6feb", Marker::kCircle, true},
         {"interpolated without epipoles", "without epipoles", "#cf222e", Marker::kCross, true, "", true},
         {"candidates", "", "#15803d", Marker::kSquare, true},
         {"optimum on the grid", "", "#9333ea", Marker::kDiamond, true}},
        "line"};
    panel.label_front_only = true;  // there is none: a line's points need no labels
    panel.least = kLeastShown;
    const Plot picture = PlotOf(table, panel);
    panel.title = "(b) False colours", panel.y = "false_color";
    return {picture, PlotOf(table, panel)};
  }

  void Write(const Json& j) {
    std::vector<Plot> plots = {Scatter(false)};
    if (optimum_) plots.push_back(Scatter(true));
    if (!o_.output.empty()) {
      WriteTradeoff(o_.output / "tradeoff", table_, plots, j.dump(1) + "\n");
      WriteTextAtomically(o_.output / "figure-5-4.svg", SvgOf(Figure54()));
    }
    if (!bench_.MayWriteScene()) {
      sink_.Message("the front is not kept: " + bench_.scene().folder.string() +
                    " is another tool's workspace and is not written to");
      return;
    }
    const FolderLock lock(bench_.scene().folder);
    for (const std::string& given : bench_.proxies()) {
      const std::string proxy = given.empty() ? bench_.scene().active_proxy : given;
      StoredFront front;
      front.key = {proxy, o_.backend, device_, width_, views_.front().camera.height_px};
      front.proxy_fingerprint = Fingerprint(ProxyPath(bench_.scene().folder, proxy));
      for (const std::size_t i : ParetoFront(AxesOf(given))) front.points.push_back(points_[i].ForFront());
      if (!front.points.empty()) WriteFront(bench_.scene().folder, front);
    }
  }

  const MeasureOptions& o_;
  ProgressSink& sink_;
  Workbench bench_;
  int width_ = 0, reference_width_ = 0;
  std::size_t first_figure_view_ = 0, last_figure_view_ = 0;
  bool optimum_ = false;
  std::string no_optimum_, device_;
  std::vector<TestView> views_, report_views_;
  std::map<std::string, std::vector<Pair>> references_;
  std::vector<MeasuredPoint> points_;
  std::map<std::string, std::string> refusals_;
  TradeoffTable table_;
};

}  // namespace

std::string RunTradeoff(const MeasureOptions& options, ProgressSink& progress) {
  RequireConsistent(options);
  if (options.output.empty()) throw UsageError("-o says where the tables go");
  return Tradeoff(options, progress).Run();
}

std::string DescribeTradeoff(const std::string& json) {
  const Json j = Json::parse(json);
  using enum TradeoffRole;
  using Fields = std::vector<TradeoffField<Json>>;
  const auto table = [&](const char* key, const Fields& fields) {
    return TextOf(TradeoffTableOf<Json>(fields, j[key].get<std::vector<Json>>())) + "\n";
  };
  std::string text = TextOf(PointTable(j["points"])) + "\n";
  if (!j["sparse"].empty())
    text += "\n" + table("sparse", {SettingField("samples against pixels", 52),
                                    FromJson<Json>({"speed_up", kFigure, "speed-up", 9, "{:.1f}"}),
                                    FromJson<Json>({"psnr_pixel_db", kFigure, "PSNR dB", 13, "{:.2f}"}),
                                    FromJson<Json>({"psnr_pixel_worst_db", kFigure, "worst view dB", 13, "{:.2f}"}),
                                    FromJson<Json>({"false_color_mse_pixel", kFigure, "false colour", 12, "{:.4g}"})});
  const Fields recommended = {
      {{"", kSetting, "budget", -12},
       [](const Json& r) {
         return r["budget_ms"].is_null() ? "no limit" : fmt::format("{:g} ms", r["budget_ms"].get<double>());
       }},
      SettingField("recommended", 44),
      FromJson<Json>({"ms", kFigure, "ms", 9, "{:.2f}"}),
      FromJson<Json>({"psnr_holdout_db", kFigure, "chosen on dB", 13, "{:.2f}"}),
      FromJson<Json>({"report.psnr_db", kFigure, "reported dB", 12, "{:.2f}"}),
      {{"", kRemark}, [](const Json& r) { return r["fits"].get<bool>() ? "" : "(does not fit: the fastest)"; }}};
  text += "\n" + table("recommended", recommended);
  const Json& nearest = j["report_nearest_photo"]["psnr_db"];
  text += fmt::format("nearest photo alone: {} dB. {} px wide, {}",
                      nearest.is_number() ? fmt::format("{:.2f}", nearest.get<double>()) : "-", j["width"].get<int>(),
                      j["device"].get<std::string>());
  return text;
}

}  // namespace lumi
