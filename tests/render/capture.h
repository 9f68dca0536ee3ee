// A tiny world with exact photographs for tests: a textured plane behind a textured box, seen by cameras on an arc. The
// photos are ray-cast here, at pixel centres, without antialiasing, from a smooth procedural texture.
#pragma once

#include <array>
#include <cmath>

#include "render/photos/photo_set.h"
#include "scene/files/image_io.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi::test {

struct Capture {
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
};

inline Mesh PlaneAndBox() {
  Mesh m;
  m.vertices = {{-8, -8, 3}, {8, -8, 3}, {8, 8, 3}, {-8, 8, 3}};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  Mesh box;
  for (int i = 0; i < 8; ++i)
    box.vertices.emplace_back((i & 1) ? 0.6 : -0.6, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.8 : -0.4);
  box.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
               {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  Append(m, box);
  return m;
}

inline std::array<std::uint8_t, 3> Texture(const Eigen::Vector3d& x) {
  const double a = std::sin(7 * x.x() + 2 * x.z()) + std::sin(5 * x.y() - 3 * x.z()),
               b = std::cos(3 * x.x() * x.y() + x.z());
  return {static_cast<std::uint8_t>(128 + 50 * a), static_cast<std::uint8_t>(128 + 90 * b),
          static_cast<std::uint8_t>(128 + 40 * (a - b))};
}

// Nearest hit of a ray with a mesh, brute force in double; +infinity where it misses.
inline double HitDistance(const Mesh& mesh, const Eigen::Vector3d& origin, const Eigen::Vector3d& d) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& f : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[static_cast<std::size_t>(f[0])],
                          e1 = mesh.vertices[static_cast<std::size_t>(f[1])] - a,
                          e2 = mesh.vertices[static_cast<std::size_t>(f[2])] - a;
    const Eigen::Vector3d p = d.cross(e2);
    const double det = e1.dot(p);
    if (std::abs(det) < 1e-14) continue;
    const Eigen::Vector3d s = origin - a, q = s.cross(e1);
    const double u = s.dot(p) / det, v = d.dot(q) / det, t = e2.dot(q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0) best = std::min(best, t);
  }
  return best;
}

// constant: every photo has this one colour instead of the texture.
inline Capture MakeCapture(int views, int width, std::optional<std::array<std::uint8_t, 3>> constant = std::nullopt) {
  Capture c;
  c.proxy = PlaneAndBox();
  const int height = width * 3 / 4;
  c.scene.cameras.push_back(Camera::Pinhole(width, height, 0.9 * width, 0.9 * width, 0.5 * width, 0.5 * height));
  for (int i = 0; i < views; ++i) {
    View v;
    v.name = "view" + std::to_string(100 + i) + ".png";
    v.camera = {0};
    const double a = 0.9 * (views > 1 ? i / (views - 1.0) - 0.5 : 0);
    v.cam_from_world = LookAt({5 * std::sin(a), 0.3 * std::sin(2.0 * i), -5 * std::cos(a)}, {0, 0, 0.5}, {0, -1, 0});
    c.scene.views.push_back(v);
    Image8 image(width, height, 3);
    const Matrix34d P = MakeRenderView(c.scene, v).P;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector3d d = RayDirection(P, {x + 0.5, y + 0.5})->normalized();
        const double t = HitDistance(c.proxy, v.CentreInWorld(), d);
        std::array<std::uint8_t, 3> rgb{};
        if (constant)
          rgb = *constant;
        else if (std::isfinite(t))
          rgb = Texture(v.CentreInWorld() + t * d);
        for (int k = 0; k < 3; ++k) image.At(x, y, k) = rgb[static_cast<std::size_t>(k)];
      }
    Photo photo;
    photo.levels = BuildPyramid(image);
    c.photos.push_back(std::move(photo));
  }
  for (int i = 0; i < 60; ++i) {
    Point p;
    p.x_in_world = {std::sin(12.9 * i) * 1.5, std::sin(78.2 * i) * 1.5, std::sin(37.7 * i) * 1.5 + 1};
    c.scene.points.push_back(p);
  }
  UpdateFrameOfReference(c.scene);
  return c;
}

}  // namespace lumi::test
