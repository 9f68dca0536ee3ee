// A scene gets a scale: two of its places, and how many metres they are apart. Cameras, points and proxies stay as they
// are; what one of their units is stands in lumigraph.json (metres_per_unit).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "scene/files/json_keys.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct MeasureOptions {
  std::filesystem::path scene;
  // A photo's camera ("a.jpg"), what a pixel of one shows ("a.jpg:412,233"), or the same thing in several
  // ("a.jpg:412,233+b.jpg:98,240"), or a point of the world ("0.1,-2,3.5").
  std::string a, b;
  double metres = 0;
};

struct MeasuredPlace {
  std::string place;  // as it was given
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();
  std::string from;  // camera, photos (triangulated), proxy, world
};

struct MeasureSummary {
  double metres_per_unit = 0;
  std::optional<double> metres_per_unit_before;
  double distance = 0;  // in world units
  double percent_for_a_pixel =
      0;  // what the distance changes by where each pixel is one off (root of the squares' sum)
  std::array<MeasuredPlace, 2> places;
  double cameras_extent_m = 0;  // the farthest camera from the cameras' mean, twice
};
void ListKeys(JsonKeys& j, MeasuredPlace& place);
void ListKeys(JsonKeys& j, MeasureSummary& summary);
std::string Describe(const MeasureSummary& summary);

// Where a place lies. proxy: what a single pixel's ray ends on; nullptr: there is none. Throws UsageError for a place
// that is none or names no photo of the scene, DataError where rays miss the proxy, or where pixels of several photos
// show no one point (more than 10 px off, or under less than half a degree).
MeasuredPlace FindPlace(const Scene& scene, const std::string& place, const Mesh* proxy);

// Both, and the distance.
MeasureSummary Measure(const Scene& scene, const MeasureOptions& options, const Mesh* proxy);

// On disk: writes the manifest. Metric scenes of ours only.
MeasureSummary MeasureScene(const MeasureOptions& options, ProgressSink& sink);

// The median distance of a camera to the one that is nearest to it: a rig's step. Throws DataError where cameras stand
// on one another.
double StepOfCameras(const Scene& scene);

}  // namespace lumi
