// A closed surface that another one encloses and must go on enclosing while one of its vertices moves inwards.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace lumi {

class EnclosedSurface {
 public:
  // How deep the inner surface may stick out, in units in which it is about 1 across, and how far the outer one stays
  // away where it was asked to. The second is a ten-thousandth of a pixel of a photo that the body fills. The first is
  // far less: what sticks out is not enclosed any more, and the next move would not see it.
  static constexpr double kTolerance = 1e-10, kMargin = 1e-7;

  EnclosedSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<std::int32_t, 3>> faces);

  // The outer face (from, p, q), counter-clockwise seen from outside, becomes (to, p, q). Corners of inner faces that
  // it would pass or cut through are appended, those of them above the new face; none: it may.
  void FindObstacles(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& p,
                     const Eigen::Vector3d& q, std::vector<Eigen::Vector3d>& obstacles) const;

  // About `count` points `depth` behind the middles of faces, evenly picked.
  std::vector<Eigen::Vector3d> PointsWithin(std::size_t count, double depth) const;

 private:
  std::size_t CellOf(double x, int axis) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::int32_t, 3>> faces_;
  // A grid of cells, each with the faces whose boxes touch it.
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double cell_ = 1;
  std::array<std::size_t, 3> cells_ = {1, 1, 1};
  std::vector<std::uint32_t> first_;  // of each cell in face_of_cell_; one more at the end
  std::vector<std::uint32_t> face_of_cell_;
  std::vector<std::array<std::uint16_t, 3>> first_cell_;  // of each face's box
};

}  // namespace lumi
