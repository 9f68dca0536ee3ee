// Rendered frames become a film, with the sound of the one that they come from.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

struct Film {
  int count = 0;
  double fps = 0;
  std::function<Image8(int)> frame;       // 0 ... count - 1, of one size
  std::filesystem::path sound_from = {};  // empty: none
};

// As H.264 in `output` (replaced when complete). The sound is copied, or where MP4 does not take it, coded anew as AAC.
// False: there is none that could be taken, and the film is silent.
bool WriteFilm(const std::filesystem::path& output, const Film& film, const std::string& task, ProgressSink& progress);

// The left half of `filmed` beside the right half of `steady`, of steady's size, a line between them.
Image8 SplitScreen(const Image8& filmed, const Image8& steady);

}  // namespace lumi
