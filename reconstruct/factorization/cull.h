// Which sights are believed: those whose reprojection error is within a multiple of the robust scale of all (thesis
// sec. 6.4.1 culls beyond 20 pixels; here the limit follows the noise). Asked of every sight, so that one that was
// thrown out early comes back when the cameras have become better.
#pragma once

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct CullOptions {
  double sigmas = 4.0;    // of the noise of one coordinate; 4: of Gaussian sights 3 in 10000 are lost
  double least_px = 1.0;  // the limit is never below
  double most_px = 20.0;  // nor above
  int min_sights = 3;     // a track with fewer inliers is dropped
};

struct CullResult {
  double sigma_px = 0;  // robust standard deviation of one coordinate
  double limit_px = 0;
  int sights = 0;  // inliers kept, of solved tracks
  int culled = 0;  // sights of solved tracks that are no inliers
  int tracks_dropped = 0;
};

CullResult Cull(const ImagePoints& points, ProjectiveModel& model, const CullOptions& options);

}  // namespace lumi
