// Small videos whose period is known: things that turn before a still background, painted, with noise and exposure, by
// a camera that stands or waves. Milliseconds where ray tracing takes minutes.
#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "timeperiodic/frame_stack.h"

namespace lumi {

struct PaintedVideo {
  int width = 64, height = 48, frames = 300;
  double period = 15.37;     // frames
  double noise = 3;          // code values
  double other_blade = 0.5;  // brightness of the second blade; 1: like the first, 0: there is none
  unsigned seed = 1;
  bool moves = true;
  std::function<double(double)> turns;  // of a frame; empty: frame / period
  std::function<double(int)> gain;      // empty: 1
  std::function<Eigen::Vector2d(double)>
      camera;          // place of the camera, pixels of parallax at unit depth; empty: stands
  double texture = 1;  // of the background, 0: none

  double TurnsAt(double frame) const { return turns ? turns(frame) : frame / period; }

  Image8 Frame(int index) const {
    Image8 image(width, height, 3);
    std::mt19937 random(seed * 100003U + static_cast<unsigned>(index));
    std::normal_distribution<double> normal(0, noise);
    const double angle = 6.283185307179586 * TurnsAt(index), g = gain ? gain(index) : 1;
    const Eigen::Vector2d c = camera ? camera(index) : Eigen::Vector2d::Zero();
    // Two blades of one turning rod with round ends, at depth 1; the wall behind moves by 0.6, the floor in between.
    const Eigen::Vector2d hub(0.5 * width - c.x(), 0.5 * height - c.y());
    const double reach = 0.22 * width;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const double depth = y > 0.6 * height ? 0.6 + 0.4 * (y - 0.6 * height) / (0.4 * height) : 0.6;
        const double u = x + depth * c.x(), v = y + depth * c.y();
        const double pattern = std::sin(0.61 * u + 0.3 * v) * std::cos(0.47 * v - 0.21 * u) +
                               0.6 * std::sin(0.23 * u - 0.35 * v + 1) +
                               0.5 * std::cos(1.1 * u + 0.2) * std::sin(0.9 * v);
        double value[3] = {120 + 40 * texture * pattern, 110 + 30 * texture * pattern, 100 + 36 * texture * pattern};
        if (moves)
          for (int blade = 0; blade < 2; ++blade) {
            const double a = angle + 3.141592653589793 * blade, strength = blade == 0 ? 1 : other_blade;
            const Eigen::Vector2d end = hub + reach * Eigen::Vector2d(std::cos(a), 0.7 * std::sin(a));
            const double d2 = (Eigen::Vector2d(x, y) - end).squaredNorm();
            const double cover = strength * std::exp(-0.5 * d2 / (0.0025 * width * width));
            value[0] += 110 * cover;
            value[1] -= 60 * cover;
            value[2] += 30 * cover;
          }
        for (int k = 0; k < 3; ++k)
          image.At(x, y, k) =
              static_cast<std::uint8_t>(std::lround(std::clamp(g * value[k] + normal(random), 0.0, 255.0)));
      }
    return image;
  }

  std::vector<Image8> Frames() const {
    std::vector<Image8> all;
    for (int i = 0; i < frames; ++i) all.push_back(Frame(i));
    return all;
  }
  FrameStack Stack() const { return StackOf(Frames(), 30); }
};

}  // namespace lumi
