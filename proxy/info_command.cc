#include <chrono>

#include "proxy/commands.h"
#include "proxy/make_proxy.h"
#include "scene/program/stopwatch.h"

namespace lumi {

InfoSummary RunInfo(const std::filesystem::path& path, const std::string& name, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = OpenForProxy(path, progress);
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  const std::vector<ProxyPoint> points = SelectPoints(scene, views, {}).points;
  std::vector<std::string> names = ListProxies(scene.folder);
  if (!name.empty()) {
    LoadProxy(scene, name);  // throws where it is not there, naming those that are
    names = {name};
  }
  InfoSummary s{scene.active_proxy, !name.empty(), views.size(), scene.points.size(), points.size(), {}, 0};
  Progress steps(progress, "proxies", static_cast<long>(names.size()));
  for (const std::string& each : names) {
    const auto mesh_start = std::chrono::steady_clock::now();
    const Mesh mesh = LoadProxy(scene, each);
    ProxyInfo info{each,
                   mesh.faces.size(),
                   mesh.vertices.size(),
                   IsClosed(mesh),
                   each == scene.active_proxy,
                   CheckSoundness(mesh),
                   MeasureFit(mesh, views, points),
                   0};
    info.seconds = SecondsSince(mesh_start);
    s.proxies.push_back(std::move(info));
    steps.Step();
  }
  s.seconds = SecondsSince(start);
  return s;
}

}  // namespace lumi
