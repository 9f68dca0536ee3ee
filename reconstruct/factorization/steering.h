// The adjustments of all frames: which tracks steer, how long ones are cut, and how the others follow.
#pragma once

#include <vector>

#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/reconstruct_from_tracks.h"

namespace lumi {

// For adjustments whose error is judged: they stop where a step gains less than this part of the cost. Intermediate
// ones stop earlier.
inline constexpr double kFineTolerance = 1e-6;

BundleOptions Adjustment(const FactorizationOptions& options, double sigma_px, int iterations);

// The model with as many tracks as give every frame about `sights` of its own, the longest first: they steer the
// cameras. 0: all.
ProjectiveModel Steering(const ImagePoints& points, const ProjectiveModel& model, int sights);

// Points of the tracks that did not steer follow the cameras.
void Follow(const ImagePoints& points, const ProjectiveModel& steering, ProjectiveModel& model,
            const CullOptions& cull);
// The same of tracks that the adjustment cut (BundleOptions::max_span).
void FollowWhereCut(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& bundle,
                    const CullOptions& cull);

// BundleOptions::max_span of a video: none where frames are few.
int MaxSpan(const ProjectiveModel& model, const FactorizationOptions& options);

// Steering tracks and all placed frames; the other points follow. held: frames that do not move; empty: none.
void AdjustAll(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& bundle, int sights,
               const CullOptions& cull, const std::vector<char>& held = {});

// All tracks of a video whose windows left frames out: the frames `keys` with whole tracks, then the others between
// them, by tracks that are cut: a camera then has to do with its neighbours and with the keys, which hold a long video
// together.
void AdjustByKeys(const ImagePoints& points, ProjectiveModel& model, const std::vector<char>& keys,
                  BundleOptions bundle, const CullOptions& cull);

}  // namespace lumi
