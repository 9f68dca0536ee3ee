// How sharp each photo is, place by place, against the other photos that see the same scene points: the fine detail
// that motion blur or defocus has left. From the photos around the points, by the robust model of the exposures: log
// (fine over coarse detail) = a_point + b_photo.
#pragma once

#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/photo_grid.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct Sharpness {
  // One a view, all of one size. Values in (0, 1]: the photo's energy of fine detail over that of the sharpest photos
  // of the same points. 1 where the difference may be chance or nothing is known: photos that are not loaded, have no
  // texture, or share no points with others.
  std::vector<PhotoGrid> grid;
  std::vector<double> of_photo;  // the same for each photo as a whole
  double share = 0;              // of the photos: those that are clearly unsharp
  double typical = 1;            // the median value of those
  bool Differ() const { return share > 0; }
};

Sharpness EstimateSharpness(const Scene& scene, const std::vector<Photo>& photos);
// The same for photos that are not in memory: each is read once, at most one per thread at a time.
Sharpness EstimateSharpness(const Scene& scene, ProgressSink& progress);

}  // namespace lumi
