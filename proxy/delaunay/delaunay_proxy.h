// A mesh through the sparse points that agrees with what the cameras saw: Delaunay tetrahedra, labelled free or full by
// a minimum cut over the lines of sight (Labatut, Pons & Keriven 2007, "Efficient multi-view reconstruction of
// large-scale scenes using interest points, Delaunay triangulation and graph cuts"; soft visibility after Labatut, Pons
// & Keriven 2009, "Robust and efficient surface reconstruction from range data"). The deviations:
// - A dome of backdrop points, cut off at the floor, stands around the scene, and everything outside it is full: every
//   ray from a camera meets the mesh.
// - A helper point stands a little behind each point. Without it the tetrahedra behind a foreground object reach to the
//   background, and lines of sight that pass close behind the object cannot be kept open without losing the object.
// - Space that no photo shows counts as free, with the weight of a line of sight; and a line of sight makes the cell
//   behind its point full only where its photo shows that cell. Cells at the border of what was seen are long: a
//   full one would hide the scene from a viewer beside the photos.
// - No smoothing: each vertex is where bundle adjustment put it, and moving it costs PSNR on every capture measured.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"
#include "scene/program/progress.h"

namespace lumi {

struct DelaunayOptions {
  PointSelectionOptions points;
  double merge_px = 4;           // points nearer than this many pixels of the finest view become one
  double ray_weight = 1;         // what a line of sight is worth, and a cell that no photo shows
  double quality_weight = 0.2;   // what a facet costs whose circumspheres do not suggest a surface, in lines of sight
  double tolerance_sigma = 0.3;  // a line of sight's tolerance at its end, in the point's own standard deviations
  double backing = 0.5;          // a helper point so far behind each point, in mean distances to its neighbours
  double dome_factor = 1.3;      // the backdrop's radius: the farthest point's or camera's distance times this
  double floor_quantile = 0.02;  // the backdrop ends below at a floor that this share of the points lies under
  int dome_subdivisions = 3;     // of an icosahedron: 642 points
  double beyond_picture = 1;     // a photo shows what lies up to so many of its longer sides outside its border, >= 0
};
std::string Validate(const DelaunayOptions& options);  // empty, or what is wrong
// Names and values, for the record of how a mesh was made.
std::map<std::string, std::string> OptionValues(const DelaunayOptions& options);

struct DelaunaySummary {
  PointSelection selection;       // its points are moved out
  std::size_t vertices_used = 0;  // points after merging
  std::size_t tetrahedra = 0;
  std::size_t rays = 0;
  double blocked_ray_fraction = 0;  // lines of sight that the mesh blocks before their point (within 2 % of the depth)
  double select_s = 0, tetrahedra_s = 0, rays_s = 0, cut_s = 0, surface_s = 0;
};

// Front faces look at the free space. Closed. Throws DataError where there are too few points.
Mesh BuildDelaunayProxy(const Scene& scene, const DelaunayOptions& options, ProgressSink& progress,
                        DelaunaySummary* summary = nullptr);

// The same through points chosen elsewhere, of which no two coincide (MergePoints). views: as MakeProxyViews has them.
Mesh MeshThroughPoints(const Scene& scene, const std::vector<ProxyView>& views, std::vector<ProxyPoint> points,
                       const DelaunayOptions& options, ProgressSink& progress, DelaunaySummary* summary = nullptr);

}  // namespace lumi
