// A scene filmed by several fixed cameras at once: a folder of videos. The cameras are found from one moment that all
// of them saw; every frame then becomes a view with its camera's pose and its own time.
#pragma once

#include <filesystem>
#include <vector>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/files/video_clock.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// The videos right in a folder, sorted by name; empty where it holds fewer than two, or pictures as well.
std::vector<std::filesystem::path> SynchronisedVideos(const std::filesystem::path& folder);

struct MultiCapture {
  std::vector<std::filesystem::path> videos;
  std::vector<VideoClock> clocks;  // of each
  std::vector<int> offsets;        // frames of the common clock: see Synchronisation
  double fps = 0;                  // of the common clock: the fastest video's
  Capture moment;                  // one photo a camera, called after its video
  std::vector<int> moment_frame;   // of each video
};

// Offsets from --offsets-frames, else found; the moment is the middle of what all videos show. Throws DataError: a
// camera that moves, no common moment; before any video is decoded: times that are missing or fall.
MultiCapture OpenMultiCapture(const ReconstructOptions& options, const std::filesystem::path& work_folder,
                              ProgressSink& sink);

// Refines the offsets, now that `scene` has the cameras (one view a camera, of the moment), by comparing motion in the
// planes of each two cameras (epipolar_synchronise.h). Says what it changed. Videos without a camera keep their
// offsets. Not for offsets that were given.
void RefineWithCameras(MultiCapture& capture, const Scene& scene, ProgressSink& sink);

// Views of `scene` (one a camera, of the moment) become views of every --frame-step'th frame, called
// VIDEO/frame_000123.jpg, written to `folder`; the moment's own frame keeps the observations.
void ExpandFrames(Scene& scene, const MultiCapture& capture, const ReconstructOptions& options,
                  const std::filesystem::path& folder, ReconstructSummary& summary, ProgressSink& sink);

}  // namespace lumi
