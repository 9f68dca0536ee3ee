// Where the camera is, as a function of time; and which views of a path are taken.
#pragma once

#include <string>
#include <vector>

#include "scene/geometry/rigid3.h"
#include "simulate/scene_description.h"

namespace lumi {

// `frame` counts views from the path's beginning; fractions are between them where the camera moves (ring, walk, drive,
// wave). On grids, clusters and poses it stands still while a photo is taken.
Rigid3 PoseAt(const PathDescription& path, double frame);

// Factor on the camera's focal length: the path's zoom and hold, with a hand's error.
double ZoomAt(const PathDescription& path, double frame);

// EXIF's orientation of a photo from a camera turned by a quarter, as a phone stores one taken upright.
inline constexpr int kPortrait = 6;

// What shakes the camera: a walk's or drive's gait, a wave's hand. `scale` times as much of it; 0: the ideal path. A
// walk or drive that describes none gets a walk's usual one.
bool IsShaken(const PathDescription& path);
PathDescription WithShake(PathDescription path, double scale);

struct PlannedView {
  std::string name;     // of the photo, "desk_0012.jpg"
  int frame_index = 0;  // in the whole capture, also where only some views of it are taken
  int path = 0;
  double frame = 0;  // within its path
  int camera = 0;
  double time_s = 0;
  bool blurred = true;  // where the scene has motion blur
  int orientation = 1;  // EXIF's: kPortrait where the camera is turned
};

// All views of all paths, or `views` of them (0: all): evenly spread; the first ones of a scene that repeats
// itself, or where `first` asks for them. Which of them are blurred goes by their places among those taken. Throws
// UsageError when there are fewer.
std::vector<PlannedView> PlanViews(const SceneDescription& scene, int views, bool first = false);

}  // namespace lumi
