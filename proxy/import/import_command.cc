#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "proxy/commands.h"
#include "proxy/hull/soundness.h"
#include "proxy/import/icp.h"
#include "proxy/import/mesh_repair.h"
#include "proxy/import/placement.h"
#include "proxy/make_proxy.h"
#include "proxy/mesh_query.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kPairsAgree = 0.05;              // of the extent: an rms above is warned about
constexpr double kFewFit = 0.7;                   // of the points: less is warned about
constexpr std::size_t kImportBytesPerFace = 600;  // at most at once, as measured on a million faces
constexpr double kMostLost = 0.5;                 // of the faces

void RequireConsistent(const ImportRequest& r) {
  if (!(r.scale > 0) || !std::isfinite(r.scale)) throw UsageError("--scale must be a positive number");
  if (!r.unit.empty()) MetresIn(r.unit);
  if (!r.axes.empty()) AxesFromText(r.axes, Eigen::Vector3d::UnitZ());
  if (!r.correspond.empty() && (r.scale != 1 || !r.unit.empty() || !r.axes.empty()))
    throw UsageError("--correspond says where the mesh belongs: --scale, --unit and --axes do not go with it");
}

void Apply(const Similarity3& s, Mesh& mesh) {
  for (Eigen::Vector3d& v : mesh.vertices) v = s * v;
}

// Fronts less backs that the views' rays meet of each part.
std::vector<long> VotesOf(const RepairedMesh& repaired, const std::vector<ProxyView>& views) {
  const MeshQuery query(repaired.mesh);
  const MeshFitOptions grid;
  std::vector<long> votes(static_cast<std::size_t>(repaired.parts), 0);
  for (const ProxyView& view : views)
    for (int i = 0; i < grid.grid_x * grid.grid_y; ++i) {
      const Eigen::Vector2d at(i % grid.grid_x / (grid.grid_x - 1.0), i / grid.grid_x / (grid.grid_y - 1.0));
      const auto direction = RayDirection(view.render.P, at.cwiseProduct(view.render.size_px.cast<double>()));
      const auto hit = direction ? query.FirstHit(view.render.centre, *direction) : std::nullopt;
      if (hit)
        votes[static_cast<std::size_t>(repaired.part[static_cast<std::size_t>(hit->face)])] += hit->front ? 1 : -1;
    }
  return votes;
}

// Scene from mesh by pairs of points.
Similarity3 ByPairs(const std::filesystem::path& file, ImportFigures& figures, ProgressSink& progress) {
  const std::vector<PointPair> pairs = ReadPointPairs(file);
  const PairAlignment a = AlignPairs(pairs);
  figures.pairs = PairsFigures{pairs.size(), a.rms, a.rms_of_extent, a.distance};
  if (a.rms_of_extent > kPairsAgree) {
    const auto worst = std::ranges::max_element(a.distance);
    progress.Message(
        fmt::format("warning: the pairs of {} disagree by {:.1f} % of their extent; pair {} is off most, by {:.4g}",
                    file.string(), 100 * a.rms_of_extent, worst - a.distance.begin() + 1, *worst));
  }
  return a.scene_from_mesh;
}

IcpResult ByIcp(const Mesh& mesh, const Scene& scene, const Similarity3& guess) {
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  std::vector<Eigen::Vector3d> points;
  for (const ProxyPoint& p : SelectPoints(scene, views, {}).points) points.push_back(p.x_in_world);
  const IcpResult r = AlignByIcp(mesh, points, guess);
  if (!r.converged)
    throw DataError("the mesh could not be aligned with the scene's points: " + r.why_not,
                    "start nearer to where it belongs: --axes for its turn, --unit or --scale for its size, or name "
                    "three points of it and of the scene with --correspond");
  return r;
}

}  // namespace

Made<ImportFigures> RunImport(const ImportRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  RequireConsistent(request);
  std::map<std::string, std::string> options{{"scale", fmt::format("{}", request.scale)},
                                             {"unit", request.unit},
                                             {"axes", request.axes},
                                             {"align", request.icp ? "icp" : "none"},
                                             {"repair", request.repair ? "yes" : "no"}};
  std::map<std::string, std::string> inputs{{"mesh", Fingerprint(request.file)}};
  if (!request.correspond.empty()) inputs["pairs"] = Fingerprint(request.correspond);
  return MakeAndKeep<ImportFigures>(
      target, "import", std::move(options), std::move(inputs), progress, [&](const Scene& scene, ImportFigures& f) {
        const std::string name = request.file.string();
        Mesh given = ReadMeshWithFlaws(request.file, kImportBytesPerFace);
        RepairedMesh repaired = RepairMesh(given);
        if (repaired.mesh.faces.empty())
          throw InputError(request.file, "has no face that could be drawn: " + repaired.flaws.Describe());
        if (static_cast<double>(repaired.faces_lost) > kMostLost * static_cast<double>(given.faces.size()))
          throw InputError(request.file,
                           fmt::format("{} of its {} faces have vertices that are no numbers", repaired.faces_lost,
                                       given.faces.size()),
                           "save the mesh again");

        Similarity3 scene_from_mesh;
        if (!request.correspond.empty()) {
          scene_from_mesh = ByPairs(request.correspond, f, progress);
        } else {
          scene_from_mesh.scale = request.scale;
          if (!request.unit.empty())
            scene_from_mesh.scale *= MetresIn(request.unit) / scene.metres_per_unit.value_or(1);
          if (!request.axes.empty()) {
            const Eigen::Matrix3d axes = AxesFromText(request.axes, scene.up);
            for (Eigen::Vector3d& v : repaired.mesh.vertices) v = axes * v;
            if (axes.determinant() < 0)
              for (auto& face : repaired.mesh.faces) std::swap(face[1], face[2]);  // a mirror turns what is outside in
          }
        }
        if (request.icp) {
          f.icp = ByIcp(repaired.mesh, scene, scene_from_mesh);
          scene_from_mesh = f.icp->scene_from_mesh;
          if (f.icp->overlap < kFewFit)
            progress.Message(
                fmt::format("warning: {:.0f} % of the points near {} fit it; is it where it belongs? lumi-proxy "
                            "info says how far the points are off",
                            100 * f.icp->overlap, name));
        }
        Apply(scene_from_mesh, repaired.mesh);
        if (const auto wrong = Validate(repaired.mesh))
          throw InputError(request.file, *wrong + " in the scene's frame");

        const std::vector<ProxyView> views = MakeProxyViews(scene);
        OrientParts(repaired, VotesOf(repaired, views));
        if (!repaired.flaws.none()) {
          if (!request.repair)
            throw InputError(request.file, "is not sound: " + repaired.flaws.Describe(),
                             "without --no-repair that is mended");
          progress.Message("repaired " + name + ": " + repaired.flaws.Describe());
        }
        Soundness sound = CheckSoundness(repaired.mesh);
        if (sound.manifold &&
            sound.degenerate_faces > 0) {  // moved, faces that were thin have lost their area to rounding
          const RepairedMesh again = RepairMesh(repaired.mesh);
          repaired.mesh = again.mesh;
          repaired.flaws.zero_area_faces += again.flaws.zero_area_faces;
          sound = CheckSoundness(repaired.mesh);
        }
        if (!sound.manifold || sound.degenerate_faces > 0)
          throw DataError(name + " could not be repaired: " + sound.Describe(), "repair it where it was made");

        const MeshFit fit = MeasureFit(repaired.mesh, views, {});
        f.placement = scene_from_mesh;
        f.repaired = repaired.flaws;
        f.parts = repaired.parts;
        f.soundness = DescribeSurface(sound);
        f.coverage = fit.coverage;
        f.front_fraction = fit.front_fraction;
        if (fit.coverage == 0)
          progress.Message(
              "warning: no view sees " + name +
              "; is it in the scene's own units and frame (--unit, --scale, --axes, --correspond, --align icp)?");
        return repaired.mesh;
      });
}

}  // namespace lumi
