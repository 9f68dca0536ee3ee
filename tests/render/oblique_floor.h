#pragma once

#include <array>
#include <cmath>

#include "render/radiance/settings.h"
#include "tests/render/capture.h"

namespace lumi::test {

// A floor whose fine checks a photo takes from above, looked at from 15 degrees above it, at the photo's distance.
struct ObliqueFloor {
  Capture c;
  RenderView view, fine;  // the picture, and the same four times as large
  static std::array<std::uint8_t, 3> Checks(const Eigen::Vector3d& x) {
    const auto v = static_cast<std::uint8_t>(128 + 100 * std::sin(110 * x.x()) * std::sin(110 * x.y()));
    return {v, v, v};
  }
  ObliqueFloor() {
    c.proxy.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    c.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
    c.scene.cameras.push_back(Camera::Pinhole(256, 256, 256, 256, 128, 128));
    for (const double x : {-0.1, 0.1}) {
      View v;
      v.name = "view" + std::to_string(c.scene.views.size());
      v.camera = {0};
      v.cam_from_world = LookAt({x, 0.02, -2.2}, {x, 0, 0}, {0, -1, 0});
      const Matrix34d P = MakeRenderView(c.scene, v).P;
      Image8 image(256, 256, 3);
      for (int row = 0; row < 256; ++row)
        for (int column = 0; column < 256; ++column) {
          const Eigen::Vector3d o = v.cam_from_world.OriginInSource(), d = *RayDirection(P, {column + 0.5, row + 0.5});
          const auto rgb = Checks(o - o.z() / d.z() * d);
          for (int k = 0; k < 3; ++k) image.At(column, row, k) = rgb[static_cast<std::size_t>(k)];
        }
      Photo photo;
      photo.levels = BuildPyramid(image);
      c.photos.push_back(std::move(photo));
      c.scene.views.push_back(v);
    }
    for (int i = 0; i < 30; ++i) {
      Point p;
      p.x_in_world = {std::sin(12.9 * i), std::sin(78.2 * i), 0};
      c.scene.points.push_back(p);
    }
    UpdateFrameOfReference(c.scene);
    const double a = 15 * kRadPerDeg;
    const Rigid3 from = LookAt({0, -2.2 * std::cos(a), -2.2 * std::sin(a)}, {0, 0, 0}, {0, 0, -1});
    const Camera camera = Camera::Pinhole(160, 60, 256, 256, 80, 30);
    view = MakeRenderView(camera, from);
    fine = MakeRenderView(camera.Scaled(640, 240), from);
  }
};

}  // namespace lumi::test
