// A checkerboard found in a picture, at any rotation (OpenCV's sector-based detector; where it finds nothing the older
// one, which copes better with wide lenses), with corners refined to sub-pixels (cornerSubPix).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "scene/model/image.h"

namespace lumi {

struct FoundBoard {
  std::vector<Eigen::Vector2d>
      corners_px;            // in the order of Board::Corners, right-handed; first pixel's centre at (0.5, 0.5)
  double edge_width_px = 0;  // over how many pixels an edge of the board rises; blur shows here
};

struct BoardSearch {
  std::optional<FoundBoard> found;
  std::string why_not;  // "no board", "a 7x6 board, not 9x6": for a person
  // Columns and rows (columns >= rows) of the board in the picture where it is another one, or a part of it.
  int seen_columns = 0, seen_rows = 0;
};

// picture: 1, 3 or 4 channels. corner_window_px: half the side of the window that a corner is refined in; 0: 0.4 of the
// distance to the nearest neighbour, up to 11 (a window that reaches the next corner spoils both), in a slightly
// softened picture; a given window is used in the picture as it is, as OpenCV's programs do it.
BoardSearch FindBoard(const Image8& picture, const Board& board, int corner_window_px = 0);

// How sharp a picture is: variance of the Laplacian over the variance, of its half. Comparable within a video only.
double Sharpness(const Image8& picture);

}  // namespace lumi
