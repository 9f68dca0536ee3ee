// Walks through the stabiliser, as its hard cases want them.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "scene/program/error.h"
#include "stabilize/stabilize.h"
#include "tests/stabilize/walks.h"

namespace lumi::test {

constexpr double kJitterPx = 0.5;  // what is promised above 1 Hz

inline StabilizeOptions With(MotionModel model) {
  StabilizeOptions options;
  options.model = model;
  options.crop = false;
  options.min_scale = 0.2;  // the path itself, not its compromise with the picture's size
  return options;
}
inline StabilizeOptions WithObject(const Walk& walk) {
  StabilizeOptions options = With(MotionModel::kVertigo);
  options.object_px = ObjectBox(walk);
  return options;
}

inline std::vector<Matrix34d> Stabilized(const Walk& walk, const StabilizeOptions& options, const Telling& telling = {},
                                         StabilizeReport* out = nullptr) {
  StabilizeReport report;
  const auto P = InWalk(Stabilize(ReadWalk(walk, telling), options, report, SilentProgress()), telling);
  if (out) *out = report;
  for (const Matrix34d& p : P) EXPECT_TRUE(p.allFinite());
  return P;
}

// Message and exit code of a refusal; empty where there was none.
inline std::string Refused(const std::function<void()>& what, ExitCode code = ExitCode::kDataRefused) {
  try {
    what();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    EXPECT_FALSE(e.hint().empty()) << e.what();
    return e.what();
  }
  return {};
}

// Homographies as lumi-reconstruct writes them: [G | 0] and points (d, 1) on the unit sphere.
inline Walk Turning(int frames, const std::function<Eigen::Matrix3d(double u)>& meant, const Hand& hand) {
  std::vector<Eigen::Vector4d> X;
  for (const Eigen::Vector4d& x : PointsIn({-2.5, -1.2, 1}, {2.5, 1.2, 1.2}, 900, 21))
    X.push_back(Eigen::Vector3d(x.head<3>().normalized()).homogeneous());
  Hand turning = hand;
  turning.move = 0;
  Walk walk = Film(
      frames, [&](double) { return Pose{}; }, X, turning);  // the hand alone, at the world's origin
  const Eigen::Matrix3d lens = walk.ideal[0].leftCols<3>(), inverse = lens.inverse();
  for (int t = 0; t < frames; ++t) {
    const auto at = static_cast<std::size_t>(t);
    const Eigen::Matrix3d H = meant(frames > 1 ? t / (frames - 1.0) : 0),
                          shake = walk.shaky[at].leftCols<3>() * inverse;
    walk.ideal[at].leftCols<3>() = H * lens;
    walk.shaky[at].leftCols<3>() = shake * walk.ideal[at].leftCols<3>();
    for (std::size_t j = 0; j < X.size(); ++j) {
      const Eigen::Vector3d q = walk.shaky[at] * X[j];
      walk.seen[at][j] =
          q.z() > 0.1 && q.x() >= 0 && q.y() >= 0 && q.x() <= kWidthPx * q.z() && q.y() <= kHeightPx * q.z();
    }
  }
  return walk;
}
inline Eigen::Matrix3d Pan(double angle_rad) {
  Eigen::Matrix3d K;
  K << kFocalPx, 0, 320, 0, kFocalPx, 180, 0, 0, 1;
  return K * Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() * K.inverse();
}
inline Eigen::Matrix3d Zoom(double factor) {
  Eigen::Matrix3d H;
  H << factor, 0, 320 * (1 - factor), 0, factor, 180 * (1 - factor), 0, 0, 1;
  return H;
}

}  // namespace lumi::test
