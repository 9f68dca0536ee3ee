// Boards seen by a known camera: corners projected exactly, noise added; no pictures.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/intrinsics.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/rigid3.h"

namespace lumi::test {

inline constexpr int kWidthPx = 640, kHeightPx = 480;
inline const Board kBoard{9, 6, 25};

// The thesis's seven terms, all away from their resting values.
inline Intrinsics TrueIntrinsics() {
  Intrinsics k = Intrinsics::Zero();
  k[kFx] = 612.3;
  k[kAspect] = 1.013;
  k[kCx] = 331.7;
  k[kCy] = 232.1;
  k[kSkew] = 2.4;
  k[kK1] = -0.21;
  k[kK2] = 0.06;
  return k;
}

struct TruePose {
  double x, y;  // of the board's middle in the picture, -1..1
  double distance_mm;
  double tilt_x_deg, tilt_y_deg, roll_deg;
};

inline Rigid3 PoseOf(const TruePose& p, const Intrinsics& k, const Board& board = kBoard) {
  const Eigen::Quaterniond q = Eigen::AngleAxisd(p.roll_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(p.tilt_x_deg * kRadPerDeg, Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(p.tilt_y_deg * kRadPerDeg, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d middle((board.columns - 1) * board.square_mm / 2, (board.rows - 1) * board.square_mm / 2, 0);
  const Eigen::Vector3d at(p.x * kWidthPx / 2 * p.distance_mm / k[kFx], p.y * kHeightPx / 2 * p.distance_mm / k[kFx],
                           p.distance_mm);
  return {q, at - q * middle};
}

// Twelve: over the whole picture, tilted about both axes, turned.
inline std::vector<TruePose> GoodPoses() {
  return {{0, 0, 330, 5, -3, 0},          {-0.45, -0.4, 420, 28, 10, 8},   {0.45, -0.4, 420, -25, 18, -12},
          {-0.45, 0.4, 420, 12, -32, 20}, {0.45, 0.4, 420, -18, -25, 170}, {0, -0.3, 380, 35, 0, 90},
          {0.1, 0.3, 380, -35, 5, 35},    {-0.3, 0, 360, 0, 38, -40},      {0.3, 0.05, 360, 5, -38, 5},
          {-0.5, 0.1, 460, 22, 25, 60},   {0.5, -0.1, 460, -22, 27, 110},  {0.05, 0, 340, 30, -30, -75}};
}

inline BoardView Seen(const Rigid3& cam_from_board, const Intrinsics& k, const std::string& name,
                      const Board& board = kBoard) {
  BoardView view{name, {}, {}};
  for (const Eigen::Vector2d& x : board.Corners())
    view.corners_px.push_back(ProjectNormalized(k, (cam_from_board * Eigen::Vector3d(x.x(), x.y(), 0)).hnormalized()));
  return view;
}

inline std::vector<BoardView> SeenBoards(const Intrinsics& k, const std::vector<TruePose>& poses, double noise_px = 0,
                                         unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    views.push_back(Seen(PoseOf(poses[i], k), k, "view" + std::to_string(i)));
    for (auto& c : views.back().corners_px) c += noise_px * Eigen::Vector2d(noise(random), noise(random));
  }
  return views;
}

}  // namespace lumi::test
