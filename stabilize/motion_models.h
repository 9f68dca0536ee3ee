// Motions that a camera is meant to have had, as families of projection matrices (thesis sec. 6.4.2; errata: its law a
// log|t - t0| + b is not that of a constant velocity). In any projective frame, s from -1 at the first frame to 1 at
// the last:
//
// - linear: P(s) = P0 + s e pi^T. Constant velocity, orientation and lens: x(s) ~ x0 + kappa s e, kappa = pi . X
// - vertigo: P(s) = Z(1 + tau s) (P0 + s e pi^T). The same, with a zoom Z about the focus of expansion e that keeps an
//   object's size
// - circular: P(s) = P0 exp(omega s B), B^3 = -B. Constant angular velocity about an axis: points run through conics
//
// e, the focus of expansion, is a homogeneous image point: inside the picture, outside or at infinity are one case. pi
// is refined with the path: the plane at infinity that a scene comes with is only cheirality's.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

#include "stabilize/filmed_scene.h"

namespace lumi {

enum class MotionModel { kSmooth, kLinear, kVertigo, kCircular };
std::string_view Name(MotionModel model);

struct ModelFitOptions {
  int sights_per_frame = 60;         // that vote
  int rounds = 3;                    // of reweighting: Huber's, at three times the median residual
  int max_iterations = 60;           // of each round
  std::vector<std::int32_t> object;  // vertigo: the points whose images stay where they are
};

struct ModelFit {
  std::vector<Matrix34d> P;                           // one a frame, norm 1, w > 0 in front
  std::optional<Eigen::Vector3d> focus_of_expansion;  // homogeneous, units; linear and vertigo
  double turn_rad = 0;                                // circular: from the first frame to the last
  double rms =
      0;  // of the points' images in the film against those in the fit, units: the shake, and what the model leaves out
  int iterations = 0;
};

// Fitted to the images of the points in all frames that see them at once, as the scene's own matrices put them (Ceres).
// Throws DataError, named, where the motion is none of the model: vertigo without movement towards anything; circular
// without a movement, or along a line, or around an arc that departs from a line by less than the shake can tell (an F
// test); fewer than three frames; no point. Cameras at one centre (FilmedScene::one_centre): linear is the family of a
// plane's homographies, G + s e n^T; vertigo and circular are refused.
ModelFit FitModel(const FilmedScene& film, MotionModel model, const ModelFitOptions& options);

}  // namespace lumi
