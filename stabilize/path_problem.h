// Matrices P' whose images of the points come close to where they are wanted and move smoothly: the one least-squares
// problem that all models end in (thesis sec. 6.4.2, whose resection frame by frame it is where nothing asks for
// smoothness).
//
//   sum_t  weight_t  mean_j |P'_t X_j - y_tj|^2   +   smoothness sum_t mean_j |D2(P' X_j)_t - bend_tj|^2
//   + sum_t  parallax_t  mean_j |P'_t X_j - P'_t Z_j|^2   +   sum_t  alike_t  min_S  mean_j |P'_t X_j - S filmed_tj|^2
//
// Z: other points on the rays of a camera whose centre P' is to stay near. S: a similarity of the filmed picture.
// D2: second difference in time, of images in units (FilmedScene). What a low-pass of each trajectory would be, if all
// trajectories had to agree on one camera. Where frames are missing it is the divided one, so that a constant velocity
// has none.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "stabilize/filmed_scene.h"

namespace lumi {

struct WantedPoint {
  Eigen::Vector4d X = Eigen::Vector4d::Zero();
  Eigen::Vector2d y = Eigen::Vector2d::Zero();       // units
  double share = 1;                                  // of the frame's weight, before it is normalised
  Eigen::Vector4d Z = Eigen::Vector4d::Zero();       // zero: none
  Eigen::Vector2d filmed = Eigen::Vector2d::Zero();  // units; for WantedFrame::alike
};

struct WantedFrame {
  std::vector<WantedPoint> points;
  double weight = 1;    // of these targets
  double parallax = 0;  // of X and Z, one behind the other
  double alike = 0;     // of what sets the picture apart from any similarity of the filmed one
  // D2 (SecondDifference) that the model itself has, one a point, of points that lie in front in the frame before and
  // after too; empty: none.
  std::vector<Eigen::Vector2d> bend;
  bool held = false;  // P stays what it is
};

struct PathProblemOptions {
  double smoothness = 1;      // of second differences, against a weight of 1; 0: frame by frame
  std::vector<double> times;  // of the frames, in frames, ascending; empty: 0, 1, 2 ...
  int max_iterations = 20;
  double tolerance = 1e-7;  // relative decrease of the cost
};

struct PathProblemSummary {
  int iterations = 0;
  double start_cost = 0, cost = 0;
  bool usable = false, converged = false;
};

// a, b, c of D2 x_t = a x_(t-1) + b x_t + c x_(t+1), times the root of the time that it stands for: 1, -2, 1 at even
// steps of one. 0 < t < times.size() - 1.
std::array<double, 3> SecondDifference(const std::vector<double>& times, std::size_t t);

// The time that a frame stands for, in frames: half of what is between its neighbours, at an end the step from it; 1
// at even steps of one. A frame weighed by it counts for the time that it shows, so that a cutoff is the same wherever
// frames lie closer together.
double TimeStoodFor(const std::vector<double>& times, std::size_t t);

// P: one a frame, started from and replaced; unchanged where the result is not usable. Ceres, sparse normal equations
// of blocks of 12; deterministic. Throws std::invalid_argument where the numbers of frames differ or times do not
// ascend.
PathProblemSummary SolvePathProblem(const std::vector<WantedFrame>& wanted, const PathProblemOptions& options,
                                    std::vector<Matrix34d>& P);

// Smoothness for which a weight of 1 lets half the amplitude at cutoff_hz pass: 1 / (2 - 2 cos w)^2, w the frequency in
// radians a frame.
double SmoothnessOf(double cutoff_hz, double fps);

}  // namespace lumi
