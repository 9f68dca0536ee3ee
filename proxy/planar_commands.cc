#include <fmt/format.h>

#include "proxy/box/box_proxy.h"
#include "proxy/commands.h"
#include "proxy/make_proxy.h"
#include "proxy/planes/planes_json.h"
#include "proxy/planes/planes_proxy.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"

namespace lumi {
Made<BoxSummary> RunBox(const ProxyTarget& target, int sides, ProgressSink& progress) {
  BoxOptions options;
  options.sides = sides;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  return MakeAndKeep<BoxSummary>(
      target, "box", {{"sides", std::to_string(sides)}}, {}, progress, [&](const Scene& scene, BoxSummary& summary) {
        Mesh mesh = BuildBoxProxy(scene, options, &summary);
        for (std::size_t w = 0; w < 4; ++w)
          if (summary.wall_points[w] == 0) {
            static constexpr const char* kNames[] = {"left", "right", "upper", "lower"};
            progress.Message(
                fmt::format("warning: no points lie on the {} wall: it stands where the farthest ones end", kNames[w]));
          }
        return mesh;
      });
}

Made<PlanesFigures> RunPlanes(const ProxyTarget& target, const PlanesRequest& request, ProgressSink& progress) {
  const PlanesOptions& options = request.planes;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  std::map<std::string, std::string> record{{"max_planes", std::to_string(options.max_planes)},
                                            {"tolerance", fmt::format("{}", options.tolerance)},
                                            {"min_share", fmt::format("{}", options.min_share)},
                                            {"backdrop", options.backdrop ? "yes" : "no"},
                                            {"seed", std::to_string(options.seed)}};
  std::map<std::string, std::string> inputs;
  GivenPlanes given;
  if (!request.from.empty()) {
    given = ReadPlanesJson(request.from);
    inputs["planes"] = Fingerprint(request.from);
  }
  return MakeAndKeep<PlanesFigures>(
      target, "planes", std::move(record), std::move(inputs), progress,
      [&](const Scene& scene, PlanesFigures& figures) {
        Mesh mesh;
        PlanesSummary found;
        if (request.from.empty() || !given.planes.empty())
          mesh = BuildPlanesProxy(scene, options, given.planes, &found);
        Append(mesh, given.quads);
        figures = {{}, found.points, found.points_on_planes, found.backdrop_added, given.quads.faces.size() / 2};
        for (const FittedPlane& p : found.planes)
          figures.planes.push_back({p.normal, p.offset, p.points.size(), p.rms});
        return mesh;
      });
}

}  // namespace lumi
