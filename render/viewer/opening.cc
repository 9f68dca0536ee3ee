#include "render/viewer/opening.h"

#include <fmt/format.h>

#include <utility>

#include "render/path/matrix_path.h"
#include "render/radiance/setting_options.h"
#include "render/world/visibility_maps.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// Evidence for effects is gathered at so many views along a walk through the photos.
constexpr double kLookedAt = 8;
constexpr int kLookWidth = 640, kLookHeight = 480;

}  // namespace

int FindView(const Scene& scene, const std::string& name) { return ViewCalled(scene, name); }

PreparedProxy PrepareProxy(const std::string& name, Mesh mesh, const Sources& sources) {
  PreparedProxy p;
  p.name = name;
  p.mesh = std::move(mesh);
  p.tracer = std::make_shared<const ProxyTracer>(p.mesh, sources.normalized_from_world);
  p.visibility = std::make_shared<const VisibilityMaps>(ProxyVisibility(sources, p.mesh, *p.tracer));
  return p;
}

void ApplyEffects(const EffectChoice& choice, const Decided& decided, RadianceSettings& settings) {
  for (const Effect& e : choice.effects) {
    if (decided.Has(e.name)) continue;
    SwitchEffect(settings, e.name, e.on);
    // If the effect has several variants, takes the one that the data call for.
    const SettingOption* option = FindSettingOption(e.name);
    if (e.on && IsOn(choice.settings, e.name)) option->set(settings, option->get(choice.settings));
  }
}

void SetEffects(const std::string& list, const EffectChoice& choice, RadianceSettings& settings) {
  Decided decided;
  if (list == "auto")
    ApplyEffects(choice, decided, settings);
  else
    ApplyEffectList(list, settings, decided);
}

namespace {

// Options that contradict a path of matrices are refused: each of its frames has its own proxy, moment and camera.
void OpenAlongMatrices(const ViewerOptions& options, ProgressSink& progress, Opened& o) {
  if (!options.proxy.empty() && options.proxy != kPerViewProxy)
    throw UsageError("a path of matrices is shown with each view's own proxy, not with " + options.proxy,
                     "use --proxy per-view");
  if (options.budget_ms > 0 || options.refine)
    throw UsageError("--budget-ms and --refine are of a camera that is steered; a path of matrices plays by itself");
  if (options.settings.method != Algorithm::kUlr)
    throw UsageError("a path of matrices is drawn by OpenGL as it plays: --method does not go with it");
  if (options.phase) throw UsageError("--phase does not go with a path of matrices: each of its frames has its moment");
  o.lumigraph.MakePictures(kPerViewProxy, true);
  o.lumigraph.ReadPhotos(progress);
  o.frames = MatrixViews(o.lumigraph.scene(), *o.matrices, o.matrices->width_px, o.matrices->height_px);
  progress.Report("looking at which effects the photos call for", 0, 0, 0, -1);
  o.lumigraph.ChooseMeasures(o.frames, {});
}

}  // namespace

std::unique_ptr<Opened> OpenForViewing(const ViewerOptions& options, ProgressSink& progress) {
  std::unique_ptr<Opened> o(new Opened{Lumigraph(options, progress), {}, {}, {}, {}, {}});
  const Scene& scene = o->lumigraph.scene();
  if (!options.view.empty()) FindView(scene, options.view);
  o->matrices = MatrixPathFor(scene, options.path, 30);
  if (o->matrices) {
    OpenAlongMatrices(options, progress, *o);
    return o;
  }
  if (!options.path.empty()) o->path = ReadCameraPath(options.path, PathDetail::kKeyframes);
  std::string name = options.proxy.empty() ? scene.active_proxy : options.proxy;
  // A workspace that is not ours has no active proxy: its first one is better than none.
  if (const auto names = ListProxies(scene.folder); name.empty() && !names.empty()) name = names.front();
  if (name == kPerViewProxy)
    throw UsageError("--proxy per-view is seen along a path of matrices", "name one with --path");
  progress.Report("preparing the proxy", 0, 0, 0, -1);
  o->lumigraph.MakePictures(name, false);
  o->proxy = PrepareProxy(name, o->lumigraph.mesh(), MakeSources(scene));
  progress.Report("looking at which effects the photos call for", 0, 0, 0, -1);
  o->effects =
      o->lumigraph.MeasuresCalledFor(SamplePath(PathThroughPhotos(scene, kLookedAt, 1), kLookWidth, kLookHeight));
  return o;
}

}  // namespace lumi
