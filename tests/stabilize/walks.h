// Filmed walks whose steady path is known: points, the matrices that were meant, and those of the hand that shook.
#pragma once

#include <functional>
#include <random>
#include <vector>

#include "scene/files/matrix_path.h"
#include "scene/geometry/projection.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/scene.h"
#include "stabilize/filmed_scene.h"
#include "stabilize/stabilize.h"

namespace lumi::test {

inline constexpr int kWidthPx = 640, kHeightPx = 360;
inline constexpr double kFocalPx = 540, kFps = 30;

struct Walk {
  std::vector<Matrix34d> ideal, shaky;  // pixels from world, w > 0 in front; one a frame
  std::vector<Eigen::Vector4d> X;       // in world, w = 1
  std::vector<std::vector<char>> seen;  // [frame][point]: in the shaky picture
  std::vector<std::int32_t> object;     // vertigo: the points that are to stay
};

// A hand: turns and moves at 0.8 to 7 Hz, less the faster, as gait and tremor do.
struct Hand {
  double turn_rad = 0.014;  // RMS of each angle: 7.6 px at kFocalPx, peaks of 20
  double move = 0.012;      // RMS, world units
  double zoom = 0;          // RMS of the logarithm of the focal length
  double only_hz = 0;       // > 0: one sine of this frequency, horizontal, of amplitude turn_rad
  unsigned seed = 1;
};
inline constexpr Hand kStill{0, 0, 0, 0, 1};

struct Pose {
  Rigid3 cam_from_world;
  double focal_px = kFocalPx;
};
Matrix34d MatrixOf(const Pose& pose);
// `at`: the meant pose at time u, 0 at the first frame, 1 at the last.
Walk Film(int frames, const std::function<Pose(double u)>& at, std::vector<Eigen::Vector4d> X, const Hand& hand);

// What the motion laws are for. `frames` at kFps; y points down, z ahead.
Walk Forward(int frames, const Hand& hand = {});   // down a corridor of 2.4 m, 1.2 m/s
Walk Sideways(int frames, const Hand& hand = {});  // along houses 5 to 16 m away, 0.8 m/s
Walk Diagonal(int frames,
              const Hand& hand = {});  // 25 degrees off the line of sight: the focus is in the picture's border region
Walk Vertigo(int frames, double off_axis = 0,
             const Hand& hand = {0.01, 0.01, 0.006, 0, 1});      // object at 6 m, off_axis metres aside
Walk Around(int frames, double arc_deg, const Hand& hand = {});  // at 4 m about things of 2 m
Walk Wander(int frames, const Hand& hand = {});                  // along houses, slowly up, down, nearer and aside
std::vector<Eigen::Vector4d> PointsIn(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int n, unsigned seed);

struct Telling {
  double noise_px = 0;                                            // of each sight
  Eigen::Matrix4d world_from_walk = Eigen::Matrix4d::Identity();  // the projective frame that the scene is told in
  Eigen::Vector3d plane_tilt =
      Eigen::Vector3d::Zero();  // the plane at infinity is (tilt, 1): cheirality's is not the true one
  int track_frames = 1 << 30;   // a track ends after so many frames and another begins
  unsigned seed = 3;
};
// As lumi-reconstruct writes it: a projective scene, exact matrices and points, sights with noise.
Scene Told(const Walk& walk, const Telling& telling = {});
FilmedScene ReadWalk(const Walk& walk, const Telling& telling = {});
// A projective transformation of the condition asked for, that leaves walk and points on one side of its plane at
// infinity.
Eigen::Matrix4d ProjectiveFrame(const Walk& walk, double condition, unsigned seed);

// Pixels. `path` from the world of the telling.
std::vector<Matrix34d> InWalk(const MatrixPath& path, const Telling& telling);
std::vector<Matrix34d> InWalk(const FilmedScene& film, const std::vector<Matrix34d>& P, const Telling& telling);
// RMS over what was seen of the part above 1 Hz of (where P puts a point - where the ideal path does); of frames first
// ... last.
double JitterPx(const Walk& walk, const std::vector<Matrix34d>& P, int first = 0, int last = 1 << 30);
// The same of the second difference in time of that, pixels a frame a frame, RMS of the worst frame.
double WorstBendPx(const Walk& walk, const std::vector<Matrix34d>& P, int first = 0, int last = 1 << 30);
// Largest distance of images between two paths, of points that were seen.
double LargestDistancePx(const Walk& walk, const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b);
// RMS distance of the object's points from their mean, pixels, a frame.
std::vector<double> ObjectSizes(const Walk& walk, const std::vector<Matrix34d>& P);
// Around its points in the first frame, as StabilizeOptions::object_px has it.
std::vector<double> ObjectBox(const Walk& walk);

// The walk as a long video's: windows in projective frames of their own, each with another guess at the plane at
// infinity, joined.
struct InWindows {
  std::vector<Matrix34d> P;  // pixels from the walk's world
  std::vector<int> seams;    // first frames that a later window shows
  std::vector<StabilizeReport> reports;
};
InWindows StabilizeInWindows(const Walk& walk, const StabilizeOptions& options, int length, int overlap,
                             const Telling& telling = {});
// Frames first ... first + count - 1 alone, and their scene under the names, numbers and times that they have in the
// whole.
Walk WindowOf(const Walk& walk, int first, int count);
Scene ToldFrom(const Walk& window, const Telling& telling, int first);

}  // namespace lumi::test
