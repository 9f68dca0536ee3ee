// How each camera stands: how many points hold it that it did not help to find, how far they spread over the photo, how
// well they fix its place. A mapper believes a camera once it was placed; one that shares little with the others can
// hang on a dozen points, far from where its photo was taken.
//
// The evidence is independent of the camera itself: a match ties a pixel of its photo to a point that at least two
// other photos hold, triangulated from these alone (thesis sec. 2.5). A right pose shows most such points where the
// matches have them. One that does not is placed anew from them, and a camera that too few points hold is left out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "reconstruct/colmap_database.h"
#include "reconstruct/options.h"
#include "reconstruct/place_camera.h"
#include "scene/model/scene.h"

namespace lumi {

// Verified matches of two of a scene's views: pixels of their photos, at the keypoints where observations lie.
struct ViewMatches {
  ViewId a, b;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> px;
};
std::vector<ViewMatches> VerifiedMatchesOf(const Scene& scene, const ColmapDatabase& database);

// What the matches say of one camera: points that others hold, and where its photo should show them, whether the camera
// has them there or not.
struct CameraEvidence {
  std::vector<Point> points;        // places only
  std::vector<std::int32_t> index;  // of these in the scene
  std::vector<Sighting> seen;       // of these
  std::vector<char> agrees;         // with the pose that the camera has
  std::vector<double> angle_rad;    // under which others hold the point
  int agreeing = 0;
};
std::vector<CameraEvidence> EvidenceOf(const Scene& scene, const std::vector<ViewMatches>& matches);

// Worst first: named ones, then by sigma_percent.
std::vector<CameraStanding> MeasureStandings(const Scene& scene, const std::vector<ViewMatches>& matches);

struct VerifiedCameras {
  Scene scene;
  bool changed = false;                   // it wants another adjustment
  std::vector<CameraStanding> standings;  // of the cameras that stay
  std::vector<MissingPhoto> left_out;
};

// The scene without cameras that nothing holds, and with those placed anew that the points contradict. scene: metric,
// distorted cameras, observations at keypoints. Nothing is left out of a scene whose cameras are all held by few
// points.
VerifiedCameras VerifyCameras(Scene scene, const std::vector<ViewMatches>& matches);

// All points from the photos that hold them, by the rays that agree; those that no two do are gone.
void TriangulateAnew(Scene& scene);

}  // namespace lumi
