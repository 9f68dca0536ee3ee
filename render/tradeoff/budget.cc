#include "render/tradeoff/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/settings_json.h"
#include "render/tradeoff/sweep.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr double kLoadShare = 0.25;  // of a new frame in the smoothed load
constexpr double kHopeless = 2;      // a frame that takes this times the budget is not repeated ...
constexpr int kHopelessRows = 2;     // ... and a probe ends after so many such settings in a row
constexpr double kFarTooSlow = 2;
constexpr double kSameSize = 0.02;  // sizes whose pixels differ by less share a front's times

RadianceSettings WithFixed(RadianceSettings s, const FixedOptions& fixed) {
  for (const auto& [name, value] : fixed) SetOption(s, name, value);
  return s;
}

}  // namespace

FixedOptions Fixed(const RadianceSettings& settings, const Decided& decided) {
  FixedOptions fixed;
  for (const auto& [name, text] : JsonKeys(settings).Words())
    if (decided.Has(name)) fixed.emplace_back(name, text);
  return fixed;
}

struct TriedPoint {
  std::string name;
  double ms = 0;
};
void ListKeys(JsonKeys& j, TriedPoint& p) { j("name", p.name, "ms", p.ms); }

void ListKeys(JsonKeys& j, BudgetChoice& c) {
  std::vector<TriedPoint> tried;
  for (const FrontPoint& p : c.tried) tried.push_back({p.name, p.ms});
  j("budget_ms", c.budget_ms, "name", c.name, "expected_ms", c.ms, "fits", c.fits, "why", c.why, "tried", tried);
}

std::vector<FrontPoint> ProbeTable(const RadianceSettings& base, const FixedOptions& fixed) {
  struct Row {
    Method method;
    int grid, k;
  };
  constexpr Row kRows[] = {
      {Method::kInterpolated, 8, 2}, {Method::kInterpolated, 16, 3}, {Method::kInterpolated, 32, 4},
      {Method::kCandidates, 16, 3},  {Method::kCandidates, 25, 4},   {Method::kCandidates, 32, 4},
      {Method::kPixel, 0, 4},        {Method::kOptimumGrid, 64, 4},  {Method::kOptimumPixel, 0, 4}};
  std::vector<FrontPoint> table;
  for (const Row& row : kRows) {
    FrontPoint p;
    p.settings = WithMethod(base, row.method, row.grid);
    p.settings.k = row.k;
    p.settings = WithFixed(p.settings, fixed);
    const auto same = [&](const FrontPoint& q) { return q.settings == p.settings; };
    const bool idle = p.settings.Sparse() && !HasSamples(p.settings);
    if (idle || !Validate(p.settings).empty() || std::any_of(table.begin(), table.end(), same)) continue;
    p.name = PointName(p.settings, base);
    table.push_back(std::move(p));
  }
  return table;
}

// A probe uses this share of the budget, because other frames of a path may be slower than the first view's.
constexpr double kHeadroom = 0.9;

BudgetChoice Probe(Renderer& renderer, RenderRequest request, const RadianceSettings& base, const FixedOptions& fixed,
                   double budget_ms, double seconds) {
  const Stopwatch clock;
  BudgetChoice choice;
  choice.budget_ms = budget_ms;
  FrontPoint& chosen = choice;
  std::string last_failure;
  int hopeless = 0;
  for (FrontPoint& p : ProbeTable(base, fixed)) {
    request.settings = p.settings;
    try {
      // The first frame includes one-time work (visibility maps, textures): later, faster ones replace its time.
      for (int i = 0; i < 3; ++i) {
        const Stopwatch watch;
        renderer.Render(request);
        const double ms = 1000 * watch.Seconds();
        p.ms = i == 0 ? ms : std::min(p.ms, ms);
        if (clock.Seconds() > seconds && (i > 0 || !choice.tried.empty())) break;
        if (i > 0 && ms > kHopeless * budget_ms) break;
      }
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      last_failure = e.what();
      continue;
    }
    choice.tried.push_back(p);
    if (p.ms <= kHeadroom * budget_ms) {
      choice.fits = true;
      chosen = p;
    }
    hopeless = p.ms > kHopeless * budget_ms ? hopeless + 1 : 0;
    if (hopeless >= kHopelessRows || clock.Seconds() > seconds) break;
  }
  if (choice.tried.empty()) throw DataError("no setting could be rendered: " + last_failure);
  choice.why = fmt::format("a probe of {} settings at the first view, {:.1f} s", choice.tried.size(), clock.Seconds());
  std::ranges::stable_sort(choice.tried, {}, &FrontPoint::ms);
  if (!choice.fits) chosen = choice.tried.front();
  return choice;
}

namespace {

// The time of the faster of two frames, because the first includes one-time work.
double MeasuredMs(Renderer& renderer, RenderRequest request, const RadianceSettings& settings) {
  request.settings = settings;
  double ms = 0;
  for (int i = 0; i < 2; ++i) {
    const Stopwatch watch;
    renderer.Render(request);
    const double took = 1000 * watch.Seconds();
    ms = i == 0 ? took : std::min(ms, took);
  }
  return ms;
}

// For a front measured at another size: only a part of the times is proportional to the pixels (samples cost the same
// at any size). So the recommended point is rendered at this size, the other times are scaled by its measured time, and
// the choice is made again.
std::size_t RecommendHere(std::vector<FrontPoint>& points, double budget_ms, Renderer& renderer,
                          const RenderRequest& request, BudgetChoice& choice) {
  constexpr int kMostRendered = 4;
  std::vector<bool> measured(points.size(), false);
  std::size_t best = Recommend(points, budget_ms, &choice.fits);
  int rendered = 0;
  for (; rendered < kMostRendered && !measured[best]; ++rendered) {
    const double expected = points[best].ms;
    points[best].ms = MeasuredMs(renderer, request, points[best].settings);
    measured[best] = true;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (!measured[i]) points[i].ms *= points[best].ms / expected;
    best = Recommend(points, budget_ms, &choice.fits);
  }
  choice.why += fmt::format(", times by {} of its settings rendered at this size", rendered);
  return best;
}

}  // namespace

BudgetChoice ChooseForBudget(const std::filesystem::path& scene_folder, const std::string& backend,
                             const std::string& proxy, Renderer& renderer, const RenderRequest& request,
                             const FixedOptions& fixed, double budget_ms) {
  if (!(budget_ms > 0) || !std::isfinite(budget_ms)) throw UsageError("--budget-ms must be above 0");
  const Eigen::Vector2i size = request.view.size_px;
  std::string why;
  if (const auto stored = FindFront(scene_folder, {proxy, backend, renderer.Device(), size.x(), size.y()}, &why)) {
    std::vector<FrontPoint> points;
    for (FrontPoint p : stored->points) {
      p.settings = WithTradedSettings(request.settings, p.settings);
      if (WithFixed(p.settings, fixed) == p.settings && Validate(p.settings).empty()) points.push_back(std::move(p));
    }
    if (!points.empty()) {
      BudgetChoice choice;
      choice.budget_ms = budget_ms;
      choice.why = fmt::format("the scene's front, measured at {}x{}", stored->key.width, stored->key.height);
      const bool same_size = std::abs(stored->time_scale - 1) < kSameSize;
      static_cast<FrontPoint&>(choice) =
          points[same_size ? Recommend(points, budget_ms, &choice.fits)
                           : RecommendHere(points, budget_ms, renderer, request, choice)];
      choice.tried = std::move(points);
      return choice;
    }
    why = "no point of the scene's front has the options given";
  }
  BudgetChoice choice = Probe(renderer, request, request.settings, fixed, budget_ms);
  choice.why += "; " + why;
  return choice;
}

BudgetController::BudgetController(std::vector<FrontPoint> front, std::optional<FrontPoint> refined, Options options)
    : front_(std::move(front)), options_(options), wait_(options.fast_frames) {
  if (front_.empty()) throw std::invalid_argument("BudgetController: the front is empty");
  refined_ = refined ? std::move(*refined) : front_.back();
  SetBudget(options.budget_ms);
}

void BudgetController::SetBudget(double budget_ms) {
  if (!(budget_ms > 0) || !std::isfinite(budget_ms))
    throw std::invalid_argument("BudgetController: the budget must be above 0");
  options_.budget_ms = budget_ms;
  level_ = 0;
  while (level_ + 1 < front_.size() && Expected(level_ + 1) <= budget_ms) ++level_;
  slow_ = fast_ = 0;
  wait_ = options_.fast_frames;
}

const FrontPoint& BudgetController::Next(double now_s, bool camera_moved) {
  if (camera_moved || !started_) last_move_s_ = now_s;
  started_ = true;
  refining_ = now_s - last_move_s_ >= options_.rest_s;
  return refining_ ? refined_ : front_[level_];
}

void BudgetController::Measured(double ms) {
  if (refining_ || !(ms > 0) || !std::isfinite(ms)) return;
  const double budget = options_.budget_ms;
  load_ *= std::pow(ms / Expected(level_), kLoadShare);
  ++since_up_;
  slow_ = ms > options_.too_slow * budget ? slow_ + 1 : 0;
  if (level_ > 0 && (slow_ >= options_.slow_frames || ms > kFarTooSlow * budget)) {
    // After a step up that had to be taken back soon, the next attempt waits longer, to avoid flicker.
    wait_ = since_up_ < 2 * wait_ ? std::min(2 * wait_, options_.longest_wait) : options_.fast_frames;
    --level_;
    slow_ = fast_ = 0;
    since_up_ = options_.longest_wait * 2;
    return;
  }
  const bool room = level_ + 1 < front_.size() && ms <= budget && Expected(level_ + 1) < options_.room * budget;
  fast_ = room ? fast_ + 1 : 0;
  if (fast_ >= wait_) {
    ++level_;
    fast_ = slow_ = 0;
    since_up_ = 0;
  }
}

}  // namespace lumi
