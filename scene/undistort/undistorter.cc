#include "scene/undistort/undistorter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/files/opencv_pixels.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Borders where the polynomial has no inverse are moved in by steps of 1 % of the way to the principal point.
Eigen::Vector2d BorderPoint(const PlumbBobCamera& k, const Eigen::Vector2d& border_px) {
  const Eigen::Vector2d c(k.cx, k.cy);
  for (int percent = 100; percent > 0; --percent)
    if (const auto x = Unproject(k, c + percent / 100.0 * (border_px - c))) return *x;
  return Eigen::Vector2d::Zero();
}

}  // namespace

Camera PinholeInside(const PlumbBobCamera& k) {
  const double w = k.width_px, h = k.height_px;
  double left = -1e9, right = 1e9, top = -1e9, bottom = 1e9;
  constexpr int kSamples = 256;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = static_cast<double>(i) / kSamples;
    left = std::max(left, BorderPoint(k, {0, t * h}).x());
    right = std::min(right, BorderPoint(k, {w, t * h}).x());
    top = std::max(top, BorderPoint(k, {t * w, 0}).y());
    bottom = std::min(bottom, BorderPoint(k, {t * w, h}).y());
  }
  if (!(right - left > 1e-6) || !(bottom - top > 1e-6)) throw DataError("the lens distortion leaves no picture to undistort");
  // One factor on both focal lengths: an image window of the photo's size inside the rectangle.
  const double scale = std::max(w / ((right - left) * k.fx), h / ((bottom - top) * k.fy));
  const double fx = scale * k.fx, fy = scale * k.fy;
  const auto place = [](double old, double low, double high) { return low <= high ? std::clamp(old, low, high) : (low + high) / 2; };
  return Camera::Pinhole(k.width_px, k.height_px, fx, fy, place(k.cx, w - right * fx, -left * fx), place(k.cy, h - bottom * fy, -top * fy));
}

Undistorter::Undistorter(const PlumbBobCamera& camera, const Camera& pinhole)
    : width_(pinhole.width_px), height_(pinhole.height_px), source_width_(camera.width_px), source_height_(camera.height_px) {
  const Eigen::Vector2d f = pinhole.FocalPx(), c = pinhole.PrincipalPointPx();
  x_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  y_.resize(x_.size());
  ParallelFor(static_cast<std::size_t>(height_), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
      for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x) {
        const Eigen::Vector2d pixel(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        const Eigen::Vector2d source = ToOpenCvPixel(Project(camera, (pixel - c).cwiseQuotient(f)));
        x_[y * static_cast<std::size_t>(width_) + x] = static_cast<float>(source.x());
        y_[y * static_cast<std::size_t>(width_) + x] = static_cast<float>(source.y());
      }
  });
}

Image8 Undistorter::operator()(const Image8& photo) const {
  Image8 result(width_, height_, photo.channels);
  const cv::Mat source(photo.height, photo.width, CV_8UC(photo.channels), const_cast<std::uint8_t*>(photo.data.data()));
  const cv::Mat x(height_, width_, CV_32F, const_cast<float*>(x_.data())), y(height_, width_, CV_32F, const_cast<float*>(y_.data()));
  cv::Mat target(height_, width_, CV_8UC(photo.channels), result.data.data());
  cv::remap(source, target, x, y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return result;
}

Image8 Undistorter::Mask(const Image8& mask) const {
  Image8 result(width_, height_, 1);
  const double sx = static_cast<double>(mask.width) / source_width_, sy = static_cast<double>(mask.height) / source_height_;
  ParallelFor(static_cast<std::size_t>(height_), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
        const Eigen::Vector2d source = FromOpenCvPixel({x_[i], y_[i]});
        const int u = static_cast<int>(std::floor(sx * source.x())), v = static_cast<int>(std::floor(sy * source.y()));
        if (u >= 0 && v >= 0 && u < mask.width && v < mask.height) result.At(x, y, 0) = mask.At(u, v, 0);
      }
  });
  return result;
}

}  // namespace lumi
