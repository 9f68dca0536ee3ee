// The camera that is calibrated: the thesis's five intrinsics (Sec. 2.2.2), OpenCV's distortion (undistorted to
// distorted: the inverse of the direction the thesis writes in Sec. 2.2.3), and which of its terms a model leaves free.
//
//   const Eigen::Vector2d x_px = ProjectNormalized(intrinsics, {X / Z, Y / Z});
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/camera.h"
#include "scene/model/distortion.h"

namespace lumi {

// Order of the numbers. fy is kept as aspect = fy / fx, so that an aspect can be held.
enum Term : int { kFx, kAspect, kCx, kCy, kSkew, kK1, kK2, kP1, kP2, kK3, kTermCount };

// fx, aspect, cx, cy, skew in pixels (centre of the first pixel at (0.5, 0.5)), aspect and distortion without unit.
using Intrinsics = Eigen::Matrix<double, kTermCount, 1>;
using TermMatrix = Eigen::Matrix<double, kTermCount, kTermCount>;

inline Intrinsics NominalIntrinsics(double f_px, int width_px, int height_px) {
  Intrinsics k = Intrinsics::Zero();
  k[kFx] = f_px;
  k[kAspect] = 1;
  k[kCx] = width_px / 2.0;
  k[kCy] = height_px / 2.0;
  return k;
}

// Of a point (x, y) on the plane z = 1: its pixel. T: double or ceres::Jet.
template <typename T>
void ProjectNormalized(const T* k, const T& x, const T& y, T* pixel) {
  const Eigen::Matrix<T, 2, 1> d =
      Distort(DistortionTerms<T>{k[kK1], k[kK2], k[kP1], k[kP2], k[kK3]}, Eigen::Matrix<T, 2, 1>(x, y));
  pixel[0] = k[kFx] * d[0] + k[kSkew] * d[1] + k[kCx];
  pixel[1] = k[kFx] * k[kAspect] * d[1] + k[kCy];
}
Eigen::Vector2d ProjectNormalized(const Intrinsics& k, const Eigen::Vector2d& x);

// The point on z = 1 that is seen at a pixel; nullopt beyond the fold of the polynomial.
std::optional<Eigen::Vector2d> Unproject(const Intrinsics& k, const Eigen::Vector2d& pixel);

Camera CameraOf(const Intrinsics& k, int width_px, int height_px);  // kPlumbBob

// Free terms; the others are held (aspect at 1 or as given, the rest at 0).
struct LensModel {
  std::string name;
  std::array<bool, kTermCount> free{};
  int FreeCount() const;
};

// PIXELS-DISTORTION: square (f), rect (fx fy), skew (fx fy skew), each with none, k1, k1k2, k1k2p, k1k2k3, k1k2pk3.
// From few terms to many. "thesis" is skew-k1k2. fixed_aspect leaves out what frees the aspect: square models only.
std::vector<LensModel> LensModels(bool fixed_aspect = false);
std::optional<LensModel> LensModelFromName(const std::string& name);
// The one with every term free.
LensModel FullestModel(bool fixed_aspect = false);

}  // namespace lumi
