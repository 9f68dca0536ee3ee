// A checkerboard found in a picture, at any rotation, with sub-pixel corners (OpenCV's sector-based detector, which also copes with blur and
// wide lenses; where it finds nothing the older one with cornerSubPix).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "scene/model/image.h"

namespace lumi {

struct FoundBoard {
  std::vector<Eigen::Vector2d> corners_px;  // in the order of Board::Corners, right-handed; first pixel's centre at (0.5, 0.5)
  double edge_width_px = 0;                 // over how many pixels an edge of the board rises; blur shows here
};

struct BoardSearch {
  std::optional<FoundBoard> found;
  std::string why_not;  // "no board", "a 7x6 board, not 9x6": for a person
  // Columns and rows (columns >= rows) of the board in the picture where it is another one, or a part of it.
  int seen_columns = 0, seen_rows = 0;
};

// rgb: 1 or 3 channels.
BoardSearch FindBoard(const Image8& picture, const Board& board);

// How sharp a picture is: variance of the Laplacian over the variance, of its half. Comparable within a video only.
double Sharpness(const Image8& picture);

}  // namespace lumi
