// A small world whose every photograph is known: a textured floor and a box on it, seen by cameras on an arc.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "render/photos/photo_set.h"
#include "scene/files/image_io.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi::test {

struct World {
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
};

struct Box {
  Eigen::Vector3d lo{-0.5, -0.4, 0.0}, hi{0.5, 0.4, 0.7};
};

// z is up; the floor is z = 0, a square of half width kFloor.
constexpr double kFloor = 6.0;

inline Eigen::Vector3d WorldColor(const Eigen::Vector3d& x) {
  const auto wave = [](double a) { return 0.5 + 0.5 * std::sin(a); };
  return {wave(5.1 * x.x() + 1.3 * x.z()) * 0.8 + 0.1, wave(4.3 * x.y() - 2.0 * x.z() + 0.7) * 0.8 + 0.1,
          wave(3.1 * (x.x() + x.y()) + 5.0 * x.z()) * 0.8 + 0.1};
}

inline std::optional<Eigen::Vector3d> Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double best = std::numeric_limits<double>::infinity();
  if (direction.z() < 0) {
    const double t = -origin.z() / direction.z();
    const Eigen::Vector3d x = origin + t * direction;
    if (std::abs(x.x()) <= kFloor && std::abs(x.y()) <= kFloor) best = t;
  }
  const Box box;
  double enter = 0, leave = best;
  for (int i = 0; i < 3; ++i) {
    const double a = (box.lo[i] - origin[i]) / direction[i], b = (box.hi[i] - origin[i]) / direction[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter < leave && enter > 0) best = enter;
  if (!std::isfinite(best)) return std::nullopt;
  return origin + best * direction;
}

inline Image8 Photograph(const RenderView& view) {
  Image8 image(view.size_px.x(), view.size_px.y(), 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (const auto direction = RayDirection(view.P, {x + 0.5, y + 0.5}))
        if (const auto hit = Hit(view.centre, direction->normalized()))
          for (int c = 0; c < 3; ++c)
            image.At(x, y, c) = static_cast<std::uint8_t>(std::lround(255 * WorldColor(*hit)[c]));
  return image;
}

inline void AddQuad(Mesh& mesh, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) {
  const auto n = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.faces.push_back({n, n + 1, n + 2});
  mesh.faces.push_back({n, n + 2, n + 3});
}

inline Mesh WorldMesh() {
  Mesh m;
  AddQuad(m, {-kFloor, -kFloor, 0}, {kFloor, -kFloor, 0}, {kFloor, kFloor, 0}, {-kFloor, kFloor, 0});
  const Eigen::Vector3d l = Box().lo, h = Box().hi;
  AddQuad(m, {l.x(), l.y(), h.z()}, {h.x(), l.y(), h.z()}, {h.x(), h.y(), h.z()}, {l.x(), h.y(), h.z()});
  AddQuad(m, {l.x(), l.y(), l.z()}, {h.x(), l.y(), l.z()}, {h.x(), l.y(), h.z()}, {l.x(), l.y(), h.z()});
  AddQuad(m, {h.x(), h.y(), l.z()}, {l.x(), h.y(), l.z()}, {l.x(), h.y(), h.z()}, {h.x(), h.y(), h.z()});
  AddQuad(m, {l.x(), h.y(), l.z()}, {l.x(), l.y(), l.z()}, {l.x(), l.y(), h.z()}, {l.x(), h.y(), h.z()});
  AddQuad(m, {h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {h.x(), h.y(), h.z()}, {h.x(), l.y(), h.z()});
  return m;
}

inline Eigen::Vector3d ArcCentre(double turn) {
  return {3.2 * std::cos(turn), 3.2 * std::sin(turn), 1.6 + 0.5 * std::sin(3 * turn)};
}

// `turn`: around the box, radians.
inline RenderView ArcView(double turn, int width, int height, double focal_px, double distance = 1.0) {
  const Eigen::Vector3d target(0, 0, 0.3);
  const Eigen::Vector3d eye = target + distance * (ArcCentre(turn) - target);
  return MakeRenderView(Camera::Pinhole(width, height, focal_px, focal_px, 0.5 * width + 1.7, 0.5 * height - 2.1),
                        LookAt(eye, target, Eigen::Vector3d::UnitZ()));
}

// Photos of two sizes, a third of them portrait.
inline World MakeWorld(int views = 10, int side_px = 160, double arc_rad = 2.4) {
  World w;
  w.proxy = WorldMesh();
  const double f = 1.1 * side_px;
  w.scene.cameras = {Camera::Pinhole(side_px, side_px * 3 / 4, f, f, 0.5 * side_px, 0.375 * side_px),
                     Camera::Pinhole(side_px * 3 / 4 - 3, side_px - 5, f, 1.02 * f, 0.37 * side_px, 0.5 * side_px)};
  for (int i = 0; i < views; ++i) {
    View v;
    v.name = std::to_string(100000 + i) + ".png";
    v.camera = CameraId{i % 3 == 2 ? 1 : 0};
    const double turn = arc_rad * i / std::max(1, views - 1);
    v.cam_from_world = LookAt(ArcCentre(turn), {0.1 * std::sin(9.0 * i), 0.1 * std::cos(7.0 * i), 0.3}, Eigen::Vector3d::UnitZ());
    w.scene.views.push_back(v);
  }
  UpdateFrameOfReference(w.scene);
  return w;
}

inline void Photograph(World& w) {
  w.photos.clear();
  for (const View& v : w.scene.views) w.photos.push_back({BuildPyramid(Photograph(MakeRenderView(w.scene, v))), 0});
}

}  // namespace lumi::test
