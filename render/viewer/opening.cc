#include "render/viewer/opening.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "render/time/clock.h"
#include "render/viewer/matrix_player.h"
#include "render/world/visibility_maps.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// Views that tell which effects are called for: along a walk through the photos.
constexpr double kLookedAt = 8;
constexpr int kLookWidth = 640, kLookHeight = 480;

}  // namespace

int FindView(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    if (scene.views[i].name == name) return static_cast<int>(i);
  if (!name.empty() && name.find_first_not_of("0123456789") == std::string::npos && name.size() < 8)
    if (const auto i = std::stoul(name); i < scene.views.size()) return static_cast<int>(i);
  throw UsageError(fmt::format("the scene has no photo '{}'", name),
                   fmt::format("photos are named as '{}', or by position 0 to {}", scene.views.front().name, scene.views.size() - 1));
}

PreparedProxy PrepareProxy(const Scene& scene, const Sources& sources, const std::string& name) {
  PreparedProxy p;
  p.name = name;
  p.mesh = LoadProxy(scene, name);
  p.tracer = std::make_shared<const ProxyTracer>(p.mesh, sources.normalized_from_world);
  p.visibility =
      std::make_shared<const VisibilityMaps>(CanOcclude(p.mesh) ? MakeVisibilityMaps(sources, *p.tracer) : VisibilityMaps());
  return p;
}

void ApplyEffects(const EffectChoice& choice, const std::set<std::string>& decided, RadianceSettings& settings) {
  for (const Effect& e : choice.effects) {
    if (decided.count(e.name) > 0) continue;
    SwitchEffect(settings, e.name, e.on);
    if (e.name == "resolution" && e.on) settings.resolution = choice.settings.resolution;
  }
}

void ApplyEffectList(const std::string& list, const EffectChoice& choice, const std::set<std::string>& decided,
                     RadianceSettings& settings) {
  if (list == "auto") return ApplyEffects(choice, decided, settings);
  std::set<std::string> wanted;
  std::istringstream in(list == "none" ? "" : list);
  for (std::string name; std::getline(in, name, ',');) {
    const auto& names = EffectNames();
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw UsageError(fmt::format("--effects takes auto, none, or a list of {}; not {}", fmt::join(names, ", "), name));
    wanted.insert(name);
  }
  for (const std::string& name : EffectNames())
    if (decided.count(name) == 0) SwitchEffect(settings, name, wanted.count(name) > 0);
}

Opened::Opened() = default;
Opened::Opened(Opened&&) noexcept = default;
Opened::~Opened() = default;

Opened OpenForViewing(const ViewerOptions& options, ProgressSink& progress) {
  Opened o;
  OpenOptions open;
  open.rescale_cameras = options.rescale_cameras;
  o.scene = OpenScene(options.scene, open, progress);
  if (o.scene.views.empty()) throw DataError("the scene has no photos", "", options.scene);
  if (!options.view.empty()) FindView(o.scene, options.view);
  if (PlaysMatrices(options, o.scene)) {
    o.matrices = std::make_unique<OpenedMatrices>();
    o.matrices->scene = std::move(o.scene);
    OpenMatrices(options, progress, *o.matrices);
    return o;
  }
  if (!options.path.empty()) o.path = ReadCameraPath(options.path, PathDetail::kKeyframes);
  std::string name = options.proxy.empty() ? o.scene.active_proxy : options.proxy;
  // A workspace that is not ours has no active proxy: any one shows more than none.
  if (const auto names = ListProxies(o.scene.folder); name.empty() && !names.empty()) name = names.front();
  progress.Report("preparing the proxy", 0, 0, 0, -1);
  o.proxy = PrepareProxy(o.scene, MakeSources(o.scene), name);
  progress.Report("looking at which effects the photos call for", 0, 0, 0, -1);
  RadianceSettings settings = options.settings;
  TakeClock(o.scene, options.decided.count("time-window-s") > 0, settings);
  o.effects = ChooseEffects(o.scene, o.proxy.mesh, SamplePath(PathThroughPhotos(o.scene, kLookedAt, 1), kLookWidth, kLookHeight), {},
                            settings, {}, 1.0);
  return o;
}

}  // namespace lumi
