// Photos of boards, rendered by inverse mapping with 3 x 3 samples a pixel, blurred by the pixel alone, with Gaussian
// noise.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "scene/model/image.h"
#include "scene/program/parallel.h"
#include "tests/calibrate/synthetic_boards.h"

namespace lumi::test {

class BoardRenderer {
 public:
  explicit BoardRenderer(const Intrinsics& k, int width_px = kWidthPx, int height_px = kHeightPx)
      : width_(width_px), height_(height_px) {
    rays_.resize(static_cast<std::size_t>(width_ * height_ * kSamples * kSamples));
    ParallelFor(static_cast<std::size_t>(height_), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
        for (int x = 0; x < width_; ++x)
          for (int s = 0; s < kSamples * kSamples; ++s) {
            const Eigen::Vector2d at(x + (s % kSamples + 0.5) / kSamples,
                                     static_cast<double>(y) + (s / kSamples + 0.5) / kSamples);
            rays_[Index(x, static_cast<int>(y), s)] = Unproject(k, at).value_or(Eigen::Vector2d(1e3, 1e3));
          }
    });
  }

  Image8 operator()(const Rigid3& cam_from_board, const Board& board = kBoard, double noise = 3,
                    unsigned seed = 1) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, noise);
    const Eigen::Matrix3d R = cam_from_board.R();
    Eigen::Matrix3d H;
    H << R.col(0), R.col(1), cam_from_board.translation;
    const Eigen::Matrix3d board_from_ray = H.inverse();
    Image8 photo(width_, height_, 3);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        double sum = 0;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const Eigen::Vector3d p = board_from_ray * rays_[Index(x, y, s)].homogeneous();
          sum += p.z() > 0 ? Colour(p.x() / p.z() / board.square_mm, p.y() / p.z() / board.square_mm, board) : kWall;
        }
        const double value = sum / (kSamples * kSamples) + normal(random);
        for (int c = 0; c < 3; ++c)
          photo.At(x, y, c) = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
      }
    return photo;
  }

 private:
  static constexpr int kSamples = 3;
  static constexpr double kWall = 150, kWhite = 225, kBlack = 35;

  // In squares, the first inner corner at the origin.
  static double Colour(double u, double v, const Board& board) {
    const double left = -1, top = -1, right = board.columns, bottom = board.rows, margin = 0.8;
    if (u < left - margin || v < top - margin || u > right + margin || v > bottom + margin) return kWall;
    if (u < left || v < top || u > right || v > bottom) return kWhite;
    return (static_cast<int>(std::floor(u)) + static_cast<int>(std::floor(v))) % 2 == 0 ? kBlack : kWhite;
  }
  std::size_t Index(int x, int y, int s) const {
    return static_cast<std::size_t>((y * width_ + x) * kSamples * kSamples + s);
  }

  int width_, height_;
  std::vector<Eigen::Vector2d> rays_;
};

}  // namespace lumi::test
