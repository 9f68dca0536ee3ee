// Which silhouettes agree with each other, and how far they have to be dilated for it.
//
// A pixel of a silhouette is covered by the hull if some point on its ray lies inside every other silhouette: it needs a
// dilation of min over the ray of max over the views of the signed distance. Where that is too much, the views that stand in the
// way at the point where they are fewest are to blame; where they are many, the pixel's own view is: its camera is off or its
// silhouette too large. The view with most blame is left out, until the others agree.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "proxy/hull/silhouette_cone.h"
#include "scene/program/progress.h"

namespace lumi {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
};

struct AgreementOptions {
  double max_dilation_px = 2;        // silhouettes that need more do not agree
  double max_uncovered = 0.005;      // of a silhouette's pixels
  double max_uncovered_depth_px = 2; // from the silhouette's border
  int rays_per_view = 1000;
};

struct Disagreement {
  std::size_t view;     // position among the views
  double blame = 0;     // silhouettes' worth of pixels that it cuts off from others, or that nobody covers of its own
  double uncovered = 0; // share of its own silhouette that needs more dilation than allowed
};

struct Agreement {
  std::vector<std::size_t> used;            // positions among the views, ascending
  std::vector<Disagreement> left_out;       // in the order in which they were found
  double dilation_px = 0;                   // that makes the used ones agree
  double uncovered = 0;                     // share of the used silhouette that agrees least: small unless only two are left
};

// masks: the silhouettes of `cones`. box: where the object is, in the cones' frame. At least two views are used, even where
// those do not agree.
Agreement FindAgreement(const std::vector<SilhouetteView>& views, const std::vector<SilhouetteCone>& cones, const Box& box,
                        const Eigen::Vector3d& origin, double unit, const AgreementOptions& options, ProgressSink& progress);

}  // namespace lumi
