// Tracks of simulated scenes: random points in front of a moving camera, projected exactly, noise and outliers added.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "scene/geometry/angle.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"
#include "scene/tracks/tracks.h"

namespace lumi::test {

inline constexpr int kWidthPx = 640, kHeightPx = 480;

inline Camera TrueCamera() { return Camera::Pinhole(kWidthPx, kHeightPx, 560, 560, 322.5, 238.5); }

struct SimulatedTracks {
  Camera camera = TrueCamera();
  std::vector<Rigid3> cam_from_world;
  std::vector<Eigen::Vector4d> x_in_world;  // homogeneous, one a track
  Tracks tracks;
  double scene_size = 0;                   // diagonal of the bounding box of points and cameras, world units
  std::vector<std::vector<char>> outlier;  // as Tracks' observations
};

inline constexpr int kForever = 1 << 30;

struct Noise {
  double sigma_px = 0;
  double missing = 0;                                   // share of sights left out
  double outliers = 0;                                  // share of sights moved anywhere in the photo
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();  // added to every sight and to the principal point
  int max_track_frames = kForever;                      // a track is cut after so many frames, and a new one begins
  unsigned seed = 1;
};

// Noise as a tracker leaves it.
inline Noise Tracked(double sigma_px = 0.3, int max_track_frames = kForever) {
  Noise noise;
  noise.sigma_px = sigma_px;
  noise.max_track_frames = max_track_frames;
  return noise;
}

// Sees what is in front and inside the photo; tracks seen in fewer than two frames are left out.
inline SimulatedTracks See(const std::vector<Rigid3>& path, const std::vector<Eigen::Vector4d>& points,
                           const Noise& noise, const Camera& camera = TrueCamera()) {
  SimulatedTracks s;
  s.camera = camera;
  s.cam_from_world = path;
  std::mt19937_64 random(noise.seed);
  std::normal_distribution<double> gauss(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  const auto widen = [&](const Eigen::Vector3d& x) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  };
  for (std::size_t f = 0; f < path.size(); ++f) {
    s.tracks.frames.push_back({"frame" + std::to_string(1000 + f) + ".png", {camera.width_px, camera.height_px}});
    widen(path[f].OriginInSource());
  }
  for (const Eigen::Vector4d& X : points) {
    Track track;
    std::vector<char> wrong;
    const auto finish = [&] {
      if (track.observations.size() >= 2) {
        if (X.w() > 1e-6) widen(X.hnormalized());
        s.tracks.tracks.push_back(track);
        s.outlier.push_back(wrong);
        s.x_in_world.push_back(X);
      }
      track.observations.clear();
      wrong.clear();
    };
    // Lost and found again as a new track, each point at its own time.
    int age = static_cast<int>(random() % static_cast<unsigned>(noise.max_track_frames));
    for (std::size_t f = 0; f < path.size(); ++f) {
      const Eigen::Vector3d in_cam = path[f].R() * X.head<3>() + path[f].translation * X.w();
      if (!(in_cam.z() > 1e-9)) continue;
      const auto x = camera.Project(in_cam);
      if (!x || x->x() < 0 || x->y() < 0 || x->x() > camera.width_px || x->y() > camera.height_px) continue;
      if (noise.max_track_frames < kForever && ++age % noise.max_track_frames == 0) finish();
      const double keep = uniform(random), bad = uniform(random);
      const Eigen::Vector2d anywhere(uniform(random) * camera.width_px, uniform(random) * camera.height_px);
      const Eigen::Vector2d jitter(gauss(random), gauss(random));
      if (keep < noise.missing) continue;
      const bool outlier = bad < noise.outliers;
      const Eigen::Vector2d seen = outlier ? anywhere : *x + noise.sigma_px * jitter;
      track.observations.push_back({static_cast<int>(f), seen + noise.offset_px});
      wrong.push_back(outlier);
    }
    finish();
  }
  s.scene_size = (high - low).norm();
  for (int i = 0; i < 2; ++i) s.camera.params[static_cast<std::size_t>(2 + i)] += noise.offset_px[i];
  return s;
}

// The same frames in another order, neighbours far apart. Their number is no multiple of 7.
inline SimulatedTracks InNoOrder(SimulatedTracks s) {
  const int n = static_cast<int>(s.cam_from_world.size());
  const auto place = [&](int f) { return f * 7 % n; };
  std::vector<Rigid3> path(s.cam_from_world.size());
  for (int f = 0; f < n; ++f) path[static_cast<std::size_t>(place(f))] = s.cam_from_world[static_cast<std::size_t>(f)];
  s.cam_from_world = path;
  for (Track& track : s.tracks.tracks) {
    for (auto& o : track.observations) o.frame = place(o.frame);
    std::sort(track.observations.begin(), track.observations.end(),
              [](const auto& a, const auto& b) { return a.frame < b.frame; });
  }
  return s;
}

// The same way without turning.
inline std::vector<Rigid3> WithoutTurning(std::vector<Rigid3> path) {
  for (Rigid3& pose : path) pose = {Eigen::Quaterniond::Identity(), -pose.OriginInSource()};
  return path;
}

inline std::vector<Eigen::Vector4d> PointsInBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int n,
                                                unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Eigen::Vector4d> points;
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d u;
    for (int k = 0; k < 3; ++k) u[k] = uniform(random);
    points.push_back((low + u.cwiseProduct(high - low)).homogeneous());
  }
  return points;
}

// A walk along a square with houses: sideways, shaking, looking ahead and aside. y points down.
inline std::vector<Rigid3> PlazaPath(int frames) {
  std::vector<Rigid3> path;
  for (int i = 0; i < frames; ++i) {
    const double s = frames > 1 ? i / static_cast<double>(frames - 1) : 0.0;
    const Eigen::Vector3d eye(-3 + 6 * s, -0.3 * std::sin(9 * s), -1 + 0.8 * std::sin(4 * s));
    path.push_back(LookAt(eye, Eigen::Vector3d(1.5 * std::sin(5 * s), 0.2 * std::cos(7 * s), 9),
                          Eigen::Vector3d(0.05 * std::sin(11 * s), -1, 0)));
  }
  return path;
}
inline std::vector<Eigen::Vector4d> PlazaPoints(int n, unsigned seed = 7) {
  return PointsInBox({-9, -3, 5}, {9, 2, 16}, n, seed);
}

// Forward through a corridor: points on its four walls, the epipole in the middle of the photo.
inline std::vector<Rigid3> HallwayPath(int frames) {
  std::vector<Rigid3> path;
  for (int i = 0; i < frames; ++i) {
    const double s = frames > 1 ? i / static_cast<double>(frames - 1) : 0.0;
    const Eigen::Vector3d eye(0.1 * std::sin(8 * s), 0.05 * std::cos(9 * s), 6 * s);
    path.push_back(LookAt(eye, eye + Eigen::Vector3d(0.05 * std::sin(6 * s), 0.03 * std::cos(5 * s), 1),
                          -Eigen::Vector3d::UnitY()));
  }
  return path;
}
inline std::vector<Eigen::Vector4d> HallwayPoints(int n, unsigned seed = 8) {
  std::vector<Eigen::Vector4d> points = PointsInBox({-1.5, -1.2, 1}, {1.5, 1.2, 20}, n, seed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t wall = i % 5;
    if (wall < 2)
      points[i].x() = wall == 0 ? -1.5 : 1.5;
    else if (wall < 4)
      points[i].y() = wall == 2 ? -1.2 : 1.2;
  }
  return points;
}

// A drive of 29 m down a corridor 2.4 m wide, photos a metre and more apart, seen small: after three or four of them
// all that was near is past.
inline Camera DriveCamera() { return Camera::Pinhole(320, 240, 228.5, 228.5, 160, 120); }
inline std::vector<Rigid3> DrivePath(int frames) {
  std::vector<Rigid3> path;
  for (int i = 0; i < frames; ++i) {
    const double s = frames > 1 ? i / static_cast<double>(frames - 1) : 0.0;
    const Eigen::Vector3d eye(0.06 * std::sin(9 * s), 0, 29 * s);
    path.push_back(LookAt(eye, eye + Eigen::Vector3d(0.02 * std::sin(7 * s), 0.02, 1), -Eigen::Vector3d::UnitY()));
  }
  return path;
}
inline std::vector<Eigen::Vector4d> DrivePoints(int n, unsigned seed = 10) {
  std::vector<Eigen::Vector4d> points = PointsInBox({-1.2, -1.3, 1}, {1.2, 1.3, 37}, n, seed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 2 == 0)
      points[i].x() = i % 4 == 0 ? -1.2 : 1.2;
    else
      points[i].y() = i % 4 == 1 ? -1.3 : 1.3;
  }
  return points;
}

// An arc around things on a desk.
inline std::vector<Rigid3> DeskPath(int frames, double arc_deg = 60) {
  std::vector<Rigid3> path;
  for (int i = 0; i < frames; ++i) {
    const double s = frames > 1 ? i / static_cast<double>(frames - 1) - 0.5 : 0.0, a = arc_deg * kRadPerDeg * s;
    const Eigen::Vector3d eye(1.6 * std::sin(a), -0.7 - 0.2 * std::sin(5 * s), -1.6 * std::cos(a));
    path.push_back(LookAt(eye, Eigen::Vector3d(0, -0.1, 0), -Eigen::Vector3d::UnitY()));
  }
  return path;
}
inline std::vector<Eigen::Vector4d> DeskPoints(int n, unsigned seed = 9) {
  return PointsInBox({-0.6, -0.4, -0.5}, {0.6, 0.1, 0.5}, n, seed);
}

}  // namespace lumi::test
