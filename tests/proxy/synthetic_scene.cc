#include "tests/proxy/synthetic_scene.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

namespace lumi::test {

double Rectangle::Meets(const Eigen::Vector3d& eye, const Eigen::Vector3d& x) const {
  Eigen::Matrix3d m;
  m << x - eye, -a, -b;
  if (std::abs(m.determinant()) < 1e-12) return 2;
  const Eigen::Vector3d s = m.inverse() * (centre - eye);
  return s[0] > 0 && s[0] < 1 && std::abs(s[1]) <= 1 && std::abs(s[2]) <= 1 ? s[0] : 2;
}

double SceneBuilder::Random() {
  state_ += 0x9e3779b97f4a7c15ull;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

void SceneBuilder::AddCamera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  if (scene_.cameras.empty()) scene_.cameras.push_back(Camera::Pinhole(640, 480, 500, 500, 320, 240));
  View view;
  const std::string number = std::to_string(scene_.views.size());
  view.name = std::string(4 - std::min<std::size_t>(number.size(), 4), '0') + number + ".png";
  view.camera.value = 0;
  view.cam_from_world = LookAt(eye, target, -Eigen::Vector3d::UnitY());
  scene_.views.push_back(view);
}

void SceneBuilder::AddSurface(const Rectangle& rectangle, int count) {
  rectangles_.push_back(rectangle);
  for (int i = 0; i < count; ++i) {
    const double u = 2 * Random() - 1, v = 2 * Random() - 1;
    points_.push_back(rectangle.centre + u * rectangle.a + v * rectangle.b);
  }
}

void SceneBuilder::AddPoint(const Eigen::Vector3d& x) { points_.push_back(x); }

Scene SceneBuilder::Build() {
  Scene scene = scene_;
  for (const Eigen::Vector3d& x : points_) {
    Point point;
    point.x_in_world = x;
    point.error_px = 0.5;
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      const View& view = scene.views[v];
      const auto x_px = scene.CameraOf(view).Project(view.cam_from_world * x);
      if (!x_px || (x_px->array() < 0).any() || x_px->x() > 640 || x_px->y() > 480) continue;
      const Eigen::Vector3d eye = view.CentreInWorld();
      const bool hidden = std::any_of(rectangles_.begin(), rectangles_.end(),
                                      [&](const Rectangle& r) { return r.Meets(eye, x) < 1 - 1e-9; });
      if (hidden) continue;
      point.track.push_back({ViewId{static_cast<std::int32_t>(v)}, *x_px});
    }
    if (point.track.size() >= 2) scene.points.push_back(point);
  }
  return scene;
}

Scene BoxRoom(int points_a_wall, std::uint64_t seed) {
  SceneBuilder builder(seed);
  for (int i = 0; i < 24; ++i) {
    const double angle = i * 2 * 3.14159265358979 / 24;
    const Eigen::Vector3d out(std::cos(angle), 0, std::sin(angle));
    builder.AddCamera(-0.8 * out, 2 * out + Eigen::Vector3d(0, (i % 3 - 1) * 1.5, 0));
  }
  const Eigen::Vector3d x = 2 * Eigen::Vector3d::UnitX(), y = 1.5 * Eigen::Vector3d::UnitY(),
                        z = 2 * Eigen::Vector3d::UnitZ();
  for (const double s : {-1.0, 1.0}) {
    builder.AddSurface({s * x, y, z}, points_a_wall);
    builder.AddSurface({s * y, x, z}, points_a_wall);
    builder.AddSurface({s * z, x, y}, points_a_wall);
  }
  return builder.Build();
}

double DistanceToBoxRoom(const Eigen::Vector3d& p) {
  const Eigen::Vector3d beyond = p.cwiseAbs() - Eigen::Vector3d(2, 1.5, 2);
  return beyond.maxCoeff() > 0 ? beyond.cwiseMax(0).norm() : -beyond.maxCoeff();
}

Scene PlateBeforeWall(int wall_points, int plate_points, std::uint64_t seed) {
  SceneBuilder builder(seed);
  for (int i = 0; i < 9; ++i) builder.AddCamera({(i - 4) * 0.3, (i % 3 - 1) * 0.2, 0}, {0, 0, 4});
  builder.AddSurface({{0, 0, 4}, {4, 0, 0}, {0, 3, 0}}, wall_points);
  builder.AddSurface({{0, 0, 2}, {0.5, 0, 0}, {0, 0.5, 0}}, plate_points);
  return builder.Build();
}

Observation SeenBy(int view) { return {ViewId{view}, Eigen::Vector2d::Zero()}; }

Scene Moved(Scene scene, double scale, const Eigen::Vector3d& translation) {
  Transform(scene, Similarity3{scale, Eigen::Quaterniond::Identity(), translation});
  return scene;
}

}  // namespace lumi::test
