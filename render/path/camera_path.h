// A path of virtual cameras: JSON (see docs/render.md), or through the photos' own cameras.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct PathKey {
  Rigid3 cam_from_world;
  double vertical_fov_rad = 0;
  double time_s = 0;           // on the path's own clock
};

struct CameraPath {
  std::vector<PathKey> keys;   // time ascending
  double fps = 30;
  int width_px = 0, height_px = 0;   // 0: decided by the caller
};

CameraPath ReadCameraPath(const std::filesystem::path& file);
void WriteCameraPath(const std::filesystem::path& file, const CameraPath& path);

// Visits the photos' cameras in an order that makes a smooth tour (by name for a video, else nearest neighbour from one
// end), `seconds` long, smoothed.
CameraPath PathThroughPhotos(const Scene& scene, double seconds, double fps);

// The frames: centres by Catmull-Rom (centripetal: no loops at uneven keys), rotations by spherical interpolation of the
// same blend, field of view likewise.
std::vector<RenderView> SamplePath(const CameraPath& path, int width_px, int height_px);

}  // namespace lumi
