// Frames of a textured plane under a known motion: where every point of the first frame is in each later one is exact.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "scene/program/parallel.h"
#include "scene/tracks/frame_source.h"

namespace lumi::test {

inline std::uint32_t Hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  return x ^ (x >> 16);
}

// Smooth noise of several sizes, defined everywhere, 0 ... 255.
inline double Texture(double x, double y, std::uint32_t seed = 1) {
  double sum = 0;
  constexpr double kSizes[] = {37, 13, 6.5}, kWeights[] = {0.35, 0.35, 0.3};
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double u = x / kSizes[k], v = y / kSizes[k];
    const double fu = std::floor(u), fv = std::floor(v);
    const auto at = [&](int i, int j) {
      const auto iu = static_cast<std::uint32_t>(static_cast<std::int64_t>(fu) + i),
                 iv = static_cast<std::uint32_t>(static_cast<std::int64_t>(fv) + j);
      return Hash(Hash(Hash(iu) + iv) + seed * 31 + k) / 4294967295.0;
    };
    const auto ease = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
    const double a = ease(u - fu), b = ease(v - fv);
    sum += kWeights[k] * ((1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1)));
  }
  return 255 * sum;
}

// A pixel of a frame -> where the plane's texture is read. Frame 0 need not be the identity.
using Motion = std::function<Eigen::Vector2d(int frame, const Eigen::Vector2d& x_px)>;

inline Image8 TexturedFrame(int width, int height, int frame, const Motion& plane_from_frame, double noise = 0,
                            std::uint32_t seed = 1) {
  Image8 image(width, height, 1);
  ParallelFor(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (const double dy : {0.25, 0.75})
          for (const double dx : {0.25, 0.75}) {
            const Eigen::Vector2d p = plane_from_frame(frame, {x + dx, y + dy});
            sum += Texture(p.x(), p.y(), seed) / 4;
          }
        if (noise > 0) {  // sum of four: near enough to a bell
          std::uint32_t h =
              Hash(static_cast<std::uint32_t>(frame * 7919 + y) * 104729U + static_cast<std::uint32_t>(x));
          double bell = -2;
          for (int k = 0; k < 4; ++k) bell += (h = Hash(h + 1)) / 4294967295.0;
          sum += noise * bell * std::sqrt(3.0);
        }
        image.At(x, y, 0) = static_cast<std::uint8_t>(std::clamp(sum + 0.5, 0.0, 255.0));
      }
  });
  return image;
}

inline FrameSource Frames(int count, std::function<Image8(int)> image) {
  FrameSource source;
  for (int i = 0; i < count; ++i) source.names.push_back("frame " + std::to_string(i));
  source.image = std::move(image);
  source.folder = "film";
  return source;
}
inline FrameSource TexturedFrames(int count, int width, int height, const Motion& plane_from_frame, double noise = 0) {
  return Frames(count, [=](int i) { return TexturedFrame(width, height, i, plane_from_frame, noise); });
}

}  // namespace lumi::test
