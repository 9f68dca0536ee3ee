// Textured planes and photos of them, whose depth is known at every pixel: what stereo is tested on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "proxy/dense/patch_match.h"
#include "scene/model/scene.h"

namespace lumi::test {

// A parallelogram: a corner's opposite sides a, b from its middle (half edges). Grey of (s, t), in world units along
// them from the middle.
struct TexturedPlane {
  Eigen::Vector3d middle, a, b;
  std::function<double(double s, double t)> grey;
};

// Noise of several sizes, 20 .. 235, the finest `grain` world units wide; another one for each seed.
std::function<double(double, double)> NoiseTexture(double grain, std::uint32_t seed);

struct Photographed {
  StereoPicture picture;
  std::vector<double> depth;  // along the camera's axis; 0: nothing there
};

// Four rays a pixel. `gain`, `offset`: of the exposure, on code values.
Photographed Photograph(const std::vector<TexturedPlane>& world, const StereoCamera& camera, double gain = 1,
                        double offset = 0);

// Looks from `eye` at `target`, 1.2 widths of focal length.
StereoCamera CameraAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int width = 160, int height = 120);

// The same cameras as a scene, with points of the planes that at least two of them see; photos as PNG files in
// `folder`.
Scene SceneOf(const std::vector<TexturedPlane>& world, const std::vector<StereoCamera>& cameras,
              const std::filesystem::path& folder);

// Stereo between photos in memory, as StereoMaps has it at one size: photos alone, then twice with maps. Starts from
// `start` inverse depths (one for all pixels of all photos).
std::vector<DepthMap> MatchAll(const std::vector<Photographed>& photos, double start_depth, double nearest,
                               double farthest);

// Of the pixels where there is something: share whose depth is within `tolerance` of it, relative.
double ShareWithin(const DepthMap& map, const Photographed& photo, double tolerance);

// A wall across the view, 12 x 9.
TexturedPlane Wall(double depth = 4, std::uint32_t seed = 1);
// Cameras in a row, looking at a point before them.
std::vector<StereoCamera> RowOfCameras(int count, double step = 0.25, double depth = 4);

}  // namespace lumi::test
