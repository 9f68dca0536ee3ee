// A plate that slides before a wall, or behind one, photographed at a few moments from several places each.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "proxy/mesh_query.h"
#include "proxy/moving/moving_proxy.h"
#include "scene/geometry/projection.h"

namespace lumi::test {

struct MovingWorld {
  double plate_depth = 2, wall_depth = 4, still_depth = 4;  // still: the surface that is known, all of the view
  double plate_x = 0;                                       // middle of its way
  bool plate_texture = true, wall_texture = true;
  int moments = 5, views = 5;
  double mask_margin = 0.15;  // about the plate's way; negative: nothing is masked; > 10: everything
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // of everything

  static double Shade(double u, double v, int c) {
    return 127 + 45 * std::sin(9 * u + 1.3 * c) + 45 * std::sin(13 * v + 5 * u + c);
  }

  std::vector<MovingPhoto> Photos() const {
    constexpr int kWidth = 96, kHeight = 72;
    std::vector<MovingPhoto> photos;
    for (int m = 0; m < moments; ++m)
      for (int k = 0; k < views; ++k) {
        MovingPhoto p;
        Camera camera;
        camera.width_px = kWidth;
        camera.height_px = kHeight;
        camera.params = {90, 90, kWidth / 2.0, kHeight / 2.0};
        camera.model = CameraModel::kPinhole;
        Rigid3 pose;
        const Eigen::Vector3d eye = offset + Eigen::Vector3d(0.11 * (k - (views - 1) / 2.0) + 0.013 * m,
                                                             0.05 * ((k * 2 + m) % 3 - 1), 0.02 * k);
        pose.translation = -eye;
        p.render = MakeRenderView(camera, pose);
        p.photo = Image8(kWidth, kHeight, 3);
        p.moves = Image8(kWidth, kHeight, 1);
        p.moment = m;
        const double at = plate_x + 0.3 * std::sin(6.283185307179586 * m / moments);
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) {
            const Eigen::Vector3d d = *RayDirection(p.render.P, {x + 0.5, y + 0.5});
            const auto on = [&](double depth) -> Eigen::Vector3d {
              return eye - offset + d * ((depth - (eye - offset).z()) / d.z());
            };
            const Eigen::Vector3d plate = on(plate_depth), wall = on(wall_depth);
            const bool hit = std::abs(plate.x() - at) < 0.25 * plate_depth && std::abs(plate.y()) < 0.2 * plate_depth;
            for (int c = 0; c < 3; ++c) {
              const double value = hit ? (plate_texture ? Shade(plate.x() - at, plate.y(), c) : 220.0 - 60 * c)
                                       : (wall_texture ? Shade(wall.x(), wall.y(), c + 2) : 90.0);
              p.photo.At(x, y, c) = static_cast<std::uint8_t>(std::lround(value));
            }
            const double reach = 0.25 * plate_depth + 0.3 + mask_margin;
            const bool way =
                std::abs(plate.x() - plate_x) < reach && std::abs(plate.y()) < 0.2 * plate_depth + mask_margin;
            p.moves.At(x, y, 0) = mask_margin >= 0 && way ? 255 : 0;
          }
        photos.push_back(p);
      }
    return photos;
  }

  Mesh Still() const {
    Mesh mesh;
    for (const double x : {-20.0, 20.0})
      for (const double y : {-20.0, 20.0}) mesh.vertices.push_back(offset + Eigen::Vector3d(x, y, still_depth));
    mesh.faces = {{0, 1, 2}, {2, 1, 3}};
    return mesh;
  }

  // Depth of the mesh on the line of sight from the middle of the cameras to a point of the plate's plane.
  double DepthTowards(const Mesh& mesh, double x, double y, double plane) const {
    const Eigen::Vector3d eye(0.013 * (moments - 1) / 2.0, 0, 0.02 * (views - 1) / 2.0), target(x, y, plane);
    const auto hit = MeshQuery(mesh).FirstHit(offset + eye, target - eye);
    return hit ? eye.z() + hit->distance * (target - eye).z() : 0;
  }
};

}  // namespace lumi::test
