// COLMAP's mapping, its outcome checked: which part of a split scene is taken, whether it is more than a
// chance alignment, and the cameras polished.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/features.h"
#include "scene/model/scene.h"

namespace lumi {

struct Mapping {
  Scene scene;                                     // distorted cameras; image_folder = the capture's
  std::vector<int> components;                     // photos of each part, the largest first
  int component = 0;                               // the one taken
  std::vector<std::set<std::string>> other_parts;  // names
  std::vector<StepTime> steps;                     // mapping, polishing
};

// Throws DataError when there is no model that can be trusted.
Mapping MapScene(const Capture& capture, const CameraPlan& cameras, const Features& features, const ColmapJob& job);

constexpr int kPolishIterations = 100;  // COLMAP's own bound
// Points beyond so many times the median error are left out before cameras are polished.
constexpr double kOutlierFactor = 3;

// The scene without outliers after one more bundle adjustment by COLMAP, where that leaves its points no further off
// than they were; else the scene as it was. Unless the lens is known, it is adjusted too; where many photos share a
// camera, with its principal point free: held at the photo's middle it bends every rotation by its own error (half a
// degree on a real camera). scene.points[].error_px must be set.
Scene PolishCameras(const Scene& scene, bool lens_known, int most_iterations, const ColmapJob& job,
                    double outlier_factor = kOutlierFactor);

// Puts right what VerifyGroups (groups.h) and VerifyCameras (standing.h) find wrong with a mapping's scene: groups are
// moved, cameras placed anew or left out, and after any of these all are polished once more. Returns the standings in
// the scene as it then is.
struct StandingCameras {
  std::vector<CameraStanding> standings;
  std::vector<MissingPhoto> left_out;
};
StandingCameras KeepCamerasThatStand(Scene& scene, const CameraPlan& cameras, const Features& features,
                                     const ColmapJob& job);

// What speaks against a model, as one line, or an empty string: too few points, or rays that hardly meet.
std::string Distrust(const Scene& scene);

// The scene without points whose error is beyond `factor` times the median point's: a wrong match among the millions of
// right ones pulls the least-squares bundle with the square of its error.
Scene WithoutOutliers(const Scene& scene, double factor);

}  // namespace lumi
