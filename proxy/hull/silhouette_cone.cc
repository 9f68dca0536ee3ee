#include "proxy/hull/silhouette_cone.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace lumi {
namespace {

constexpr int kMargin =
    48;  // pixels around the image in which distances are exact; beyond they are bounded by the triangle inequality

// A difference between neighbouring pixels is at most 1 along each axis, so the interpolated distance may rise by this
// much a pixel.
constexpr double kSteepest = 1.4142135623730951;

}  // namespace

std::size_t CountObject(const Image8& mask) {
  return static_cast<std::size_t>(std::ranges::count_if(mask.data, [](std::uint8_t m) { return m >= 128; }));
}

SilhouetteCone::SilhouetteCone(const SilhouetteView& view, const Eigen::Vector3d& origin, double unit)
    : width_(view.mask.width), height_(view.mask.height), stride_(width_ + 2 * kMargin), rows_(height_ + 2 * kMargin) {
  Matrix34d P;
  P.leftCols<3>() = view.P.leftCols<3>() * unit;
  P.col(3) = view.P.leftCols<3>() * origin + view.P.col(3);
  P /= P.block<1, 3>(2, 0).norm();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) p_[static_cast<std::size_t>(r * 4 + c)] = P(r, c);

  const auto object = [&](int x, int y) { return view.mask.At(x, y, 0) >= 128; };
  open_ = {};
  for (int y = 0; y < height_; ++y) {
    open_[0] = open_[0] || object(0, y);
    open_[2] = open_[2] || object(width_ - 1, y);
  }
  for (int x = 0; x < width_; ++x) {
    open_[1] = open_[1] || object(x, 0);
    open_[3] = open_[3] || object(x, height_ - 1);
  }
  cv::Mat inside(rows_, stride_, CV_8U), outside;
  for (int y = -kMargin; y < height_ + kMargin; ++y) {
    std::uint8_t* row = inside.ptr<std::uint8_t>(y + kMargin);
    for (int x = -kMargin; x < width_ + kMargin; ++x) {
      const bool beyond_open =
          (x < 0 && open_[0]) || (y < 0 && open_[1]) || (x >= width_ && open_[2]) || (y >= height_ && open_[3]);
      const bool within = x >= 0 && y >= 0 && x < width_ && y < height_;
      row[x + kMargin] = beyond_open || (within && object(x, y)) ? 255 : 0;
    }
  }
  cv::bitwise_not(inside, outside);
  cv::Mat to_outside, to_inside;
  cv::distanceTransform(inside, to_outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(outside, to_inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  // Between the centres of two pixels, one of the object and one not, runs the border.
  distance_.resize(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(stride_));
  for (int y = 0; y < rows_; ++y) {
    const float* out = to_outside.ptr<float>(y);
    const float* in = to_inside.ptr<float>(y);
    float* to = distance_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_);
    for (int x = 0; x < stride_; ++x) to[x] = in[x] > 0 ? in[x] - 0.5F : 0.5F - out[x];
  }
}

float SilhouetteCone::AtPixel(double u, double v) const {
  const double x = u - 0.5 + kMargin, y = v - 0.5 + kMargin;
  const double x_in = std::clamp(x, 0.0, static_cast<double>(stride_ - 1)),
               y_in = std::clamp(y, 0.0, static_cast<double>(rows_ - 1));
  const int i = std::min(static_cast<int>(x_in), stride_ - 2), j = std::min(static_cast<int>(y_in), rows_ - 2);
  const auto a = static_cast<float>(x_in - i), b = static_cast<float>(y_in - j);
  const float* at = distance_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(stride_) + i;
  const float top = at[0] + a * (at[1] - at[0]), bottom = at[stride_] + a * (at[stride_ + 1] - at[stride_]);
  const float d = top + b * (bottom - top);
  if (x == x_in && y == y_in) return d;
  // Beyond the margin: further from the object, or as far within what is open.
  if (d <= 0) return d;
  return d + static_cast<float>(std::min(std::hypot(x - x_in, y - y_in), 1e5));
}

float SilhouetteCone::FrameDistance(const Eigen::Vector3d& x) const {
  const double w = p_[8] * x[0] + p_[9] * x[1] + p_[10] * x[2] + p_[11];
  if (!(w > kNearest)) return kBehind;
  const double u = (p_[0] * x[0] + p_[1] * x[1] + p_[2] * x[2] + p_[3]) / w,
               v = (p_[4] * x[0] + p_[5] * x[1] + p_[6] * x[2] + p_[7]) / w;
  return static_cast<float>(std::clamp(std::max({-u, -v, u - width_, v - height_}), -1e5, 1e5));
}

namespace {

// Largest singular value of the 2x3 matrix of rows a and b.
double SpectralNorm(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double aa = a.squaredNorm(), bb = b.squaredNorm(), ab = a.dot(b);
  return std::sqrt(0.5 * (aa + bb + std::hypot(aa - bb, 2 * ab)));
}

}  // namespace

double SilhouetteCone::PixelsPerUnit(const Eigen::Vector3d& x) const {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> P(p_.data());
  const Eigen::Vector3d s = P * x.homogeneous();
  if (!(s.z() > kNearest)) return 0;
  const Eigen::Vector3d a = P.block<1, 3>(0, 0) - s.x() / s.z() * P.block<1, 3>(2, 0);
  const Eigen::Vector3d b = P.block<1, 3>(1, 0) - s.y() / s.z() * P.block<1, 3>(2, 0);
  return SpectralNorm(a, b) / s.z();
}

SilhouetteCone::Range SilhouetteCone::Bounds(const Eigen::Vector3d& centre, double radius) const {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> P(p_.data());
  const Eigen::Vector3d s = P * centre.homogeneous();
  if (s.z() <= -radius) return {kBehind, kBehind};
  if (s.z() - radius <= kNearest) return {-std::numeric_limits<float>::infinity(), kBehind};
  // x' - x = (m - x m3) dX / w', the rows m of P's left block: exact, no linearisation.
  const double u = s.x() / s.z(), v = s.y() / s.z();
  const Eigen::Vector3d a = P.block<1, 3>(0, 0) - u * P.block<1, 3>(2, 0),
                        b = P.block<1, 3>(1, 0) - v * P.block<1, 3>(2, 0);
  const auto reach = static_cast<float>(std::min(kSteepest * SpectralNorm(a, b) * radius / (s.z() - radius), 1e6));
  const float d = AtPixel(u, v);
  return {d - reach, d + reach};
}

}  // namespace lumi
