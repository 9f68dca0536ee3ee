#include "render/tradeoff/workbench.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "render/effects/effects.h"
#include "render/effects/exposure.h"
#include "render/holdout/holdout.h"
#include "render/settings_json.h"
#include "render/time/clock.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr int kLargestWidth = 1024, kQuickWidth = 320;
constexpr double kReferenceCutoffDeg = 24;

}  // namespace

void RequireConsistent(const MeasureOptions& o) {
  if (const std::string problem = Validate(o.settings); !problem.empty()) throw UsageError(problem);
  if (o.holdout < 2) throw UsageError("--holdout takes 2 or more");
  if (o.views < 1) throw UsageError("--views takes 1 or more");
  if (o.repeats < 1 || o.repeats > 1000) throw UsageError("--repeats takes 1 to 1000");
  if (o.width_px < 0 || o.width_px > kMaxPictureSide || o.reference_width_px < 0 || o.reference_width_px > kMaxPictureSide)
    throw UsageError("--width and --reference-width take 1 to " + std::to_string(kMaxPictureSide));
  if (!o.view.empty() && !o.path.empty()) throw UsageError("--view and --path do not go together");
  for (std::size_t i = 0; i < o.proxies.size(); ++i)
    if (std::find(o.proxies.begin(), o.proxies.begin() + static_cast<std::ptrdiff_t>(i), o.proxies[i]) !=
        o.proxies.begin() + static_cast<std::ptrdiff_t>(i))
      throw UsageError("--proxy " + o.proxies[i] + " is given twice");
  RadianceSettings settings = o.settings;
  std::set<std::string> decided = o.decided;
  ApplyEffectList(o.effects, settings, decided);
}

Workbench::Workbench(const MeasureOptions& o, const std::string& marker, ProgressSink& sink) : o_(o), settings_(o.settings) {
  RequireConsistent(o);
  std::set<std::string> decided = o.decided;
  ApplyEffectList(o.effects, settings_, decided);
  if (!o.output.empty()) RequireOurFolder(o.output, marker);
  OpenOptions open;
  open.rescale_cameras = o.rescale_cameras;
  scene_ = OpenScene(o.scene, open, sink);
  RequireMetric(scene_, "rendering");
  if (scene_.views.empty()) throw DataError("the scene has no photos with cameras", "", o.scene);
  proxies_ = o.proxies;
  if (proxies_.empty()) {
    proxies_ = ListProxies(scene_.folder);
    std::stable_partition(proxies_.begin(), proxies_.end(), [&](const std::string& p) { return p == scene_.active_proxy; });
    if (proxies_.empty()) proxies_ = {""};  // LoadProxy says what is missing
  }
  for (const std::string& p : proxies_) meshes_[p] = std::make_unique<Mesh>(LoadProxy(scene_, p));
  photos_ = LoadPhotos(scene_, {}, sink);

  double gain_spread = 1;
  if (!decided.contains("exposure") || settings_.exposure) {
    const Exposures exposures = EstimateExposures(scene_, photos_);
    if (exposures.Differ()) gain_spread = exposures.spread;
    for (std::size_t i = 0; i < scene_.views.size(); ++i) scene_.views[i].gain = exposures.gain[i];
  }
  std::vector<RenderView> desired;
  std::vector<bool> use(scene_.views.size(), true);
  for (const ViewId id : FoldViews(scene_, o.holdout, Fold::kReport)) {
    desired.push_back(HeldOutView(scene_, scene_.views[static_cast<std::size_t>(id.value)], Width()));
    use[static_cast<std::size_t>(id.value)] = false;
  }
  if (std::none_of(use.begin(), use.end(), [](bool u) { return u; })) use.clear();
  TakeClock(scene_, decided.contains("time-window-s"), settings_);
  own_times_ = !decided.contains("time-s");
  if (own_times_) settings_.time_s = FirstTime(scene_).value_or(settings_.time_s);
  settings_ = ChooseEffects(scene_, mesh(proxies_.front()), desired, use, settings_, decided, gain_spread).settings;
}

RadianceSettings Workbench::For(const RenderView& view, const RadianceSettings& settings) const {
  return own_times_ ? AtTimeOf(settings, view) : settings;
}

nlohmann::ordered_json Workbench::ToJson(const RadianceSettings& settings) const {
  nlohmann::ordered_json j = lumi::ToJson(settings);
  if (own_times_) j.erase("time-s");
  j["backend"] = o_.backend;
  return j;
}

Renderer& Workbench::Cpu(const std::string& proxy) {
  auto& r = cpu_[proxy];
  if (!r) r = MakeCpuRenderer(scene_, mesh(proxy), photos_);
  return *r;
}

Renderer& Workbench::Measured(const std::string& proxy) {
  if (o_.backend != "gl") return Cpu(proxy);
  auto& r = gl_[proxy];
  if (!r) r = MakeGlRenderer(scene_, mesh(proxy), photos_);
  return *r;
}

void Workbench::Drop(const std::string& proxy) {
  cpu_.erase(proxy);
  gl_.erase(proxy);
}

int Workbench::Width() const {
  int widest = 1;
  for (const View& v : scene_.views) widest = std::max(widest, scene_.CameraOf(v).width_px);
  const int most = std::min(widest, o_.quick ? kQuickWidth : kLargestWidth);
  return o_.width_px > 0 ? std::min(o_.width_px, widest) : most;
}

bool Workbench::MayWriteScene() const {
  std::error_code ec;
  return std::filesystem::exists(scene_.folder / "lumigraph.json", ec);
}

RadianceSettings ReferenceSettings(const RadianceSettings& base) {
  RadianceSettings s = WithMethod(base, Method::kOptimumPixel);
  s.cutoff_rad = kReferenceCutoffDeg * kRadiansPerDegree;
  return s;
}

}  // namespace lumi
