// What a visual hull costs and gives: hulls of fewer views, of silhouettes at a fraction of their size and of coarser
// grids, each measured against all silhouettes, also those that it was not made from.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "proxy/hull/visual_hull.h"

namespace lumi {

struct HullTradeoffRow {
  std::string name = {};    // "8 views, silhouettes 1/2"; the hull as given: "as given"
  std::string line = {};    // what was turned: "views", "silhouettes", "cell", "several", "prefer"; "" as given
  std::size_t views = 0;    // offered
  int reduction = 1;        // of the silhouettes' width and height
  double cell_px = 0;       // of the reduced silhouettes
  std::string failed = {};  // why there is no hull; empty: there is one
  std::size_t used = 0, faces = 0;
  double dilation_px = 0;              // of the full silhouettes
  double iou_median = 0, iou_min = 0;  // over all silhouettes, whole size
  double coverage_min = 0;             // over all silhouettes: those that were not used may be covered less
  double volume = 0;                   // cubic world units
  double seconds = 0;
};

// Views in an order in which the first N look along directions as far from each other as can be, for every N. Opposite
// directions see the same outline and count as one.
std::vector<std::size_t> SpreadDirections(const std::vector<SilhouetteView>& views, const Eigen::Vector3d& object);

// Half as wide and high, etc.: a pixel of which any part is object is object.
SilhouetteView Reduced(const SilhouetteView& view, int reduction);

// 4, 8, 16 ... and all views, each with silhouettes of whole, half and quarter size; all views with cells 2 and 4 times
// as wide; and the other preference (tight where the options ask to cover). The hull as given is the first row. Throws
// as BuildVisualHull does for that one; later ones that fail are rows that say why.
std::vector<HullTradeoffRow> MeasureHullTradeoff(const std::vector<SilhouetteView>& views, const HullOptions& options,
                                                 ProgressSink& progress,
                                                 const std::optional<Eigen::Vector3d>& near = {});

}  // namespace lumi
