// Videos of a textured plane, each frame through a homography that is known.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>

#include "scene/files/video.h"
#include "scene/model/image.h"

namespace lumi::score {

// 0 to 1, detail of about `size` units, everywhere.
inline double ValueNoise(double x, double y, double size, std::uint32_t seed) {
  const double u = x / size, v = y / size, fu = std::floor(u), fv = std::floor(v);
  const auto at = [&](double a, double b) {
    std::uint32_t h = static_cast<std::uint32_t>(static_cast<std::int32_t>(a)) * 0x9E3779B1U ^
                      static_cast<std::uint32_t>(static_cast<std::int32_t>(b)) * 0x85EBCA77U ^ seed * 0xC2B2AE3DU;
    h = (h ^ (h >> 15)) * 0x2C1B3C6DU;
    h = (h ^ (h >> 12)) * 0x297A2D39U;
    return ((h ^ (h >> 15)) >> 8) / 16777216.0;
  };
  const double s = u - fu, t = v - fv, a = s * s * (3 - 2 * s), b = t * t * (3 - 2 * t);
  return (1 - b) * ((1 - a) * at(fu, fv) + a * at(fu + 1, fv)) +
         b * ((1 - a) * at(fu, fv + 1) + a * at(fu + 1, fv + 1));
}

inline Eigen::Matrix3d Shift(double x, double y) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
  H.topRightCorner<2, 1>() << x, y;
  return H;
}

struct PaintedPlane {
  int width = 192, height = 144, frames = 120;
  double fps = 30;
  double noise = 1;     // code values
  double contrast = 1;  // 0: no texture
  std::function<Eigen::Matrix3d(int)> frame_from_plane = [](int) { return Eigen::Matrix3d::Identity(); };  // pixels
  std::function<std::uint32_t(int)> world = [](int) { return 1U; };  // another number, another texture: a cut
  std::function<bool(int, double, double)>
      elsewhere;  // pixels (of frame, at x, y) that show another texture, moving by 3 px a frame

  Image8 Frame(int index) const {
    Image8 image(width, height, 3);
    const Eigen::Matrix3d plane = frame_from_plane(index).inverse();
    std::mt19937 random(static_cast<unsigned>(index) + 77U);
    std::normal_distribution<double> normal(0, 1);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        Eigen::Vector2d p = (plane * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).hnormalized();
        std::uint32_t seed = world(index);
        if (elsewhere && elsewhere(index, x + 0.5, y + 0.5)) {
          p = {x - 3.0 * index, y + 0.8 * index};
          seed += 100;
        }
        const double v = 0.55 * ValueNoise(p.x(), p.y(), 15, seed) + 0.45 * ValueNoise(p.x(), p.y(), 6, seed + 1);
        const double value = 128 + 200 * contrast * (v - 0.5) + (noise > 0 ? noise * normal(random) : 0);
        for (int k = 0; k < 3; ++k)
          image.At(x, y, k) = static_cast<std::uint8_t>(std::clamp(value * (1 - 0.1 * k), 0.0, 255.0));
      }
    return image;
  }
  std::filesystem::path Write(const std::filesystem::path& path) const {
    VideoWriter writer(path, fps);
    for (int i = 0; i < frames; ++i) writer.Add(Frame(i));
    writer.Finish();
    return path;
  }
};

}  // namespace lumi::score
