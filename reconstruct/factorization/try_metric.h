// The projective model in a Euclidean frame, by known intrinsics: by one plane at infinity, else by the windows' own; adjusted, and judged
// against the projective one.
#pragma once

#include <vector>

#include "reconstruct/factorization/factorization.h"

namespace lumi {

// result: sigma_px is read. True: it holds the metric reconstruction. False: upgrade_reason says why not.
bool TryMetric(const ImagePoints& points, const ProjectiveModel& projective, const std::vector<Window>& windows, const Tracks& tracks,
               const Camera& camera, const FactorizationOptions& options, FactorizationResult& result);

}  // namespace lumi
