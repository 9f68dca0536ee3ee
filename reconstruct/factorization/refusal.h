// Which of the scenes without projective structure this is, from the homographies that explain its pairs of frames.
#pragma once

#include <optional>
#include <vector>

#include "reconstruct/factorization/reconstruct_from_tracks.h"
#include "reconstruct/factorization/seed.h"

namespace lumi {

// Frame numbers of the homographies are those of `points`. A rotation is a homography that is orthogonal in rays;
// without the camera, under some focal length that all pairs agree on, the principal point in the middle of the points.
FactorizationRefusal Classify(const ImagePoints& points, const std::vector<PairHomography>& homographies,
                              const std::optional<Camera>& camera);

// Throws FactorizationRefused, by what Classify says.
[[noreturn]] void Refuse(const ImagePoints& points, const std::vector<PairHomography>& homographies,
                         const std::optional<Camera>& camera);

}  // namespace lumi
