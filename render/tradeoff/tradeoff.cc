#include "render/tradeoff/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "render/holdout/holdout.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/front.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/tradeoff/table.h"

namespace lumi {
namespace {

constexpr const char* kTradeoffMarker = "tradeoff.json";
constexpr double kBudgetsMs[] = {8, 16, 33, 100};
constexpr int kReferenceWidth = 480, kProbeWidth = 64, kLeastReferenceWidth = 160;
constexpr double kLeastShown =
    1e-3;  // least squared error on the logarithmic axis of Fig. 5-4: smaller ones are invisible
constexpr double kReferenceMs = 30000;  // what the reference pictures may take together

struct Pair {
  ImageF color, false_color;
};

FrameError ErrorBetween(const Pair& picture, const Pair& reference) {
  FrameError e = ErrorBetween(picture.color, reference.color);
  e.false_color_mse = SquaredError(picture.false_color, reference.false_color);
  return e;
}

struct MeasuredPoint {
  std::string name, proxy;
  RadianceSettings settings;
  JsonKeys keys;               // of these
  double ms = 0, plan_ms = 0;  // medians
  std::vector<double> times = {}, plan_times = {};
  FrameError holdout = {};
  std::optional<FrameError> optimum = {},
                            pixel = {};  // against the optimum; against the same weights at every pixel (sparse points)
  double pixel_worst_db = 0;             // of the views

  std::optional<double> OptimumDb() const { return optimum ? std::optional(optimum->psnr_db) : std::nullopt; }
  std::string Title() const { return fmt::format("{} ({})", name, proxy); }  // "candidates 25x25, k 4 (mesh)"
};

void ListKeys(JsonKeys& j, MeasuredPoint& p) {
  j("name", p.name).Say("method", Name(MethodOf(p.settings)))("proxy", p.proxy, "settings", p.keys);
  j("ms", p.ms, "plan_ms", p.plan_ms).Say("psnr_optimum_db", p.OptimumDb());
  j("psnr_holdout_db", p.holdout.psnr_db, "ssim_holdout", p.holdout.ssim, "mse_holdout", p.holdout.mse);
  j("coverage", p.holdout.coverage).Say("frames_timed", p.times.size());
  j.IfAny("against_optimum", p.optimum).IfAny("against_pixel", p.pixel);
}

// Sparse samples compared with weights at every pixel: what they lose, and how much faster they are.
struct SparseRow : MeasuredPoint {
  std::optional<double> speed_up;
};

void ListKeys(JsonKeys& j, SparseRow& r) {
  j("name", r.name, "proxy", r.proxy, "samples_a_side", r.settings.grid_columns);
  j.Say("sampling", Name(r.settings.sampling)).Say("similarity", Name(r.settings.similarity));
  j("epipoles", r.settings.epipoles, "psnr_pixel_db", r.pixel->psnr_db, "psnr_pixel_worst_db", r.pixel_worst_db);
  j("mse_pixel", r.pixel->mse, "false_color_mse_pixel", r.pixel->false_color_mse, "ms", r.ms, "speed_up", r.speed_up);
}

struct RecommendedPoint : MeasuredPoint {
  std::optional<double> budget_ms;
  bool fits = false;
  FrameError report;  // on photos that nothing was chosen on
};

void ListKeys(JsonKeys& j, RecommendedPoint& r) {
  j("budget_ms", r.budget_ms, "fits", r.fits);
  ListKeys(j, static_cast<MeasuredPoint&>(r));
  j.Say("report",
        JsonKeys().Say("psnr_db", r.report.psnr_db).Say("ssim", r.report.ssim).Say("coverage", r.report.coverage));
}

TradeoffTable PointTable(const std::vector<MeasuredPoint>& points) {
  using enum TradeoffRole;
  using Field = TradeoffField<MeasuredPoint>;
  const auto held_out = [](double FrameError::*figure) {
    return [=](const MeasuredPoint& p) { return p.holdout.*figure; };
  };
  std::vector<Field> fields = {
      {{"", kSetting, "setting (proxy)", -52}, &MeasuredPoint::Title},
      {{"name", kSetting}, &MeasuredPoint::name},
      {{"method", kSetting}, [](const MeasuredPoint& p) { return Name(MethodOf(p.settings)); }},
      {{"proxy", kSetting}, &MeasuredPoint::proxy}};
  for (const char* name : {"k", "grid", "epipoles", "resolution"})
    fields.push_back(
        {{name, kSetting}, [o = FindSettingOption(name)](const MeasuredPoint& p) { return Text(o->get(p.settings)); }});
  for (Field& field : std::vector<Field>{
           {{"ms", kCost, "ms", 9, "{:.2f}"}, &MeasuredPoint::ms},
           {{"plan_ms", kCost}, &MeasuredPoint::plan_ms},
           {{"psnr_optimum_db", kMoreIsBetter, "optimum dB", 13, "{:.2f}"}, &MeasuredPoint::OptimumDb},
           {{"psnr_holdout_db", kMoreIsBetter, "held-out dB", 13, "{:.2f}"}, held_out(&FrameError::psnr_db)},
           {{"ssim_holdout"}, held_out(&FrameError::ssim)},
           {{"mse_holdout"}, held_out(&FrameError::mse)},
           {{"coverage"}, held_out(&FrameError::coverage)}})
    fields.push_back(std::move(field));
  for (const auto& [reference, errors] :
       {std::pair{"optimum", &MeasuredPoint::optimum}, {"pixel", &MeasuredPoint::pixel}})
    for (const auto& [figure, of] : {std::pair{"psnr", &FrameError::psnr_db},
                                     {"ssim", &FrameError::ssim},
                                     {"mse", &FrameError::mse},
                                     {"false_color_mse", &FrameError::false_color_mse}}) {
      const std::string name = fmt::format("{}_{}{}", figure, reference, of == &FrameError::psnr_db ? "_db" : "");
      if (name != "psnr_optimum_db")  // is there
        fields.push_back({{name}, [of_point = errors, of_frame = of](const MeasuredPoint& p) {
                            return p.*of_point ? TradeoffValue((p.*of_point).value().*of_frame) : TradeoffValue();
                          }});
    }
  return TradeoffTableOf(fields, points);
}

class Tradeoff {
 public:
  Tradeoff(const MeasureOptions& o, ProgressSink& sink) : o_(o), sink_(sink), bench_(o, kTradeoffMarker, sink) {
    width_ = bench_.Width();
    views_ = HeldOutViews(bench_.scene(), o_.holdout, Fold::kChoose, o_.views, width_);
    // Fig. 5-4 is of one virtual view where one is given.
    first_figure_view_ = o_.path.empty() ? 0 : views_.size();
    last_figure_view_ = o_.path.empty() ? views_.size() : views_.size() + 1;
    if (!o_.path.empty()) FirstOfPath(bench_.scene(), o_.path, 16);  // an invalid path fails now, not after the sweep
  }

  Answer Run() {
    DecideReference();
    std::vector<std::pair<std::string, SweepPoint>> table;
    for (std::size_t i = 0; i < bench_.proxies().size(); ++i)
      for (SweepPoint& p : SweepTable(bench_.settings(), i > 0      ? SweepSize::kMethods
                                                         : o_.quick ? SweepSize::kQuick
                                                                    : SweepSize::kFull))
        table.emplace_back(bench_.proxies()[i], std::move(p));
    {
      // Repeats are measured in rounds over all settings of a proxy: other load on the machine then slows all of them,
      // not only one.
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
    Report();
    const JsonKeys keys = Keys();
    Write(keys);
    return {keys, Text()};
  }

 private:
  const View& ViewOf(const TestView& t) const { return bench_.scene().views[static_cast<std::size_t>(t.id.value)]; }

  RenderRequest Request(const TestView& t, const RadianceSettings& settings, bool reference) const {
    RenderRequest r = bench_.Request(t, settings);
    if (reference) r.view = HeldOutView(bench_.scene(), ViewOf(t), std::min(reference_width_, width_));
    return r;
  }

  // Decides, by the time of a small picture, whether the optimum can be rendered and how large its reference pictures
  // may be.
  void DecideReference() {
    const std::string& proxy = bench_.proxies().front();
    reference_width_ = std::min(width_, o_.reference_width_px > 0 ? o_.reference_width_px
                                        : o_.quick                ? kReferenceWidth / 2
                                                                  : kReferenceWidth);
    RenderRequest request = Request(views_.front(), ReferenceSettings(bench_.settings()), false);
    const int small = std::min(kProbeWidth, width_);
    request.view = HeldOutView(bench_.scene(), ViewOf(views_.front()), small);
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
    auto& kept = references_[JsonKeys(settings).Text()];
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
    MeasuredPoint m{point.name, proxy, point.settings, bench_.Keys(point.settings)};
    try {
      Renderer& renderer = bench_.Measured(proxy);
      std::vector<FrameError> holdout, optimum, pixel;
      for (std::size_t v = 0; v < views_.size(); ++v) {
        TimedFrame frame = TimeFrame(renderer, Request(views_[v], m.settings, false), 1);
        m.times.insert(m.times.end(), frame.all_ms.begin(), frame.all_ms.end());
        m.plan_times.push_back(renderer.Statistics().plan_ms);
        holdout.push_back(ErrorAgainstPhoto(frame.image, views_[v].photo));
        if (optimum_)
          optimum.push_back(ErrorBetween(RenderPair(renderer, v, m.settings),
                                         Reference(proxy, ReferenceSettings(bench_.settings()), v)));
      }
      const bool per_pixel_is_there = m.settings.similarity == Similarity::kIdentity || optimum_;
      if (m.settings.Sparse() && per_pixel_is_there)
        for (std::size_t v = first_figure_view_; v < last_figure_view_; ++v)
          pixel.push_back(ErrorBetween(RenderPair(renderer, v, m.settings), Reference(proxy, PerPixel(m.settings), v)));
      m.holdout = Mean(holdout);
      if (!optimum.empty()) m.optimum = Mean(optimum);
      if (!pixel.empty()) {
        m.pixel = Mean(pixel);
        m.pixel_worst_db = std::ranges::min(pixel, {}, &FrameError::psnr_db).psnr_db;
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

  // Times the frames of another round, unless they take seconds: repeating those would not reduce noise.
  void Again(MeasuredPoint& m) {
    if (Median(m.times) > kSlowMs) return;
    Renderer& renderer = bench_.Measured(m.proxy);
    for (const TestView& t : views_) {
      const TimedFrame frame = TimeFrame(renderer, Request(t, m.settings, false), 0);
      m.times.push_back(frame.first_ms);
      m.plan_times.push_back(renderer.Statistics().plan_ms);
    }
  }

  // Cost and quality of all points; empty for points of another proxy (`proxy` empty: any) and for points that no front
  // may contain.
  std::vector<CostAndQuality> AxesOf(const std::string& proxy) const {
    std::vector<CostAndQuality> axes;
    for (const MeasuredPoint& p : points_) {
      // An effect's cost is shown, but effects are switched by evidence, not by a budget.
      const bool traded = WithTradedSettings(bench_.settings(), p.settings) == p.settings;
      axes.push_back(traded && (proxy.empty() || p.proxy == proxy) ? CostAndQuality{p.ms, p.holdout.psnr_db}
                                                                   : CostAndQuality());
    }
    return axes;
  }

  // The error of a setting on the reporting fold, on which nothing was chosen.
  FrameError Report(const MeasuredPoint& p) {
    std::vector<FrameError> errors;
    for (const TestView& t : report_views_)
      errors.push_back(ErrorAgainstPhoto(bench_.Measured(p.proxy).Render(Request(t, p.settings, false)), t.photo));
    return Mean(errors);
  }

  FrameError NearestPhotoReport() {
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
    return Mean(errors);
  }

  // Computes everything that follows from the points.
  void Report() {
    device_ = bench_.Measured(bench_.proxies().front()).Device();
    table_ = PointTable(points_);
    for (const MeasuredPoint& p : points_) {
      if (!p.pixel) continue;
      SparseRow& row = sparse_.emplace_back(p);
      const auto dense = std::find_if(points_.begin(), points_.end(), [&](const MeasuredPoint& q) {
        return q.proxy == p.proxy && !q.settings.Sparse() && PerPixel(q.settings) == PerPixel(p.settings);
      });
      if (dense != points_.end() && p.ms > 0) row.speed_up = dense->ms / p.ms;
    }
    report_views_ = HeldOutViews(bench_.scene(), o_.holdout, Fold::kReport, o_.views, width_);
    nearest_ = NearestPhotoReport();
    std::map<std::size_t, FrameError> reports;
    std::vector<std::optional<double>> budgets(std::begin(kBudgetsMs), std::end(kBudgetsMs));
    budgets.push_back(std::nullopt);
    for (const std::optional<double> budget : budgets) {
      const Recommended best = RecommendedRow(AxesOf(""), budget);
      if (!reports.contains(best.row)) reports[best.row] = Report(points_[best.row]);
      recommended_.push_back({points_[best.row], budget, best.fits, reports[best.row]});
    }
  }

  JsonKeys Keys() const {
    const auto names = [](const std::vector<TestView>& views) {
      std::vector<std::string> all;
      for (const TestView& t : views) all.push_back(t.name);
      return all;
    };
    std::vector<MeasuredPoint> front;
    for (const std::size_t i : ParetoFront(AxesOf(""))) front.push_back(points_[i]);
    JsonKeys j;
    j.Say("scene", o_.scene.generic_string()).Say("backend", o_.backend).Say("device", device_).Say("width", width_);
    j.Say("height", views_.front().view.size_px.y());
    j.Say("reference_width", optimum_ || !o_.quick ? reference_width_ : 0).Say("holdout", o_.holdout);
    j.Say("fold", "choose").Say("repeats", o_.repeats).Say("proxy_evaluated", bench_.proxies_evaluated());
    if (!optimum_) j.Say("no_optimum", no_optimum_);
    j.Say("views", names(views_));
    j.Say("figure_view", o_.path.empty() ? std::nullopt : std::optional(o_.path.stem().string()));
    j.Say("points", points_).Say("front", front).Say("sparse", sparse_).Say("report_views", names(report_views_));
    j.Say("report_nearest_photo", JsonKeys().Say("psnr_db", nearest_.psnr_db).Say("ssim", nearest_.ssim));
    return j.Say("recommended", recommended_).Say("refused", refusals_);
  }

  // For people.
  std::string Text() const {
    using enum TradeoffRole;
    std::string text = TextOf(table_) + "\n";
    if (!sparse_.empty())
      text += "\n" +
              TextOf(TradeoffTableOf<SparseRow>(
                  {{{"", kSetting, "samples against pixels", -52}, &SparseRow::Title},
                   {{"", kFigure, "speed-up", 9, "{:.1f}"}, &SparseRow::speed_up},
                   {{"", kFigure, "PSNR dB", 13, "{:.2f}"}, [](const SparseRow& r) { return r.pixel->psnr_db; }},
                   {{"", kFigure, "worst view dB", 13, "{:.2f}"}, &SparseRow::pixel_worst_db},
                   {{"", kFigure, "false colour", 12, "{:.4g}"},
                    [](const SparseRow& r) { return r.pixel->false_color_mse; }}},
                  sparse_)) +
              "\n";
    using Best = RecommendedPoint;
    text += "\n" +
            TextOf(TradeoffTableOf<Best>(
                {{{"", kSetting, "budget", -12},
                  [](const Best& r) { return r.budget_ms ? fmt::format("{:g} ms", *r.budget_ms) : "no limit"; }},
                 {{"", kSetting, "recommended", -44}, &Best::Title},
                 {{"", kFigure, "ms", 9, "{:.2f}"}, &Best::ms},
                 {{"", kFigure, "chosen on dB", 13, "{:.2f}"}, [](const Best& r) { return r.holdout.psnr_db; }},
                 {{"", kFigure, "reported dB", 12, "{:.2f}"}, [](const Best& r) { return r.report.psnr_db; }},
                 {{"", kRemark}, [](const Best& r) { return r.fits ? "" : "(does not fit: the fastest)"; }}},
                recommended_)) +
            "\n";
    return text + fmt::format("nearest photo alone: {:.2f} dB. {} px wide, {}", nearest_.psnr_db, width_, device_);
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
                 p.pixel->mse, p.pixel->false_color_mse});
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
    panel.label_front_only = true;  // there is no front, so the lines' points need no labels
    panel.least = kLeastShown;
    const Plot picture = PlotOf(table, panel);
    panel.title = "(b) False colours", panel.y = "false_color";
    return {picture, PlotOf(table, panel)};
  }

  void Write(const JsonKeys& keys) {
    std::vector<Plot> plots = {Scatter(false)};
    if (optimum_) plots.push_back(Scatter(true));
    if (!o_.output.empty()) {
      WriteTradeoff(o_.output / "tradeoff", table_, plots, keys.Text(1) + "\n");
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
      front.key = {proxy, o_.backend, device_, width_, views_.front().view.size_px.y()};
      front.proxy_fingerprint = Fingerprint(ProxyPath(bench_.scene().folder, proxy));
      for (const std::size_t i : ParetoFront(AxesOf(given))) {
        const MeasuredPoint& p = points_[i];
        front.points.push_back({p.name, p.settings, p.ms, p.OptimumDb(), p.holdout.psnr_db});
      }
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
  std::vector<SparseRow> sparse_;
  std::vector<RecommendedPoint> recommended_;
  FrameError nearest_;
  std::map<std::string, std::string> refusals_;
  TradeoffTable table_;
};

}  // namespace

Answer RunTradeoff(const MeasureOptions& options, ProgressSink& progress) {
  RequireConsistent(options);
  if (options.output.empty()) throw UsageError("-o says where the tables go");
  return Tradeoff(options, progress).Run();
}

}  // namespace lumi
