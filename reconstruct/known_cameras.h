// Cameras that the user knows already, brought together with the photos they belong to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"

namespace lumi {

// A photo with its camera, held fixed.
struct HeldView {
  std::string name;
  Camera camera;
  Rigid3 cam_from_world;
  // The same camera without distortion, where it is not sure that the photo still has it (--rescale-cameras: photos
  // that were scaled are often undistorted too); empty params: no question.
  Camera undistorted_alternative;
  // Skew of the photo as it is: x is sheared by this times (y - height / 2). `camera` is that of the photo without it
  // (photos in a metric scene have no skew: see RemoveSkew).
  double shear = 0;
};

// The camera that took the photo, with its skew: of a view whose camera has no distortion.
Camera WithSkew(const HeldView& view);

// Reads --poses and matches it with the photos: by path without the ending, else by the letters and digits of the name
// without the ending, else (a list without names) by position. Photos without a pose are added to *missing. Throws
// DataError or InputError: counts differ, no name fits, a camera of another size than its photo (see
// --rescale-cameras).
std::vector<HeldView> ReadKnownCameras(const Capture& capture, const ReconstructOptions& options,
                                       std::vector<MissingPhoto>* missing, ProgressSink& sink);

// Of each photo, the position among `names` of its own: by path without the ending, else by the letters and digits of
// the name; -1: none.
std::vector<int> MatchNames(const std::vector<std::string>& names, const std::vector<InputPhoto>& photos);

// The same photos in the world's mirror image (z reversed). A projection matrix leaves the world's handedness open:
// what lies in front of -P in one world lies in front of P in the other.
std::vector<HeldView> Mirrored(const std::vector<HeldView>& views);

// Whether the photos must be resampled: a shear that shows (a quarter of a pixel at the border).
bool HasSkew(const std::vector<HeldView>& views, const Capture& capture);
// Copies of the photos with their skew resampled away, in `staging`; names and sizes stay, borders are repeated.
Capture RemoveSkew(const Capture& capture, const std::vector<HeldView>& views, const std::filesystem::path& staging,
                   ProgressSink& sink);

// The intrinsics that --focal-px, --intrinsics or --camera give for a photo; nullopt where none was given.
std::optional<Camera> IntrinsicsFromOptions(const ReconstructOptions& options, int width_px, int height_px);

}  // namespace lumi
