// S w = y for one ray in double, by Cholesky: what the lanes hand over (near-duplicate photos, leaves of nearly one
// size), and the path of full accuracy. Near-singular S gets more on its diagonal, indefinite S has its eigenvalues
// clipped.
#pragma once

#include <Eigen/Core>

#include "render/radiance/correlation.h"

namespace lumi {

// On the diagonal of S: keeps Cholesky going over exact duplicates, and the sum of their weights to 1e-9.
constexpr double kNugget = 1e-9;
// The most that is tried before S counts as indefinite.
constexpr double kLargestNugget = 1e-6;
// Eigenvalues of an indefinite S are raised to this.
constexpr double kSmallestEigenvalue = 1e-6;

// One ray's photos, `Eigen::Index` n of them.
struct DenseSystem {
  Eigen::Matrix<double, 3, Eigen::Dynamic> u;  // unit directions from the proxy point to the photos
  Eigen::VectorXd f;                           // S_ij = f_i f_j R(h_ij) off the diagonal
  Eigen::VectorXd y;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>
      channel;  // n x channels; h_ij / (2 r_max) grows by each |difference|
};

struct DenseResult {
  Eigen::VectorXd w, z;     // S w = y, S z = f
  double nugget = kNugget;  // that S took
  bool clipped = false;     // eigenvalues were
};

// alpha: h_ij = alpha theta_ij + 2 r_max sum |channel_i - channel_j|.
Eigen::MatrixXd SimilarityMatrix(const FallingLeaves& leaves, double alpha, const DenseSystem& system);
// S symmetric; its upper triangle is not read. One factorisation for both right-hand sides.
DenseResult SolveDense(const Eigen::MatrixXd& S, const Eigen::VectorXd& y, const Eigen::VectorXd& f, bool also_z);

}  // namespace lumi
