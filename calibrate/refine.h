// The refinement of a calibration: reprojection errors of all corners, least squares or robust (Cauchy), over the free
// intrinsics and the pose of each view (Ceres), and the covariance of the intrinsics that follows from it.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/intrinsics.h"
#include "scene/geometry/rigid3.h"

namespace lumi {

struct CalibrationStart {
  Intrinsics intrinsics;
  std::vector<Rigid3> cam_from_board;  // one a view
};

struct RefineOptions {
  LensModel model = FullestModel();
  double robust_scale_px = 0;  // Cauchy's scale, >= 0; 0: least squares
  int max_iterations = 200;    // >= 1
};

// A figure for each of the terms that are lengths in the picture.
struct PixelTerms {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

struct Calibration {
  LensModel model;
  Intrinsics intrinsics = Intrinsics::Zero();
  std::vector<Rigid3> cam_from_board;  // one a view, lengths in mm
  std::vector<double> view_rms_px;     // over the corners used; RMS of the distance, as OpenCV has it
  double rms_px = 0;
  double noise_px = 0;  // standard deviation of a coordinate of a corner, degrees of freedom taken off
  // Of the intrinsics for noise of 1 px, poses marginalised; zero for held terms.
  TermMatrix unit_covariance = TermMatrix::Zero();
  bool usable = false;  // converged and all free terms determined
  std::string why;      // where not usable
  double seconds = 0;

  double Fy() const { return intrinsics[kFx] * intrinsics[kAspect]; }
  // Standard deviations for a corner noise of `noise`; 0 for held terms. The second one of fy = fx * aspect.
  double Sigma(Term term, double noise) const { return noise * std::sqrt(unit_covariance(term, term)); }
  double SigmaFy(double noise) const;
  PixelTerms Pixels() const { return {intrinsics[kFx], Fy(), intrinsics[kCx], intrinsics[kCy]}; }
  PixelTerms PixelSigmas(double noise) const {
    return {Sigma(kFx, noise), SigmaFy(noise), Sigma(kCx, noise), Sigma(kCy, noise)};
  }
};

// Distance of each corner from where the calibration puts it, in pixels; behind the camera: infinity.
std::vector<double> CornerErrors(const Board& board, const BoardView& view, const Intrinsics& intrinsics,
                                 const Rigid3& cam_from_board);

// Free terms start at `start`'s values, held ones stay there. A fit that does not converge comes back with usable =
// false.
Calibration Refine(const Board& board, const std::vector<BoardView>& views, const RefineOptions& options,
                   const CalibrationStart& start);

// The pose alone, intrinsics held. robust_scale_px as above.
Rigid3 RefinePose(const Board& board, const BoardView& view, const Intrinsics& intrinsics, const Rigid3& start,
                  double robust_scale_px = 0);

}  // namespace lumi
