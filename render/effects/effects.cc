#include "render/effects/effects.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>

#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/footprint.h"
#include "render/radiance/measures/resolution.h"
#include "render/world/visibility_maps.h"
#include "render/time/clock.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// What is looked at: rays of a few of the views. Enough that an effect at one ray in a thousand shows.
constexpr std::size_t kViews = 8;
constexpr int kColumns = 24, kRows = 18;
// When an effect is called for.
constexpr double kShareThatCounts = 0.002;       // of the rays: fewer cannot be seen
// Of the largest penalty, between photos that would be blended, at half of the rays: a stretch by 1.73 beside none. Where it is so at
// fewer, preferring the sharper photo over the nearer one in angle changed the error of left-out photos by -0.2 to +0.07 dB.
constexpr double kPenaltyThatCounts = 0.5;
constexpr double kMeasuresAgree = 0.25;          // octaves between the two resolution measures
constexpr double kLevelThatCounts = 0.1;         // of a pyramid: less is no trace
constexpr float kWhole = 0.99F;                          // of a field-of-view value: the rest is rounding
constexpr int kProbeWidth = 256;

struct Evidence {
  long rays = 0, ends = 0, blocked = 0, photos = 0, oversampled = 0;
  std::vector<double> penalty;          // largest less smallest 1 - r among the photos of a ray
  std::vector<double> disagreement;     // octaves, of a photo's relative sigma by the two measures
};

double Percentile(std::vector<double> v, double fraction) {
  if (v.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(std::min(static_cast<double>(v.size() - 1), fraction * static_cast<double>(v.size())));
  std::nth_element(v.begin(), v.begin() + at, v.end());
  return v[static_cast<std::size_t>(at)];
}

// Pixels a step along the plane's tangents at p, relative to a camera at the origin of M.
Eigen::Matrix2d PixelsAStep(const Eigen::Matrix3d& M, const Eigen::Vector3d& p, const Eigen::Vector3d& e1, const Eigen::Vector3d& e2) {
  const Eigen::Vector3d q = M * p;
  Eigen::Matrix2d J;
  for (int row = 0; row < 2; ++row) {
    const Eigen::RowVector3d g = (M.row(row) - q[row] / q.z() * M.row(2)) / q.z();
    J(row, 0) = g.dot(e1);
    J(row, 1) = g.dot(e2);
  }
  return J;
}

Eigen::Matrix3d DepthScaled(const RenderView& view) {
  const Eigen::Matrix3d M = view.P.leftCols<3>();
  return M / M.row(2).norm();
}

void LookAtRay(const Sources& sources, const ViewSetup& setup, const VisibilityMaps& maps, const Eigen::Vector3f& d, float t,
               const Eigen::Vector3f& normal, WeighScratch& scratch, Evidence& e) {
  EvaluateMeasures(setup.sources, setup.settings, d, t, normal, scratch.measures);
  Measures& m = scratch.measures;
  ++e.rays;
  // The photos that would be blended if the angle alone counted.
  std::vector<int> order;
  for (int j = 0; j < setup.sources.count; ++j)
    if (setup.sources.enabled[static_cast<std::size_t>(j)] > 0) order.push_back(j);
  const std::size_t k = std::min(order.size(), static_cast<std::size_t>(setup.settings.k == 0 ? kMaxBlend : setup.settings.k + 1));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(k), order.end(),
                    [&](int a, int b) { return m.theta[static_cast<std::size_t>(a)] < m.theta[static_cast<std::size_t>(b)]; });
  order.resize(k);
  if (std::any_of(order.begin(), order.end(), [&](int j) { return m.f[static_cast<std::size_t>(j)] < kWhole; })) ++e.ends;

  EvaluateVisibility(setup.sources, &maps, d, t, m);
  const Eigen::Vector3d p = (t * d).cast<double>(), n = normal.norm() > 0 ? normal.cast<double>() : p.normalized();
  const Eigen::Vector3d e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  const Eigen::Matrix3d desired = setup.desired.P.leftCols<3>();
  const Eigen::Matrix2d view_step = PixelsAStep(desired, p, e1, e2);
  const double view_depth = desired.row(2).dot(p);
  bool blocked = false;
  const float low = InverseLog(setup.settings.resolution_low), high = InverseLog(setup.settings.resolution_high);
  double smallest = std::numeric_limits<double>::infinity(), largest = 0;
  std::vector<double> by_jacobian, by_distance;
  for (const int camera : order) {
    const auto j = static_cast<std::size_t>(camera);
    if (!(m.f[j] > 0)) continue;
    blocked = blocked || m.v[j] < kHalfVisible;
    ++e.photos;
    const Eigen::Matrix3d M = DepthScaled(sources.views[j]);
    const Eigen::Vector3d q = p - (sources.views[j].centre - setup.desired.centre);
    const double depth = M.row(2).dot(q);
    if (!(depth > 0)) continue;
    const double focal = std::sqrt(std::abs(M.determinant()));
    const double footprint = Footprint(focal / static_cast<double>(setup.focal_px), FacingRatio(n.dot(q), n.dot(p)), view_depth / depth);
    if (PyramidLevel(footprint) > kLevelThatCounts) ++e.oversampled;
    const Eigen::Matrix2d step = PixelsAStep(M, q, e1, e2);
    if (std::abs(step.determinant()) < 1e-12 * step.squaredNorm()) continue;
    const Eigen::Matrix2d J = view_step * step.inverse();
    const double sigma = 0.5 * (std::hypot(J(0, 0) + J(1, 1), J(0, 1) - J(1, 0)) + std::hypot(J(0, 0) - J(1, 1), J(0, 1) + J(1, 0)));
    const double penalty = 1 - static_cast<double>(ResolutionValue(static_cast<float>(sigma), low, high));
    smallest = std::min(smallest, penalty);
    largest = std::max(largest, penalty);
    by_jacobian.push_back(std::log2(sigma));
    by_distance.push_back(std::log2(q.norm() * setup.focal_px / (static_cast<double>(t) * focal)));
  }
  if (blocked) ++e.blocked;
  if (by_jacobian.size() < 2) return;
  e.penalty.push_back(largest - smallest);
  double offset = 0;
  for (std::size_t i = 0; i < by_jacobian.size(); ++i) offset += (by_jacobian[i] - by_distance[i]) / static_cast<double>(by_jacobian.size());
  for (std::size_t i = 0; i < by_jacobian.size(); ++i) e.disagreement.push_back(std::abs(by_jacobian[i] - by_distance[i] - offset));
}

void LookAtView(const Sources& sources, const ProxyTracer& tracer, const VisibilityMaps& maps, const RenderView& desired, const std::vector<bool>& use,
                RadianceSettings settings, Evidence& e) {
  settings.field_of_view = true;
  settings.resolution = Resolution::kOff;
  settings.time = false;
  WeighScratch scratch;
  const ViewSetup setup = MakeViewSetup(sources, desired, settings, use);
  std::vector<Eigen::Vector3f> directions, normals(kColumns * kRows);
  std::vector<float> t(kColumns * kRows);
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x)
      directions.push_back(
          (setup.ray_from_pixel * Eigen::Vector3d((x + 0.5) / kColumns * desired.size_px.x(), (y + 0.5) / kRows * desired.size_px.y(), 1)).normalized().cast<float>());
  tracer.Trace(setup.desired.centre.cast<float>(), directions, t, normals);
  for (std::size_t s = 0; s < t.size(); ++s)
    if (std::isfinite(t[s]) && t[s] > 0) LookAtRay(sources, setup, maps, directions[s], t[s], normals[s], scratch, e);
}

// A few of the views.
template <typename Look>
void ForSomeViews(const std::vector<RenderView>& desired, const Look& look) {
  const std::size_t step = std::max<std::size_t>(1, desired.size() / kViews);
  for (std::size_t i = step / 2; i < desired.size(); i += step) look(desired[i]);
}

double Share(long part, long whole) { return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0; }

bool IsOn(const RadianceSettings& s, const std::string& name) {
  if (name == "fov") return s.field_of_view;
  if (name == "visibility") return s.visibility;
  if (name == "time") return s.time;
  if (name == "exposure") return s.exposure;
  if (name == "prefilter") return s.prefilter;
  return s.resolution != Resolution::kOff;
}

}  // namespace

const std::vector<std::string>& EffectNames() {
  static const std::vector<std::string> names = {"fov", "resolution", "visibility", "time", "exposure", "prefilter"};
  return names;
}

void SwitchEffect(RadianceSettings& s, const std::string& name, bool on) {
  if (name == "fov") s.field_of_view = on;
  if (name == "visibility") s.visibility = on;
  if (name == "time") s.time = on;
  if (name == "exposure") s.exposure = on;
  if (name == "prefilter") s.prefilter = on;
  if (name == "resolution" && !on) s.resolution = Resolution::kOff;
  if (name == "resolution" && on && s.resolution == Resolution::kOff) s.resolution = Resolution::kDistance;
}

void ApplyEffectList(const std::string& effects, RadianceSettings& settings, std::set<std::string>& decided) {
  if (effects == "auto") return;
  if (effects.empty()) throw UsageError("--effects takes auto, none, or a list; not nothing");
  std::set<std::string> wanted;
  std::istringstream list(effects == "none" ? "" : effects);
  for (std::string name; std::getline(list, name, ',');) {
    const auto& names = EffectNames();
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw UsageError(fmt::format("--effects takes auto, none, or a list of {}; not {}", fmt::join(names, ", "), name));
    wanted.insert(name);
  }
  for (const std::string& name : EffectNames()) {
    if (decided.count(name) > 0) continue;
    decided.insert(name);
    SwitchEffect(settings, name, wanted.count(name) > 0);
  }
}

static EffectChoice Choose(const Scene& scene, const Evidence& e, const RadianceSettings& settings, const std::set<std::string>& decided, double gain_spread) {
  EffectChoice choice;
  choice.settings = settings;
  const double ends = Share(e.ends, e.rays), blocked = Share(e.blocked, e.rays), oversampled = Share(e.oversampled, e.photos);
  const double penalty = Percentile(e.penalty, 0.5), disagreement = Percentile(e.disagreement, 0.9);
  const bool timed = std::any_of(scene.views.begin(), scene.views.end(), [](const View& v) { return v.time_s.has_value(); });

  for (const std::string& name : EffectNames()) {
    Effect effect;
    effect.name = name;
    bool on = false;
    if (name == "fov") {
      on = ends >= kShareThatCounts;
      effect.evidence = fmt::format("at {:.1f} % of the rays one of the nearest photos ends", 100 * ends);
    } else if (name == "resolution") {
      on = penalty >= kPenaltyThatCounts;
      effect.evidence = fmt::format("at half of the rays the nearest photos' penalties for stretched pixels differ by {:.2f} of the largest or more", penalty);
      if (on && decided.count(name) == 0) {
        const bool agree = scene.frame == Frame::kMetric && disagreement <= kMeasuresAgree;
        choice.settings.resolution = agree ? Resolution::kDistance : Resolution::kJacobian;
        if (scene.frame == Frame::kMetric)
          effect.evidence += fmt::format("; by distance and by Jacobian they differ by {:.2f} octaves: {}", disagreement, Name(choice.settings.resolution));
      }
    } else if (name == "visibility") {
      on = blocked >= kShareThatCounts;
      effect.evidence = fmt::format("at {:.1f} % of the rays the proxy blocks one of the nearest photos", 100 * blocked);
    } else if (name == "time") {
      const bool at_once = timed && ClockOf(scene).several_at_once;
      on = timed && (settings.period_s > 0 || at_once);
      effect.evidence = !timed ? "photos carry no times" : settings.period_s > 0 ? "photos carry times and the scene a period" : at_once ? "several photos were taken at each moment" : decided.count(name) > 0 ? "photos carry times" : "the scene has no period, and no time was asked for";
    } else if (name == "exposure") {
      on = gain_spread > 1;
      effect.evidence = on ? fmt::format("photos of one point differ by a factor of up to {:.2f}", gain_spread) : "photos of one point agree";
    } else {
      on = oversampled >= kShareThatCounts;
      effect.evidence = fmt::format("{:.1f} % of the photos have more than {:.1f} pixels a pixel", 100 * oversampled, std::sqrt(static_cast<double>(kReadWhole)) * std::exp2(kLevelThatCounts));
    }
    if (decided.count(name) > 0)
      effect.decided_by = "asked for by an option";
    else
      SwitchEffect(choice.settings, name, on);
    effect.on = IsOn(choice.settings, name);
    choice.effects.push_back(effect);
  }
  return choice;
}

EffectChoice ChooseEffects(const Scene& scene, const Mesh& proxy, const std::vector<RenderView>& desired, const std::vector<bool>& use,
                           const RadianceSettings& settings, const std::set<std::string>& decided, double gain_spread) {
  Evidence e;
  const Sources sources = MakeSources(scene);
  const ProxyTracer tracer(proxy, scene.normalized_from_world);
  const VisibilityMaps maps = CanOcclude(proxy) ? MakeVisibilityMaps(sources, tracer) : VisibilityMaps();
  ForSomeViews(desired, [&](const RenderView& view) { LookAtView(sources, tracer, maps, view, use, settings, e); });
  return Choose(scene, e, settings, decided, gain_spread);
}

EffectChoice ChooseEffects(const Scene& scene, const std::vector<RenderView>& desired, const std::function<PictureWorld(const RenderView&)>& world,
                           const RadianceSettings& settings, const std::set<std::string>& decided, double gain_spread) {
  Evidence e;
  ForSomeViews(desired, [&](const RenderView& view) {
    const PictureWorld w = world(view);
    LookAtView(w.sources, ProxyTracer(w.proxy, w.sources.normalized_from_world), {}, w.view, w.use, settings, e);
  });
  return Choose(scene, e, settings, decided, gain_spread);
}

void MeasureEffects(Renderer& renderer, const RenderView& desired, const std::vector<bool>& use, EffectChoice& choice) {
  using Clock = std::chrono::steady_clock;
  RenderRequest request;
  request.view = desired;
  request.use = use;
  // Small: cost is in proportion to the pixels, near enough.
  const double scale = std::min(1.0, static_cast<double>(kProbeWidth) / desired.size_px.x());
  request.view.size_px = (desired.size_px.cast<double>() * scale).array().round().max(1).cast<int>();
  request.view.P.topRows<2>() *= scale;
  const double pixels = static_cast<double>(desired.size_px.cast<double>().prod()) / request.view.size_px.cast<double>().prod();
  const auto time = [&](const RadianceSettings& settings) {
    request.settings = settings;
    renderer.Render(request);
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const auto start = Clock::now();
      renderer.Render(request);
      best = std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    return best * pixels;
  };
  const double all = time(choice.settings);
  for (Effect& effect : choice.effects) {
    if (!effect.on) continue;
    RadianceSettings without = choice.settings;
    SwitchEffect(without, effect.name, false);
    effect.cost_ms = std::max(0.0, all - time(without));
  }
}

}  // namespace lumi
