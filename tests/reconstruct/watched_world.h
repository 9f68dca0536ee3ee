// Simulated worlds of points and cameras with verified matches, some of them wrong, as a mapper would have them.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/standing.h"

namespace lumi {

constexpr double kWatchNoisePx = 0.4;
// Matches that verification let through though they are wrong.
constexpr double kWrongMatches = 0.1;

struct WatchedWorld {
  Scene scene;  // the truth but for the pixels' noise
  std::vector<ViewMatches> matches;
};

// Views see the points in front of them that lie within `reach`, and match those of their next `neighbours`.
inline WatchedWorld Watch(std::vector<Rigid3> poses, const std::vector<Eigen::Vector3d>& points, double reach,
                          int neighbours, std::mt19937& random) {
  WatchedWorld world;
  Camera camera;
  camera.model = CameraModel::kRadial;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.params = {560, 320, 240, -0.05, 0.01};
  world.scene.cameras = {camera};
  std::normal_distribution<double> noise(0, kWatchNoisePx);
  std::vector<std::vector<std::pair<std::int32_t, Eigen::Vector2d>>> seen(poses.size());
  for (std::size_t v = 0; v < poses.size(); ++v) {
    View view;
    view.name = "photo_" + std::to_string(1000 + v) + ".jpg";
    view.camera = CameraId{0};
    view.cam_from_world = poses[v];
    world.scene.views.push_back(view);
    for (std::size_t p = 0; p < points.size(); ++p) {
      const Eigen::Vector3d X = poses[v] * points[p];
      const auto x = X.z() > 0.1 && X.norm() < reach ? camera.Project(X) : std::nullopt;
      if (!x || x->x() < 0 || x->y() < 0 || x->x() > 640 || x->y() > 480) continue;
      seen[v].emplace_back(static_cast<std::int32_t>(p), *x + Eigen::Vector2d(noise(random), noise(random)));
    }
  }
  world.scene.points.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) world.scene.points[p].x_in_world = points[p];
  for (std::size_t v = 0; v < poses.size(); ++v)
    for (const auto& [p, x] : seen[v])
      world.scene.points[static_cast<std::size_t>(p)].track.push_back({ViewId{static_cast<std::int32_t>(v)}, x});
  for (std::size_t a = 0; a < poses.size(); ++a)
    for (std::size_t b = a + 1; b < poses.size() && b <= a + static_cast<std::size_t>(neighbours); ++b) {
      ViewMatches m{ViewId{static_cast<std::int32_t>(a)}, ViewId{static_cast<std::int32_t>(b)}, {}};
      std::map<std::int32_t, Eigen::Vector2d> in_b(seen[b].begin(), seen[b].end());
      for (const auto& [p, x] : seen[a])
        if (const auto it = in_b.find(p); it != in_b.end()) m.px.emplace_back(x, it->second);
      if (m.px.size() < 15) continue;  // COLMAP's bound on a pair
      for (std::size_t wrong = 0; wrong < static_cast<std::size_t>(kWrongMatches * static_cast<double>(m.px.size()));
           ++wrong)
        std::swap(m.px[random() % m.px.size()].second, m.px[random() % m.px.size()].second);
      world.matches.push_back(std::move(m));
    }
  std::erase_if(world.scene.points, [](const Point& p) { return p.track.size() < 2; });
  return world;
}

inline std::vector<Eigen::Vector3d> Cloud(int n, const Eigen::Vector3d& half_size, std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < n; ++i)
    points.emplace_back(half_size.cwiseProduct(Eigen::Vector3d(any(random), any(random), any(random))));
  return points;
}

inline WatchedWorld Ring(int views, std::mt19937& random) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < views; ++i) {
    const double t = 2 * M_PI * i / views;
    poses.push_back(LookAt(Eigen::Vector3d(4 * std::cos(t), 0.5 * std::sin(3 * t), 4 * std::sin(t)),
                           Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitY()));
  }
  return Watch(poses, Cloud(300, {1.5, 1, 1.5}, random), 100, 4, random);
}

// Along a road, straight ahead: every pair's epipole lies near the middle of the photo.
inline WatchedWorld Drive(int views, std::mt19937& random) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < views; ++i) {
    const Eigen::Vector3d at(0.05 * std::sin(0.7 * i), 0, 1.2 * i);
    poses.push_back(LookAt(at, at + Eigen::Vector3d(0.02 * std::cos(i), 0, 1), -Eigen::Vector3d::UnitY()));
  }
  std::vector<Eigen::Vector3d> points = Cloud(1500, {12, 4, 60}, random);
  for (Eigen::Vector3d& x : points) x.z() += 40;
  std::erase_if(points, [](const Eigen::Vector3d& x) { return x.head<2>().norm() < 1.5; });
  return Watch(poses, points, 40, 4, random);
}

}  // namespace lumi
