// The boards of a folder of photos, or of a video: which pictures show one, and why the others are of no use.
#pragma once

#include <filesystem>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/fit.h"
#include "scene/program/progress.h"

namespace lumi {

struct GatherOptions {
  int corner_window_px = 0;    // see FindBoard
  int max_frames = 40;         // of a video are used, >= 3
  int video_candidates = 160;  // so many frames of a video, the sharpest each of its time, are searched, >= 3
};

struct Gathered {
  int width_px = 0, height_px = 0;
  bool video = false;
  std::vector<BoardView> views;
  std::vector<RefusedView> refused;  // photos; of a video only frames with a board, refused for a fault
  int pictures = 0;                  // photos or frames there are
  int searched = 0;
  int without_board = 0;
  int redundant = 0;  // frames of a video that show what others show
  double seconds = 0;
};

// Photos of another size than most are refused. Throws UsageError (no such path, no photo), InputError (nothing
// readable), DataError (the board is of another size everywhere).
Gathered GatherBoards(const std::filesystem::path& input, const Board& board, const GatherOptions& options,
                      ProgressSink& progress);

// The photos of a folder (or the one photo) in order of names.
std::vector<std::filesystem::path> PhotosOf(const std::filesystem::path& input);

}  // namespace lumi
