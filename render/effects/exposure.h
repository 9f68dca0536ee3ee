// The photos' exposures relative to one another, from the colours that photos of one scene point have: log c = a_point
// + log gain_photo, by robust least squares. A factor on code values: near enough to a camera's own curve for drifts of
// less than a stop.
#pragma once

#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct Exposures {
  std::vector<double> gain;  // one a view, geometric mean 1; 1 where nothing is known
  double spread = 1;         // largest over smallest of the views that are known well
  double noise = 1;          // what that ratio would be by chance alone (99 %)
  bool Differ() const { return spread > 1.04 && spread > noise; }  // 4 %: ten code values in full white
};

Exposures EstimateExposures(const Scene& scene, const std::vector<Photo>& photos);
// The same for photos that are not in memory: each is read once, and no more at a time than there are threads.
Exposures EstimateExposures(const Scene& scene, ProgressSink& progress);

}  // namespace lumi
