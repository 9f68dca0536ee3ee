// Rendered frames become a film, with the sound of the one that they come from.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

// frame(i) for i = 0 ... count - 1, of one size, as H.264 in `output` (replaced when complete) at fps; the sound of
// `sound_from` (empty: none) is copied, or where MP4 does not take it, coded anew as AAC. False: it has no sound that
// could be taken, and the film is silent.
bool WriteFilm(const std::filesystem::path& output, int count, double fps, const std::function<Image8(int)>& frame,
               const std::filesystem::path& sound_from, const std::string& task, ProgressSink& progress);

// The left half of `filmed` beside the right half of `steady`, of steady's size, a line between them.
Image8 SplitScreen(const Image8& filmed, const Image8& steady);

}  // namespace lumi
