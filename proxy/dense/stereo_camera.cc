#include "proxy/dense/stereo_camera.h"

#include <algorithm>
#include <cmath>

#include "proxy/dense/depth_map.h"

namespace lumi {

StereoCamera MakeStereoCamera(const Scene& scene, const View& view, int width, int height) {
  const Camera& photo = scene.CameraOf(view);
  StereoCamera camera;
  camera.width = photo.width_px;
  camera.height = photo.height_px;
  camera.focal_px = photo.FocalPx();
  camera.centre_px = photo.PrincipalPointPx();
  camera.cam_from_world = view.cam_from_world;
  return Resized(camera, width, height);
}

StereoCamera Resized(const StereoCamera& camera, int width, int height) {
  StereoCamera resized = camera;
  const Eigen::Vector2d scale(static_cast<double>(width) / camera.width, static_cast<double>(height) / camera.height);
  resized.width = width;
  resized.height = height;
  resized.focal_px = camera.focal_px.cwiseProduct(scale);
  resized.centre_px = camera.centre_px.cwiseProduct(scale);
  return resized;
}

Eigen::Vector2i StereoSize(const Eigen::Vector2i& photo_px, int longer_px) {
  const double scale = std::min(1.0, static_cast<double>(longer_px) / photo_px.maxCoeff());
  return {std::max(1, static_cast<int>(std::lround(scale * photo_px.x()))),
          std::max(1, static_cast<int>(std::lround(scale * photo_px.y())))};
}

PairGeometry Pair(const StereoCamera& reference, const StereoCamera& source) {
  const Rigid3 source_from_reference = source.cam_from_world * reference.cam_from_world.Inverse();
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity(), rays = Eigen::Matrix3d::Identity();
  K.diagonal().head<2>() = source.focal_px;
  K.col(2).head<2>() = source.centre_px;
  rays.diagonal().head<2>() = reference.focal_px.cwiseInverse();
  rays.col(2).head<2>() = -reference.centre_px.cwiseQuotient(reference.focal_px);
  const Eigen::Matrix3d a = K * source_from_reference.R() * rays;
  // The translation from the two centres: each is far from the origin where the world's is, their difference is not.
  const Eigen::Vector3d between = reference.cam_from_world.OriginInSource() - source.cam_from_world.OriginInSource();
  const Eigen::Vector3d b = K * (source.cam_from_world.rotation * between);
  PairGeometry pair;
  for (int i = 0; i < 9; ++i) pair.a[i] = static_cast<float>(a(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) pair.b[i] = static_cast<float>(b[i]);
  return pair;
}

DepthMap Resized(const DepthMap& map, int width, int height) {
  DepthMap out(width, height);
  const float sx = static_cast<float>(map.width) / static_cast<float>(width);
  const float sy = static_cast<float>(map.height) / static_cast<float>(height);
  for (int y = 0; y < height; ++y) {
    const float v = (static_cast<float>(y) + 0.5F) * sy;
    const int j = std::min(map.height - 1, static_cast<int>(v));
    for (int x = 0; x < width; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) * sx;
      const int i = std::min(map.width - 1, static_cast<int>(u));
      const std::size_t from = map.At(i, j), to = out.At(x, y);
      out.w[to] = map.w[from] + map.gx[from] * (u - (static_cast<float>(i) + 0.5F)) +
                  map.gy[from] * (v - (static_cast<float>(j) + 0.5F));
      if (!(out.w[to] > 0)) out.w[to] = map.w[from];
      out.gx[to] = map.gx[from] * sx;
      out.gy[to] = map.gy[from] * sy;
      out.cost[to] = map.cost[from];
    }
  }
  return out;
}

}  // namespace lumi
