// Which of the scenes without projective structure this is, from the homographies that explain its pairs of frames.
#pragma once

#include <optional>
#include <vector>

#include "reconstruct/factorization/factorization.h"
#include "reconstruct/factorization/seed.h"

namespace lumi {

// Frame numbers of the homographies are those of `points`. With the camera a rotation is a homography that is orthogonal
// in rays; without, one with a rotation's eigenvalues (all of modulus 1), which holds for one camera for all frames.
FactorizationRefusal Classify(const ImagePoints& points, const std::vector<PairHomography>& homographies, const std::optional<Camera>& camera);

}  // namespace lumi
