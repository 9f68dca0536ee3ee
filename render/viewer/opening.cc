#include "render/viewer/opening.h"

#include <fmt/format.h>

#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {

int FindView(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    if (scene.views[i].name == name) return static_cast<int>(i);
  if (!name.empty() && name.find_first_not_of("0123456789") == std::string::npos && name.size() < 8)
    if (const auto i = std::stoul(name); i < scene.views.size()) return static_cast<int>(i);
  throw UsageError(fmt::format("the scene has no photo '{}'", name),
                   fmt::format("photos are named as '{}', or by position 0 to {}", scene.views.front().name, scene.views.size() - 1));
}

Opened OpenForViewing(const ViewerOptions& options, ProgressSink& progress) {
  Opened o;
  OpenOptions open;
  open.rescale_cameras = options.rescale_cameras;
  o.scene = OpenScene(options.scene, open, progress);
  if (o.scene.views.empty()) throw DataError("the scene has no photos", "", options.scene);
  if (o.scene.frame != Frame::kMetric) throw DataError("the viewer shows metric scenes, this one is " + std::string(Name(o.scene.frame)), "", options.scene);
  o.proxy_name = options.proxy.empty() ? o.scene.active_proxy : options.proxy;
  // A workspace that is not ours has no active proxy: any one shows more than none.
  if (const auto names = ListProxies(o.scene.folder); o.proxy_name.empty() && !names.empty()) o.proxy_name = names.front();
  o.proxy = LoadProxy(o.scene, o.proxy_name);
  if (!options.view.empty()) FindView(o.scene, options.view);
  return o;
}

}  // namespace lumi
