// The visual hull (Laurentini 1994; thesis sec. 5.3.4): what all silhouettes leave of space. Conservative: each
// silhouette that is used is covered by the hull's outline, after a dilation that is found and stated.
//
// Not by intersecting the cones' polyhedra: with inexact constructions that fails from the first nearly coplanar faces
// on, with exact ones it takes minutes for 36 views. The hull is where the largest of the views' signed silhouette
// distances is at most the dilation, contoured on a grid whose cubes are a pixel or so wide and are kept only at the
// surface. Views that coincide, cones that touch, holes and several parts are then nothing special.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "proxy/hull/coverage.h"
#include "proxy/hull/silhouette_cone.h"
#include "scene/geometry/mesh.h"
#include "scene/program/progress.h"

namespace lumi {

constexpr double kLeastDilation = 0.5;  // pixels: what a silhouette of whole pixels does not know of its border

// What a hull is to be where silhouettes disagree a little. Covering: each is dilated, mended and in the end left out,
// until the hull's outline covers every silhouette used. Tight: their plain intersection, none mended, at the dilation
// (a few are tried on a coarse grid) at which outlines and silhouettes have most in common (IoU, the median view's).
enum class HullPreference { kCover, kTight };

struct HullOptions {
  HullPreference prefer = HullPreference::kCover;
  double cell_px = 2;                 // edge of the grid's cubes in pixels of the view that sees the object finest, > 0
  std::optional<double> dilation_px;  // of every silhouette, >= 0; none: the least at which the silhouettes agree, or
                                      // (tight) the one of the largest IoU
  double max_dilation_px = 2;         // beyond, silhouettes do not agree and views are left out
  bool keep_all_views = false;        // leave none out
  // Of the views: where more would have to be left out the silhouettes are refused, before any fine hull is built.
  double max_left_out = 0.5;
  double max_minutes = 5;  // after these the hull is given up, between two steps; 0: no limit. Changes no hull
  double max_mended =
      0.05;  // of a silhouette's pixels that may be added where it alone, or nearly, carves what others show; 0: none
  double min_coverage = 0.995;  // of each silhouette that is used
  double max_uncovered_depth_px = 2;
  double min_cells = 48;              // across the object: smaller silhouettes get a finer grid
  std::size_t max_cubes = 3'000'000;  // at the surface: beyond, the grid gets coarser, which is said
  int rays_per_view = 1000;           // that the views' agreement is judged by,
  int max_rays = 40000;               // and of all views together, but 200 of each
};
std::string Validate(const HullOptions& options);  // empty, or what is wrong

struct HullSummary {
  struct LeftOut {
    std::string name, reason;
  };
  std::vector<std::string> used;
  std::vector<LeftOut> left_out;  // empty, full and inconsistent silhouettes
  struct MendedView {
    std::string name;
    double share;  // of its silhouette's pixels, added
  };
  std::vector<MendedView> mended;
  bool tight = false;                    // HullPreference::kTight
  int settlings = 0;                     // rounds of mending
  int coarse_hulls = 0, fine_hulls = 0;  // that were built to find this one
  double dilation_px = 0;
  double cell_px = 0, cell = 0;     // in pixels of the view that sees the object finest; in world units
  bool bounded = true;              // false: the views leave the object open to some side, where it was cut off
  std::vector<SilhouetteFit> fits;  // of the used silhouettes
  SilhouetteFitSummary fit;
  double volume = 0;  // cubic world units
  double agreement_s = 0, mend_s = 0, contour_s = 0, measure_s = 0;
};

// Closed, 2-manifold, no degenerate face, front faces outwards. near: a point in the object, for views that do not say
// where it is (all from one place); may be none. Throws DataError: fewer than two silhouettes that say something, views
// that do not say where the object is, silhouettes that agree nowhere or not in most views, no end within
// options.max_minutes; `summary` then has the hulls that were built.
Mesh BuildVisualHull(const std::vector<SilhouetteView>& views, const HullOptions& options, ProgressSink& progress,
                     HullSummary* summary = nullptr, const std::optional<Eigen::Vector3d>& near = {});

}  // namespace lumi
