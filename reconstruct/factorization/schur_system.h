// The damped normal equations of a bundle adjustment over cameras of twelve numbers and points of three, and their
// solution by the Schur complement (Triggs et al. 2000, section 6.1): points are eliminated, what is left is a system
// of the cameras alone.
//
//   | U + d diag U   E              | |cameras|     |g of cameras|
//   | E^T            V + d diag V   | |points | = - |g of points |
//
// Each camera's row of the Schur complement is one thread's, and takes its points in their order: the same bytes for
// any number of threads. A camera whose partners are its neighbours, as in a video, has a row that begins late
// (tile_cholesky.h); cost grows with the square of a row's length.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "reconstruct/factorization/block_product.h"
#include "reconstruct/factorization/tile_cholesky.h"

namespace lumi {

class SchurSystem {
 public:
  static constexpr int kCameraNumbers = kBlockRows, kPointNumbers = 3;
  using CameraVector = Eigen::Matrix<double, kCameraNumbers, 1>;
  using CameraMatrix = Eigen::Matrix<double, kCameraNumbers, kCameraNumbers>;
  using LinkMatrix = Eigen::Matrix<double, kCameraNumbers, kPointNumbers>;

  // A camera sees a point. camera < 0: one that does not move.
  struct Link {
    int camera = -1, point = 0;
  };
  // Links of a point stand together, points ascending from 0, a point's cameras ascending and each but once.
  SchurSystem(int cameras, int points, std::vector<Link> links);

  // The equations, for the caller to fill in (any of them by any thread).
  std::vector<CameraMatrix> U;
  std::vector<CameraVector> camera_gradient;
  std::vector<Eigen::Matrix3d> V;
  std::vector<Eigen::Vector3d> point_gradient;
  std::vector<LinkMatrix> E;  // one a link

  const std::vector<Link>& links() const { return links_; }
  // Links of a point: [first, first of the next). Links of a camera, points ascending.
  std::size_t FirstLink(std::size_t point) const { return first_link_[point]; }
  std::span<const int> LinksOf(std::size_t camera) const {
    return {seen_by_.data() + first_seen_[camera], first_seen_[camera + 1] - first_seen_[camera]};
  }

  struct Step {
    std::vector<CameraVector> cameras;
    std::vector<Eigen::Vector3d> points;
    double model_decrease = 0;  // of half the sum of squares, by the equations without damping
  };
  // False: the equations determine no step so little damped.
  bool Solve(double damping, Step& step);

 private:
  void EliminatePoints(double damping);
  void FillRow(std::size_t camera, double damping, Eigen::VectorXd& rhs);

  std::vector<Link> links_;
  std::vector<std::size_t> first_link_, first_seen_;
  std::vector<int> seen_by_;
  // Of a point with V + d diag V = L L^T: L, L^-1 g, and E L^-T of its links.
  std::vector<Eigen::Matrix3d> root_;
  std::vector<Eigen::Vector3d> divided_gradient_;
  std::vector<LinkMatrix> divided_;
  TileCholesky complement_;
};

}  // namespace lumi
