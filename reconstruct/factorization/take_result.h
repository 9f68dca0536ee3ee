// A model's cameras and points as the result has them: pixels instead of normalised coordinates, sights by their
// tracks' observations.
#pragma once

#include "reconstruct/factorization/reconstruct_from_tracks.h"

namespace lumi {

void TakeCameras(const ImagePoints& points, const ProjectiveModel& model, FactorizationResult& result);
void TakePoints(const ImagePoints& points, const ProjectiveModel& model, const Tracks& tracks,
                FactorizationResult& result);

}  // namespace lumi
