#include "render/radiance/visibility.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lumi {
VisibilityMaps::VisibilityMaps(int count, int width, int height)
    : count_(count),
      width_(width),
      height_(height),
      depth_(static_cast<std::size_t>(count) * texels(), std::numeric_limits<float>::infinity()) {}

int VisibilityMaps::SuggestedSide(int count) {
  constexpr double kBudgetTexels = 64e6;
  return std::clamp(static_cast<int>(std::sqrt(kBudgetTexels / std::max(1, count))), 64, 128);
}

void VisibilityMaps::Fill(int camera, const RenderView& view, const ProxyTracer& proxy) {
  Eigen::Matrix3d M = view.P.leftCols<3>();
  M /= M.row(2).norm();
  const Eigen::Matrix3d ray_from_pixel = M.inverse();
  const Eigen::Vector3f axis = M.row(2).transpose().cast<float>();
  const double sx = static_cast<double>(view.size_px.x()) / width_,
               sy = static_cast<double>(view.size_px.y()) / height_;
  std::vector<Eigen::Vector3f> directions(texels());
  std::vector<float> depth(texels());
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      directions[static_cast<std::size_t>(y * width_ + x)] =
          (ray_from_pixel * Eigen::Vector3d((x + 0.5) * sx, (y + 0.5) * sy, 1)).normalized().cast<float>();
  proxy.Trace(view.centre.cast<float>(), directions, depth);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] *= axis.dot(directions[i]);
  std::copy(depth.begin(), depth.end(),
            depth_.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(camera) * texels()));
}

template <typename T>
T VisibilityMaps::VisibilityAs(int camera, T u_px, T v_px, T width_px, T height_px, T depth) const {
  const T x = std::clamp(u_px * static_cast<T>(width_) / width_px - T(0.5), T(0), static_cast<T>(width_ - 1));
  const T y = std::clamp(v_px * static_cast<T>(height_) / height_px - T(0.5), T(0), static_cast<T>(height_ - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, width_ - 1), y1 = std::min(y0 + 1, height_ - 1);
  const T ax = x - static_cast<T>(x0), ay = y - static_cast<T>(y0);
  const float* map = depth_.data() + static_cast<std::size_t>(camera) * texels();
  const auto seen = [&](int column, int row) { return SeenPast(depth, static_cast<T>(map[row * width_ + column])); };
  // The comparison is interpolated, not the depth: halfway to an occluder's texel the point is half seen.
  const T top = (1 - ax) * seen(x0, y0) + ax * seen(x1, y0);
  const T bottom = (1 - ax) * seen(x0, y1) + ax * seen(x1, y1);
  const T share = (1 - ay) * top + ay * bottom;
  return share < 1 ? VisibilityOf(share) : T(1);
}

float VisibilityMaps::Visibility(int camera, float u_px, float v_px, float width_px, float height_px,
                                 float depth) const {
  return VisibilityAs(camera, u_px, v_px, width_px, height_px, depth);
}

double VisibilityMaps::Visibility(int camera, double u_px, double v_px, double width_px, double height_px,
                                  double depth) const {
  return VisibilityAs(camera, u_px, v_px, width_px, height_px, depth);
}

}  // namespace lumi
