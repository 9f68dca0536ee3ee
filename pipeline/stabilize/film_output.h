// Rendered frames become a film, with the sound of the one that they come from.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

struct Film {
  double fps = 0;
  std::vector<double> time_s;             // of each frame, ascending: when it is shown, from the first
  std::function<Image8(int)> frame;       // 0 ... time_s.size() - 1, of one size
  std::filesystem::path sound_from = {};  // empty: none
  std::optional<double> constant_fps =
      {};  // a film of this rate, each picture the frame nearest in time; none: at their times
};

// As H.264 in `output` (replaced when complete). The sound is copied, or where MP4 does not take it, coded anew as AAC;
// it begins where it did and is cut where the film ends, and never shortens the film. False: there is none that could
// be taken, and the film is silent. Throws MachineError where ffmpeg is killed, crashes, writes nothing or finds the
// disk full: nothing is in `output`'s place then.
bool WriteFilm(const std::filesystem::path& output, const Film& film, const std::string& task, ProgressSink& progress);

// The left half of `filmed` beside the right half of `steady`, of steady's size, a line between them.
Image8 SplitScreen(const Image8& filmed, const Image8& steady);

}  // namespace lumi
