// Hartley's normalisation (1997): each frame's image points are moved to their centroid and scaled to a root mean
// square distance of sqrt(2), so that the entries of the measurement matrix are of one size.
#pragma once

#include <optional>

#include "reconstruct/factorization/projective_model.h"
#include "scene/model/camera.h"
#include "scene/tracks/tracks.h"

namespace lumi {

// `camera` (one for all frames): its distortion is taken out first; sights without an inverse there are left out.
// Sights that are not finite, and a track's second sight in a frame, are left out. A frame without two different points
// gets px_per_unit = 1.
ImagePoints Normalise(const Tracks& tracks, const std::optional<Camera>& camera);

// normalised from pixels, as a 3x3 matrix: frame f's T.
Eigen::Matrix3d NormalisedFromPixels(const ImagePoints& points, std::size_t f);

}  // namespace lumi
