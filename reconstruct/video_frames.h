// A video as photographs: keyframes (and, on request, the other frames) written as JPEG files with their times.
#pragma once

#include <filesystem>
#include <vector>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"

namespace lumi {

// "frame_000123.jpg"
std::string FrameName(int index);

// The frames have been compressed as video already; JPEG must not add visible errors.
inline constexpr int kFrameJpegQuality = 95;

// Picks keyframes and writes them to work_folder/keyframes, unless they are there already (said in *reused). Throws
// DataError when the camera does not move.
Capture ExtractKeyframes(const ReconstructOptions& options, const std::filesystem::path& work_folder,
                         std::vector<std::string>* reused, ProgressSink& sink);

// All frames of the video in `folder`, the keyframes among them as hard links to their files.
Capture ExtractAllFrames(const ReconstructOptions& options, const Capture& keyframes,
                         const std::filesystem::path& folder, ProgressSink& sink);

// All frames of the video, in `folder`; no keyframes are chosen, so that the camera may stand still.
Capture ExtractEveryFrame(const ReconstructOptions& options, const std::filesystem::path& folder, ProgressSink& sink);

}  // namespace lumi
