// A path of virtual cameras: JSON of our own or nerfstudio's (docs/viewer.md; it knows no principal point), or through
// the photos' own cameras.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct PathKey {
  Rigid3 cam_from_world;
  double vertical_fov_rad = 0;
  double time_s = 0;  // on the path's own clock
  // As fractions of the picture's width and height: an off-centre axis is kept.
  Eigen::Vector2d principal_point{0.5, 0.5};
};

struct CameraPath {
  std::vector<PathKey> keys;  // time ascending
  double fps = 30;
  int width_px = 0, height_px = 0;  // 0: decided by the caller
  int frames = 0;                   // spread evenly from the first key to the last; 0: as many as duration and fps give
};

constexpr double kMaxPathSeconds = 24 * 3600;

// Which entries of a file become the path's keys, if it holds both frames and keyframes (nerfstudio's does).
enum class PathDetail { kFrames, kKeyframes };

// Recognises the format by its content. Throws InputError: the file, and what is wrong with it in one line.
CameraPath ReadCameraPath(const std::filesystem::path& file, PathDetail detail = PathDetail::kFrames);
void WriteCameraPath(const std::filesystem::path& file, const CameraPath& path);

// Width and height of a film through the photos: the size of a photo held upright, portrait or landscape, whichever is
// more common.
Eigen::Vector2i FilmSize(const Scene& scene);

// Visits the photos' cameras, held upright, in an order that makes a smooth tour (by name for a video, else nearest
// neighbour from one end), `seconds` long, smoothed. The field of view is that of the photos of the film's shape.
CameraPath PathThroughPhotos(const Scene& scene, double seconds, double fps);

double Duration(const CameraPath& path);  // seconds
int FrameCount(const CameraPath& path);

// The camera at a time on the path's clock, held at the ends. Throws std::invalid_argument for a path without keys.
PathKey PoseOnPath(const CameraPath& path, double time_s);
RenderView MakeRenderView(const PathKey& key, int width_px, int height_px);

// The frames: centres by Catmull-Rom (centripetal: no loops at uneven keys), rotations by spherical interpolation of
// the same blend, field of view and principal point likewise.
std::vector<RenderView> SamplePath(const CameraPath& path, int width_px, int height_px);

}  // namespace lumi
