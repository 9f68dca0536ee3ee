// A checkerboard and its corners as photos show them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace lumi {

struct Board {
  int columns = 9;       // inner corners along a row, >= 3
  int rows = 6;          // >= 3
  double square_mm = 1;  // > 0
  int CornerCount() const { return columns * rows; }
  // On the board's plane, row by row: x along a row, y to the next row, in mm. Seen from the front with x to the right,
  // y points down.
  std::vector<Eigen::Vector2d> Corners() const {
    std::vector<Eigen::Vector2d> corners;
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i) corners.emplace_back(i * square_mm, j * square_mm);
    return corners;
  }
};

struct BoardView {
  std::string name;
  std::vector<Eigen::Vector2d>
      corners_px;  // Shape (columns * rows), in the order of Board::Corners; first pixel's centre at (0.5, 0.5)
  std::vector<bool> left_out;  // corners that no fit reads, as many; empty: none
  bool Used(std::size_t corner) const { return left_out.empty() || !left_out[corner]; }
};

}  // namespace lumi
