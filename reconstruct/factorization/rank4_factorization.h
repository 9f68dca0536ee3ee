// Projective factorisation with iterated depths (Sturm & Triggs 1996; Triggs 1996; thesis sec. 2.5): the measurement
// matrix of depth times image point has rank 4 when the depths are right, and then is cameras times points.
//
// Depths of a column that is complete are re-estimated as Mahamud and Hebert do (2000): those of the column nearest to
// the subspace, an eigenvector of a 4x4 matrix. Left alone such iterations lower the error by drifting to solutions in
// which a few depths take all the weight (Oliensis & Hartley 2007), so rows and columns are balanced after each step,
// and the iterate with the least reprojection error is what is returned: never worse than the start. Entries that are
// missing are filled from the current rank-4 model.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lumi {

struct MeasurementMatrix {
  Eigen::MatrixXd x;  // shape (2 frames, points), normalised; unseen: anything finite
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> seen;  // shape (frames, points)
};

struct FactoriseOptions {
  int max_iterations = 30;
  double tolerance = 1e-3;  // stops where the reprojection error falls by less than this part in a step
};

struct Factorisation {
  Eigen::MatrixXd P;                    // shape (3 frames, 4), orthonormal columns
  Eigen::MatrixXd X;                    // shape (4, points)
  Eigen::MatrixXd depths;               // shape (frames, points): (P X)'s third rows
  std::vector<double> singular_values;  // of the balanced matrix, the first eight, the largest first
  double gap = 0;                       // 4th over 5th singular value: large is good; infinity: rank 4 to rounding
  double rank3_gap = 0;                 // 3rd over 4th: large where the structure is planar or all centres coincide
  double start_rms = 0, rms = 0;        // reprojection error over seen entries, normalised units
  int iterations = 0;
  bool usable = false;  // false: too little is seen in common, or not finite
};

// start: cameras of a first reconstruction, shape (3 frames, 4), or empty (0 x 0): depths start at 1 and need 8
// complete columns. At least 2 frames and 8 points.
Factorisation Factorise(const MeasurementMatrix& m, const Eigen::MatrixXd& start, const FactoriseOptions& options);

}  // namespace lumi
