#include "render/effects/effects.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/evaluate.h"
#include "render/time/clock.h"
#include "render/world/visibility_maps.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Evidence is gathered at rays of a few of the views: enough to notice an effect at one ray in a thousand.
constexpr std::size_t kViews = 8;
constexpr int kColumns = 24, kRows = 18;
constexpr int kProbeWidth = 256;

// The evidence of every effect.
template <typename M>
struct Held {
  explicit Held(const RadianceSettings&) {}
};
template <Effectual M>
struct Held<M> {
  explicit Held(const RadianceSettings& settings) : evidence(settings) {}
  typename M::Evidence evidence;
};
template <typename List>
struct HeldFor;
template <typename... M>
struct HeldFor<MeasureListOf<M...>> : Held<M>... {
  explicit HeldFor(const RadianceSettings& settings) : Held<M>(settings)... {}
};
using Evidence = HeldFor<MeasureList>;

// Jacobian: pixels for a unit step along the tangents e1, e2 of the plane at p, for a camera at the origin with matrix
// M.
Eigen::Matrix2d PixelsAStep(const Eigen::Matrix3d& M, const Eigen::Vector3d& p, const Eigen::Vector3d& e1,
                            const Eigen::Vector3d& e2) {
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

// The k + 1 photos nearest in angle.
std::vector<int> NearestInAngle(const ViewSetup& setup, const std::vector<float>& theta) {
  std::vector<int> order;
  for (int j = 0; j < setup.sources.count; ++j)
    if (setup.sources.enabled[static_cast<std::size_t>(j)] > 0) order.push_back(j);
  const std::size_t k =
      std::min(order.size(), static_cast<std::size_t>(setup.settings.k == 0 ? kMaxBlend : setup.settings.k + 1));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(k), order.end(), [&](int a, int b) {
    return theta[static_cast<std::size_t>(a)] < theta[static_cast<std::size_t>(b)];
  });
  order.resize(k);
  return order;
}

// Measures a photo's pixels on the proxy's plane at p, with normal n and tangents e1, e2.
void MeasurePixels(const RenderView& photo, const ViewSetup& setup, const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                   const Eigen::Vector3d& e1, const Eigen::Vector3d& e2, NearPhoto& out) {
  const Eigen::Matrix3d desired = setup.desired.P.leftCols<3>(), M = DepthScaled(photo);
  const Eigen::Vector3d q = p - (photo.centre - setup.desired.centre);
  const double depth = M.row(2).dot(q);
  out.ahead = depth > 0;
  if (!out.ahead) return;
  const double focal = std::sqrt(std::abs(M.determinant()));
  out.pyramid_level = PyramidLevel(Footprint(focal / static_cast<double>(setup.focal_px),
                                             FacingRatio(n.dot(q), n.dot(p)), desired.row(2).dot(p) / depth));
  const Eigen::Matrix2d step = PixelsAStep(M, q, e1, e2);
  out.measured = std::abs(step.determinant()) >= 1e-12 * step.squaredNorm();
  if (!out.measured) return;
  const Eigen::Matrix2d J = PixelsAStep(desired, p, e1, e2) * step.inverse();
  out.octaves_jacobian = std::log2(LargestSingularValue(J(0, 0), J(0, 1), J(1, 0), J(1, 1)));
  out.octaves_distance = std::log2(DistanceStretch(q.norm(), p.norm(), focal, static_cast<double>(setup.focal_px)));
}

void LookAtRay(const TracedProxy& proxy, const ViewSetup& setup, const Eigen::Vector3f& d, float t,
               const Eigen::Vector3f& normal, Evidence& evidence) {
  thread_local Measures m;
  EvaluateMeasures(setup.sources, setup.settings, d, t, normal, m);
  EvaluateVisibility(setup.sources, &proxy.maps, d, t, m);
  const Eigen::Vector3d p = (t * d).cast<double>(), n = normal.norm() > 0 ? normal.cast<double>() : p.normalized();
  const Eigen::Vector3d e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  std::vector<NearPhoto> photos;
  for (const int camera : NearestInAngle(setup, m.theta)) {
    const auto j = static_cast<std::size_t>(camera);
    NearPhoto& photo = photos.emplace_back();
    photo.f = m.f[j];
    photo.v = m.v[j];
    if (photo.f > 0) MeasurePixels(proxy.sources.views[j], setup, p, n, e1, e2, photo);
  }
  ForEachEffect([&]<typename M> { static_cast<Held<M>&>(evidence).evidence.Look(photos); });
}

void LookAtView(const TracedProxy& proxy, const RenderView& desired, const std::vector<bool>& use,
                RadianceSettings settings, Evidence& e) {
  settings.field_of_view = true;
  ForEachTerm([&]<typename M> { M::Switch(settings, false); });
  const ViewSetup setup = MakeViewSetup(proxy.sources, desired, settings, use);
  std::vector<Eigen::Vector3f> directions, normals(kColumns * kRows);
  std::vector<float> t(kColumns * kRows);
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x)
      directions.push_back((setup.ray_from_pixel * Eigen::Vector3d((x + 0.5) / kColumns * desired.size_px.x(),
                                                                   (y + 0.5) / kRows * desired.size_px.y(), 1))
                               .normalized()
                               .cast<float>());
  proxy.tracer.Trace(setup.desired.centre.cast<float>(), directions, t, normals);
  for (std::size_t s = 0; s < t.size(); ++s)
    if (std::isfinite(t[s]) && t[s] > 0) LookAtRay(proxy, setup, directions[s], t[s], normals[s], e);
}

// Calls look for about kViews of the views.
template <typename Look>
void ForSomeViews(const std::vector<RenderView>& desired, const Look& look) {
  const std::size_t step = std::max<std::size_t>(1, desired.size() / kViews);
  for (std::size_t i = step / 2; i < desired.size(); i += step) look(desired[i]);
}

}  // namespace

const std::vector<std::string>& EffectNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> n;
    ForEachEffect([&]<typename M> { n.emplace_back(M::kName); });
    return n;
  }();
  return names;
}

std::string EffectsHelp() {
  return fmt::format("auto: what the data call for; none; or a list of {}", fmt::join(EffectNames(), ", "));
}

void ListKeys(JsonKeys& j, Effect& e) {
  j("name", e.name, "on", e.on).Say("evidence", Reason(e)).IfAny("cost_ms", e.cost_ms);
}

void SwitchEffect(RadianceSettings& settings, std::string_view name, bool on) {
  bool known = false;
  ForEachEffect([&]<typename M> {
    if (M::kName != name) return;
    M::Switch(settings, on);
    known = true;
  });
  if (!known) throw std::invalid_argument("SwitchEffect: no effect is called " + std::string(name));
}

std::string EffectListOf(const RadianceSettings& settings) {
  std::vector<std::string_view> on;
  ForEachEffect([&]<typename M> {
    if (M::On(settings)) on.push_back(M::kName);
  });
  return on.empty() ? "none" : fmt::format("{}", fmt::join(on, ","));
}

void ApplyEffectList(const std::string& effects, RadianceSettings& settings, Decided& decided) {
  if (effects == "auto") return;
  if (effects.empty()) throw UsageError("--effects takes auto, none, or a list; not nothing");
  std::set<std::string> wanted;
  std::istringstream list(effects == "none" ? "" : effects);
  for (std::string name; std::getline(list, name, ',');) {
    const auto& names = EffectNames();
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw UsageError(
          fmt::format("--effects takes auto, none, or a list of {}; not {}", fmt::join(names, ", "), name));
    wanted.insert(name);
  }
  for (const std::string& name : EffectNames()) {
    if (decided.Has(name)) continue;
    decided.Add(name);
    SwitchEffect(settings, name, wanted.count(name) > 0);
  }
}

static EffectChoice Choose(const Scene& scene, const Evidence& evidence, const RadianceSettings& settings,
                           const Decided& decided, const PhotoFacts& photos) {
  EffectChoice choice;
  choice.settings = settings;
  ViewFacts facts{photos};
  facts.metric = scene.frame == Frame::kMetric;
  facts.timed = std::any_of(scene.views.begin(), scene.views.end(), [](const View& v) { return v.time_s.has_value(); });
  facts.several_at_once = facts.timed && ClockOf(scene).several_at_once;
  const std::shared_ptr<const PhotoFields> fields = MakeSources(scene).fields;
  ForEachEffect([&]<typename M> {
    Effect effect;
    effect.name = M::kName;
    effect.from_photos = FromPhotos<M>;
    facts.asked = decided.Has(effect.name);
    facts.field = &(*fields)[MeasureList::IndexOf<M>()];
    typename M::Settings chosen = choice.settings;
    const Verdict verdict = static_cast<const Held<M>&>(evidence).evidence.Decide(facts, chosen);
    effect.evidence = verdict.evidence;
    if (facts.asked) {
      effect.decided_by = "asked for by an option";
    } else {
      static_cast<typename M::Settings&>(choice.settings) = chosen;
      M::Switch(choice.settings, verdict.on);
    }
    effect.on = M::On(choice.settings);
    choice.effects.push_back(effect);
  });
  return choice;
}

EffectChoice ChooseEffects(const Scene& scene, const Mesh& proxy, const std::vector<RenderView>& desired,
                           const std::vector<bool>& use, const RadianceSettings& settings, const Decided& decided,
                           const PhotoFacts& photos) {
  Evidence e(settings);
  const TracedProxy traced(scene, proxy);
  ForSomeViews(desired, [&](const RenderView& view) { LookAtView(traced, view, use, settings, e); });
  return Choose(scene, e, settings, decided, photos);
}

EffectChoice ChooseEffects(const Scene& scene, const std::vector<RenderView>& desired,
                           const std::function<PictureWorld(const RenderView&)>& world,
                           const RadianceSettings& settings, const Decided& decided, const PhotoFacts& photos) {
  Evidence e(settings);
  ForSomeViews(desired, [&](const RenderView& view) {
    const PictureWorld w = world(view);
    LookAtView(TracedProxy(w), w.view, w.use, settings, e);
  });
  return Choose(scene, e, settings, decided, photos);
}

void MeasureEffects(Renderer& renderer, const RenderView& desired, const std::vector<bool>& use, EffectChoice& choice) {
  RenderRequest request;
  request.view = desired;
  request.use = use;
  // Renders small pictures: the time is nearly proportional to the pixels.
  const double scale = std::min(1.0, static_cast<double>(kProbeWidth) / desired.size_px.x());
  request.view.size_px = (desired.size_px.cast<double>() * scale).array().round().max(1).cast<int>();
  request.view.P.topRows<2>() *= scale;
  const double pixels =
      static_cast<double>(desired.size_px.cast<double>().prod()) / request.view.size_px.cast<double>().prod();
  const auto time = [&](const RadianceSettings& settings) {
    request.settings = settings;
    renderer.Render(request);
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const Stopwatch watch;
      renderer.Render(request);
      best = std::min(best, 1000 * watch.Seconds());
    }
    return best * pixels;
  };
  const double all = time(choice.settings);
  for (Effect& effect : choice.effects) {
    effect.cost_ms = 0;
    if (!effect.on) continue;
    RadianceSettings without = choice.settings;
    SwitchEffect(without, effect.name, false);
    effect.cost_ms = std::max(0.0, all - time(without));
  }
}

}  // namespace lumi
