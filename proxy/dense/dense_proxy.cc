#include "proxy/dense/dense_proxy.h"

#include <fmt/format.h>

#include <iterator>

#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {

// A closed surface around a scene and everything in it needs at least this many faces to resemble it.
constexpr int kFewestFaces = 1000;

std::string Validate(const DenseOptions& o) {
  if (o.fusion.agree < 1 || o.fusion.agree > 15) return "--agree must be 1 to 15";
  if (!(o.merge_px > 0)) return "--merge-px must be above 0";
  if (o.faces != 0 && o.faces < kFewestFaces) return fmt::format("--faces must be 0 or at least {}", kFewestFaces);
  return Validate(o.stereo);
}

std::map<std::string, std::string> OptionValues(const DenseOptions& o) {
  std::map<std::string, std::string> values = OptionValues(o.stereo);
  values["agree"] = std::to_string(o.fusion.agree);
  values["faces"] = std::to_string(o.faces);
  values["small_parts"] = "may go";  // a mesh that does not say so may be a wrap of the scene, without its small things
  values["merge_px"] = fmt::format("{}", o.merge_px);
  values.merge(OptionValues(DelaunayOptions{}));  // of the cut, as BuildDenseProxy has it; merge_px is ours
  return values;
}

double EstimateMeshSeconds(const Scene& scene, int width) {
  constexpr double kSecondsAPixel = 7e-6;  // of one core; about linear, from 0.3 to 7 million pixels
  return kSecondsAPixel * StereoPixels(scene, width) / ThreadCount();
}

Mesh BuildDenseProxy(const Scene& scene, const FusionInput& input, const DenseOptions& options, ProgressSink& progress,
                     DenseSummary& summary) {
  Stopwatch watch;
  std::vector<ProxyPoint> points;
  {
    Progress steps(progress, "fusing depth maps", static_cast<long>(input.partners.size()));
    points = FuseDepths(input, options.fusion, [&] { steps.Step(); });
  }
  summary.fused_points = points.size();
  if (points.empty())
    throw DataError("the photos' depth maps agree nowhere",
                    "use lumi-proxy delaunay, or photographs that overlap more and show some texture");
  DelaunayOptions mesh;
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  // Sparse points reach where stereo finds nothing: walls without texture between two corners, what is far away.
  summary.mesh.selection = SelectPoints(scene, views, mesh.points);
  std::ranges::move(summary.mesh.selection.points, std::back_inserter(points));
  points = MergePoints(points, options.merge_px);
  summary.fusion_s = watch.Lap();
  if (points.size() < 4) throw DataError("the photos' depth maps agree hardly anywhere", "use lumi-proxy delaunay");
  return MeshThroughPoints(scene, views, std::move(points), mesh, progress, &summary.mesh);
}

}  // namespace lumi
