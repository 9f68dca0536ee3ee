// The projective model in a Euclidean frame, by known intrinsics: by one plane at infinity, else by the windows' own;
// adjusted, and judged against the projective one.
#pragma once

#include <vector>

#include "reconstruct/factorization/reconstruct_from_tracks.h"

namespace lumi {

struct FactorizationTask {
  const ImagePoints& points;
  const Tracks& tracks;
  const FactorizationOptions& options;
};

// result: sigma_px is read. True: it holds the metric reconstruction. False: upgrade_reason says why not.
bool TryMetric(const FactorizationTask& task, const ProjectiveModel& projective,
               const std::vector<FrameWindow>& windows, const Camera& camera, FactorizationResult& result);

}  // namespace lumi
