#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "proxy/box/box_proxy.h"
#include "proxy/commands.h"
#include "proxy/make_proxy.h"
#include "proxy/planes/planes_json.h"
#include "proxy/planes/planes_proxy.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

Json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json Described(const PlanesSummary& summary) {
  Json planes = Json::array();
  for (const FittedPlane& p : summary.planes)
    planes.push_back({{"normal", Vector(p.normal)}, {"offset", p.offset}, {"points", p.points.size()}, {"rms", p.rms}});
  return planes;
}

}  // namespace

std::string RunBox(const ProxyTarget& target, int sides, ProgressSink& progress) {
  BoxOptions options;
  options.sides = sides;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  return MakeProxy(target, "box", {{"sides", std::to_string(sides)}}, {}, progress, [&](const Scene& scene, Json& json) {
    BoxSummary summary;
    Mesh mesh = BuildBoxProxy(scene, options, &summary);
    json["points_used"] = summary.points_on_walls;
    json["points_total"] = summary.points;
    json["size"] = Vector(summary.high - summary.low);
    json["wall_points"] = summary.wall_points;
    json["wall_rms"] = summary.wall_rms;
    for (std::size_t w = 0; w < 4; ++w)
      if (summary.wall_points[w] == 0) {
        static constexpr const char* kNames[] = {"left", "right", "upper", "lower"};
        progress.Message(fmt::format("warning: no points lie on the {} wall: it stands where the farthest ones end", kNames[w]));
      }
    return mesh;
  });
}

std::string RunPlanes(const ProxyTarget& target, const PlanesRequest& request, ProgressSink& progress) {
  PlanesOptions options;
  options.max_planes = request.max_planes;
  options.tolerance = request.tolerance;
  options.min_share = request.min_share;
  options.backdrop = request.backdrop;
  options.seed = request.seed;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  std::map<std::string, std::string> record{{"max_planes", std::to_string(options.max_planes)}, {"tolerance", fmt::format("{}", options.tolerance)},
                                            {"min_share", fmt::format("{}", options.min_share)}, {"backdrop", options.backdrop ? "yes" : "no"},
                                            {"seed", std::to_string(options.seed)}};
  std::map<std::string, std::string> inputs;
  GivenPlanes given;
  if (!request.from.empty()) {
    given = ReadPlanesJson(request.from);
    inputs["planes"] = Fingerprint(request.from);
  }
  return MakeProxy(target, "planes", std::move(record), std::move(inputs), progress, [&](const Scene& scene, Json& json) {
    Mesh mesh;
    PlanesSummary summary;
    if (request.from.empty() || !given.planes.empty()) mesh = BuildPlanesProxy(scene, options, given.planes, &summary);
    Append(mesh, given.quads);
    json["planes"] = Described(summary);
    json["points_used"] = summary.points_on_planes;
    json["points_total"] = summary.points;
    json["backdrop_added"] = summary.backdrop_added;
    json["quads"] = given.quads.faces.size() / 2;
    return mesh;
  });
}

}  // namespace lumi
