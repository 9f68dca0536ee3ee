// What cameras round a few points that wander see move.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "reconstruct/epipolar_synchronise.h"

namespace lumi {

// `places`: of the cameras; each sees the points at frame + start. What it sees of their motion depends on where it
// stands: they turn, and each camera sees most of them change when they face it, one after the other.
inline std::vector<WatchedMotion> Watched(const std::vector<Eigen::Vector3d>& places, const std::vector<int>& starts,
                                          std::uint32_t seed, bool moving = true) {
  constexpr int kFramesLong = 60, kPixels = 240, kRows = 180;
  const Camera camera = Camera::Pinhole(kPixels, kRows, 280, 280, kPixels / 2.0, kRows / 2.0);
  std::mt19937 random(seed);
  std::normal_distribution<double> n(0, 1);
  constexpr int kPoints = 12;
  std::vector<std::vector<Eigen::Vector3d>> at(kPoints);  // by frame of the common clock
  for (auto& point : at) {
    Eigen::Vector3d x = 0.4 * Eigen::Vector3d(n(random), n(random), 0.5 * n(random)), v = Eigen::Vector3d::Zero();
    for (int t = 0; t < 200; ++t) {
      v = 0.85 * v + 0.01 * Eigen::Vector3d(n(random), n(random), n(random));
      point.push_back(x += v - 0.02 * x);
    }
  }
  std::vector<WatchedMotion> videos;
  for (std::size_t c = 0; c < places.size(); ++c) {
    WatchedMotion video{camera, LookAt(places[c], {0, 0, 0}, {0, 0, 1}), {}, {}};
    for (int i = 0; i < kFramesLong; ++i) {
      auto& changed = video.change.emplace_back();
      auto& foreground = video.foreground.emplace_back();
      if (i == 0 || !moving) continue;
      for (int p = 0; p < kPoints; ++p) {
        const auto t = static_cast<std::size_t>(i + starts[c]);
        const Eigen::Vector3d x = at[static_cast<std::size_t>(p)][t], before = at[static_cast<std::size_t>(p)][t - 1];
        const auto now = camera.Project(video.cam_from_world * x), then = camera.Project(video.cam_from_world * before);
        const double facing = std::cos(std::atan2(places[c].y(), places[c].x()) + 0.1 * static_cast<double>(t));
        if (!now || !then || facing < -0.7) continue;
        const int u = static_cast<int>(now->x()), v = static_cast<int>(now->y());
        for (int dy = -2; dy <= 2; ++dy)
          for (int dx = -2; dx <= 2; ++dx)
            if (u + dx >= 0 && v + dy >= 0 && u + dx < kPixels && v + dy < kRows) {
              foreground.emplace_back((v + dy) * kPixels + u + dx, static_cast<float>(10 * (1 + facing)));
              changed.emplace_back((v + dy) * kPixels + u + dx,
                                   static_cast<float>(5 * (*now - *then).norm() + 15 * (1 + facing)));
            }
      }
    }
    videos.push_back(std::move(video));
  }
  return videos;
}

inline std::vector<Eigen::Vector3d> Arc(int cameras) {
  std::vector<Eigen::Vector3d> places;
  for (int c = 0; c < cameras; ++c)
    places.emplace_back(3 * std::sin(0.25 * c - 0.6), -3 * std::cos(0.25 * c - 0.6), 0.8 + 0.15 * (c % 2));
  return places;
}

}  // namespace lumi
