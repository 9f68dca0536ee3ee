// Several hand-held videos of one place, taken one after the other: keyframes of each, as photos of one capture.
// (Videos that fixed cameras took at once are multi_camera.h's.)
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"

namespace lumi {

// options.inputs where there are several, else the videos right in options.input. Throws UsageError where one of
// several is no video.
std::vector<std::filesystem::path> ClipsOf(const ReconstructOptions& options);

// Keyframes of every clip, called CLIP/frame_000123.jpg, in work_folder/clips. They carry no
// times: the clips' clocks have nothing in common. Photos of a clip share a camera (PlanCameras tells them by their
// lens setting). Throws DataError where a clip's camera does not move, UsageError where there are fewer than two.
Capture ExtractClips(const ReconstructOptions& options, const std::filesystem::path& work_folder,
                     std::vector<std::string>* reused, ProgressSink& sink);

// Photos that are worth matching, by index: neighbours in a clip, also at distances that double. Empty: a capture that
// is not of clips.
std::vector<std::pair<int, int>> ClipPairs(const Capture& capture);

}  // namespace lumi
