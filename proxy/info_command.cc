#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "proxy/describe.h"
#include "proxy/hull/soundness.h"
#include "proxy/mesh_query.h"
#include "scene/files/scene_folder.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

std::string Yes(const Json& flag) { return flag.get<bool>() ? "yes" : "no"; }

std::string OneProxy(const Json& p) {
  const auto percent = [&](const char* key) { return 100 * p[key].get<double>(); };
  return fmt::format("{}{}: {} faces, {} vertices, {} parts\n  {}\n"
                     "  coverage of the views    {:.1f} % of their rays, {:.1f} % of the least covered; fronts {:.1f} %\n"
                     "  depth complexity         {:.2f} layers a ray that meets it, {} at most\n"
                     "  off the points           {:.3f} % of their depth in the middle, {:.3f} % for 95 of 100\n"
                     "  lines of sight blocked   {:.2f} % of {}",
                     p["name"].get<std::string>(), p["active"].get<bool>() ? " (active)" : "", p["faces"].get<std::size_t>(), p["vertices"].get<std::size_t>(),
                     p["parts"].get<std::size_t>(), p["soundness"].get<std::string>(), percent("coverage"), percent("coverage_min"), percent("front_fraction"),
                     p["layers_mean"].get<double>(), p["layers_max"].get<int>(), percent("point_distance_median"), percent("point_distance_95"),
                     percent("blocked_ray_fraction"), p["lines_of_sight"].get<std::size_t>());
}

}  // namespace

std::string DescribeSurface(const Soundness& sound) {
  if (!sound.manifold) return "not 2-manifold and oriented";
  return fmt::format("{}, 2-manifold{}, {}", sound.closed ? "closed" : "open", !sound.closed ? "" : sound.outward ? ", front faces outwards" : ", front faces inwards",
                     sound.degenerate_faces == 0 ? std::string("no degenerate face") : fmt::format("{} degenerate faces", sound.degenerate_faces));
}

std::string RunInfo(const std::filesystem::path& path, const std::string& name, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  OpenOptions options;
  options.check_photos = false;
  const Scene scene = OpenScene(path, options, progress);
  RequireMetric(scene, "a proxy");
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  const std::vector<ProxyPoint> points = SelectPoints(scene, views, {}).points;
  std::vector<std::string> names = ListProxies(scene.folder);
  if (!name.empty()) {
    LoadProxy(scene, name);  // says which there are where it is not
    names = {name};
  }
  Json json{{"active_proxy", scene.active_proxy}, {"one", !name.empty()}, {"views", views.size()}, {"points", scene.points.size()},
            {"reliable_points", points.size()}, {"proxies", Json::array()}};
  Progress steps(progress, "proxies", static_cast<long>(names.size()));
  for (const std::string& each : names) {
    const auto mesh_start = std::chrono::steady_clock::now();
    const Mesh mesh = LoadProxy(scene, each);
    const MeshFit fit = MeasureFit(mesh, views, points);
    const Soundness sound = CheckSoundness(mesh);
    json["proxies"].push_back({{"name", each}, {"faces", mesh.faces.size()}, {"vertices", mesh.vertices.size()}, {"closed", IsClosed(mesh)},
                               {"manifold", sound.manifold}, {"degenerate_faces", sound.degenerate_faces}, {"parts", sound.parts}, {"soundness", DescribeSurface(sound)},
                               {"active", each == scene.active_proxy}, {"coverage", fit.coverage}, {"coverage_min", fit.coverage_min},
                               {"front_fraction", fit.front_fraction}, {"layers_mean", fit.layers_mean}, {"layers_max", fit.layers_max},
                               {"blocked_ray_fraction", fit.blocked_ray_fraction}, {"lines_of_sight", fit.lines_of_sight},
                               {"point_distance_median", fit.distance_median}, {"point_distance_95", fit.distance_95}, {"seconds", SecondsSince(mesh_start)}});
    steps.Step();
  }
  json["seconds"] = SecondsSince(start);
  return json.dump();
}

std::string DescribeInfo(const std::string& text) {
  const Json json = Json::parse(text);
  std::string out = fmt::format("{} views, {} points, {} of them reliable\n", json["views"].get<std::size_t>(), json["points"].get<std::size_t>(), json["reliable_points"].get<std::size_t>());
  if (json["proxies"].empty()) return out + "no proxy yet: lumi-proxy auto makes one";
  if (json["one"].get<bool>()) return out + OneProxy(json["proxies"][0]);
  out += fmt::format("{:<14} {:>8} {:>7} {:>9} {:>9} {:>7} {:>7} {:>8} {:>16}", "proxy", "faces", "closed", "manifold", "coverage", "front", "layers", "blocked", "off the points");
  for (const Json& p : json["proxies"])
    out += fmt::format("\n{:<14} {:>8} {:>7} {:>9} {:>8.1f}% {:>6.1f}% {:>7.2f} {:>7.2f}% {:>8.3f}% depth{}", p["name"].get<std::string>(), p["faces"].get<std::size_t>(),
                       Yes(p["closed"]), Yes(p["manifold"]), 100 * p["coverage"].get<double>(), 100 * p["front_fraction"].get<double>(), p["layers_mean"].get<double>(),
                       100 * p["blocked_ray_fraction"].get<double>(), 100 * p["point_distance_median"].get<double>(), p["active"].get<bool>() ? "  (active)" : "");
  return out;
}

}  // namespace lumi
