// --camera camera.yaml, made to fit the photos before any other step sees either: scaled where the photos have another
// resolution, and where no model of COLMAP's holds the lens (skew, k3) the photos are resampled as a pinhole camera
// would have taken them.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/model/camera.h"
#include "scene/program/progress.h"

namespace lumi {

// Whether photos of this size can have been scaled down (or up) from the camera's: the sides agree within a pixel.
bool SameShape(int camera_width_px, int camera_height_px, int width_px, int height_px);

// Throws DataError, naming both sizes, where photos of this size are not the camera's and neither SameShape nor
// `rescale` allows to scale it.
void RequireScalable(int camera_width_px, int camera_height_px, int width_px, int height_px, bool rescale,
                     const std::filesystem::path& camera);

// All that can be wrong with --camera for photos of these sizes (width, height), before anything is written. Throws
// InputError for a file that is no camera, DataError for one of another shape than the photos, UsageError for a
// database of features where the photos are resampled.
void CheckGivenCamera(const ReconstructOptions& options, const std::set<std::pair<int, int>>& sizes_px);

struct GivenCamera {
  std::filesystem::path yaml;       // what the other steps shall read in place of options.camera_yaml
  std::filesystem::path masks;      // and in place of options.masks
  std::optional<Camera> resampled;  // the lens that the photos were resampled from
  std::filesystem::path originals;  // their folder before
  Capture capture;                  // the photos to go on with
};

// Writes into `work_folder` only where photos are resampled or the camera is scaled. Throws as CheckGivenCamera.
GivenCamera FitGivenCamera(const ReconstructOptions& options, const Capture& capture,
                           const std::filesystem::path& work_folder, ProgressSink& sink);

// Further photos of the same lens (all frames of a video), into `folder`; those done by an earlier run are kept.
Capture Resampled(const Capture& capture, const Camera& camera, const std::filesystem::path& folder,
                  ProgressSink& sink);

}  // namespace lumi
