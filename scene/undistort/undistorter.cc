#include "scene/undistort/undistorter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/files/opencv_pixels.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

Eigen::Vector2d BorderPoint(const RayOfPixel& ray, const Eigen::Vector2d& c, const Eigen::Vector2d& border_px) {
  const auto at = [&](double t) { return ray(c + t * (border_px - c)); };
  if (const auto x = at(1)) return *x;
  double inside = 0, outside = 1;
  for (int i = 0; i < 40; ++i) (at((inside + outside) / 2) ? inside : outside) = (inside + outside) / 2;
  return at(inside).value_or(Eigen::Vector2d::Zero());
}

}  // namespace

Camera PinholeInside(const Eigen::Vector2i& size_px, const Eigen::Vector2d& f, const Eigen::Vector2d& c,
                     const RayOfPixel& ray) {
  // The largest upright rectangle on z = 1 that no border of the photo cuts into.
  double left = -1e9, right = 1e9, top = -1e9, bottom = 1e9;
  const double w = size_px.x(), h = size_px.y();
  constexpr int kSamples = 512;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = static_cast<double>(i) / kSamples;
    left = std::max(left, BorderPoint(ray, c, {0, t * h}).x());
    right = std::min(right, BorderPoint(ray, c, {w, t * h}).x());
    top = std::max(top, BorderPoint(ray, c, {t * w, 0}).y());
    bottom = std::min(bottom, BorderPoint(ray, c, {t * w, h}).y());
  }
  if (!(right - left > 1e-6) || !(bottom - top > 1e-6))
    throw DataError("the lens distortion of a camera leaves no image to undistort",
                    "check the camera's distortion parameters");
  const double scale = std::max(w / ((right - left) * f.x()), h / ((bottom - top) * f.y()));
  const double fx = scale * f.x(), fy = scale * f.y();
  // The window [-c, size - c] / f inside the rectangle, the principal point as near to the old one as that allows.
  const auto place = [](double old, double low, double high) {
    return low <= high ? std::clamp(old, low, high) : (low + high) / 2;
  };
  return Camera::Pinhole(size_px.x(), size_px.y(), fx, fy, place(c.x(), w - right * fx, -left * fx),
                         place(c.y(), h - bottom * fy, -top * fy));
}

Camera PinholeInside(const Camera& camera) {
  return PinholeInside({camera.width_px, camera.height_px}, camera.FocalPx(), camera.PrincipalPointPx(),
                       [&](const Eigen::Vector2d& x_px) { return camera.Normalized(x_px); });
}

Undistorter::Undistorter(const Camera& camera, const Camera& pinhole)
    : width_(pinhole.width_px),
      height_(pinhole.height_px),
      source_width_(camera.width_px),
      source_height_(camera.height_px) {
  const Eigen::Vector2d f = pinhole.FocalPx(), c = pinhole.PrincipalPointPx();
  x_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  y_.resize(x_.size());
  ParallelEach(static_cast<std::size_t>(height_), 16, [&](std::size_t y) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x) {
      const Eigen::Vector2d pixel(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      const Eigen::Vector2d source = ToOpenCvPixel(*camera.Project((pixel - c).cwiseQuotient(f).homogeneous()));
      x_[y * static_cast<std::size_t>(width_) + x] = static_cast<float>(source.x());
      y_[y * static_cast<std::size_t>(width_) + x] = static_cast<float>(source.y());
    }
  });
}

Image8 Undistorter::operator()(const Image8& photo) const {
  Image8 result(width_, height_, photo.channels);
  const cv::Mat source(photo.height, photo.width, CV_8UC(photo.channels), const_cast<std::uint8_t*>(photo.data.data()));
  const cv::Mat x(height_, width_, CV_32F, const_cast<float*>(x_.data())),
      y(height_, width_, CV_32F, const_cast<float*>(y_.data()));
  cv::Mat target(height_, width_, CV_8UC(photo.channels), result.data.data());
  cv::remap(source, target, x, y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return result;
}

Image8 Undistorter::Mask(const Image8& mask) const {
  Image8 result(width_, height_, 1);
  const double sx = static_cast<double>(mask.width) / source_width_,
               sy = static_cast<double>(mask.height) / source_height_;
  ParallelFor(static_cast<std::size_t>(height_), 16, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
        const Eigen::Vector2d source = FromOpenCvPixel({x_[i], y_[i]});
        const int u = static_cast<int>(std::floor(sx * source.x())), v = static_cast<int>(std::floor(sy * source.y()));
        if (u >= 0 && v >= 0 && u < mask.width && v < mask.height) result.At(x, y, 0) = mask.At(u, v, 0);
      }
  });
  return result;
}

}  // namespace lumi
