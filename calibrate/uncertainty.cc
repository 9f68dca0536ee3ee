#include "calibrate/uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

using TermJacobian = Eigen::Matrix<double, 2, kTermCount>;
using TurnJacobian = Eigen::Matrix<double, 2, 3>;

// Central differences: the projection is a polynomial, the steps are far from both its curvature and rounding.
TermJacobian ByTerms(const Intrinsics& k, const Eigen::Vector2d& x) {
  TermJacobian J;
  for (int term = 0; term < kTermCount; ++term) {
    const double step = 1e-5 * std::max(1.0, std::abs(k[term]));
    Intrinsics high = k, low = k;
    high[term] += step;
    low[term] -= step;
    J.col(term) = (ProjectNormalized(high, x) - ProjectNormalized(low, x)) / (2 * step);
  }
  return J;
}

TurnJacobian ByTurn(const Intrinsics& k, const Eigen::Vector2d& x) {
  TurnJacobian J;
  constexpr double kStepRad = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d w = kStepRad * Eigen::Vector3d::Unit(axis), d = x.homogeneous();
    J.col(axis) =
        (ProjectNormalized(k, (d + w.cross(d)).hnormalized()) - ProjectNormalized(k, (d - w.cross(d)).hnormalized())) /
        (2 * kStepRad);
  }
  return J;
}

}  // namespace

UncertaintyMap ProjectionUncertainty(const Calibration& calibration, int width_px, int height_px, int columns,
                                     int rows) {
  UncertaintyMap map{columns, rows, {}, 0, 0};
  struct Node {
    bool valid = false;
    TermJacobian by_terms;
    TurnJacobian by_turn;
  };
  std::vector<Node> nodes;
  Eigen::Matrix3d RR = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, kTermCount> RJ = Eigen::Matrix<double, 3, kTermCount>::Zero();
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      Node node;
      const Eigen::Vector2d pixel(static_cast<double>(width_px) * c / (columns - 1),
                                  static_cast<double>(height_px) * r / (rows - 1));
      if (const auto x = Unproject(calibration.intrinsics, pixel)) {
        node = {true, ByTerms(calibration.intrinsics, *x), ByTurn(calibration.intrinsics, *x)};
        RR += node.by_turn.transpose() * node.by_turn;
        RJ += node.by_turn.transpose() * node.by_terms;
      }
      nodes.push_back(node);
    }
  const Eigen::Matrix<double, 3, kTermCount> turn =
      -SolveSymmetric(RR, RJ);  // the one that undoes most of a change of each term
  const TermMatrix covariance = calibration.noise_px * calibration.noise_px * calibration.unit_covariance;
  std::vector<double> finite;
  for (const Node& node : nodes) {
    double sigma = std::numeric_limits<double>::quiet_NaN();
    if (node.valid) {
      const TermJacobian J = node.by_terms + node.by_turn * turn;
      sigma = std::sqrt(std::max(0.0, (J * covariance * J.transpose()).trace()));
      finite.push_back(sigma);
    }
    map.sigma_px.push_back(sigma);
  }
  if (!finite.empty()) {
    map.largest_px = *std::ranges::max_element(finite);
    map.median_px = Median(std::move(finite));
  }
  return map;
}

}  // namespace lumi
