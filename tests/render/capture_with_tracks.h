// A capture whose points have tracks, and photos of it as another camera would have shown their colours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "capture.h"

namespace lumi::test {

// Points on the front of a capture's proxy, with tracks through the photos that see them.
inline Capture CaptureWithTracks(int views = 16, int width = 160) {
  Capture c = MakeCapture(views, width);
  const int height = width * 3 / 4;
  std::mt19937 engine(2);
  std::uniform_real_distribution<double> u(-1, 1);
  c.scene.points.clear();
  for (int i = 0; i < 600; ++i) {
    Point p;
    p.x_in_world = {2.5 * u(engine), 2 * u(engine), 3};
    for (std::size_t v = 0; v < c.scene.views.size(); ++v) {
      const RenderView view = MakeRenderView(c.scene, c.scene.views[v]);
      const auto x = Project(view.P, p.x_in_world);
      if (!x || x->minCoeff() < 2 || x->x() > width - 2 || x->y() > height - 2) continue;
      const Eigen::Vector3d d = (p.x_in_world - view.centre).normalized();
      if (HitDistance(c.proxy, view.centre, d) < (p.x_in_world - view.centre).norm() - 1e-6) continue;
      p.track.push_back({{static_cast<int>(v)}, *x});
    }
    if (p.track.size() >= 2) c.scene.points.push_back(p);
  }
  return c;
}

// A lens that loses so much of the light in its corners, on code values; r2: squared distance from the middle over the
// corner's.
inline double LensFalloff(double share_lost, double r2) { return std::pow(1 - share_lost * r2, 1 / 2.2); }

// Every colour times these factors and the lens's. Kept below white.
inline void ShowAs(const std::array<double, 3>& factor, double share_lost, Photo& photo) {
  Image8 image = photo.levels.front();
  const double corner2 = 0.25 * (image.width * image.width + image.height * image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double dx = x + 0.5 - 0.5 * image.width, dy = y + 0.5 - 0.5 * image.height;
      const double lens = LensFalloff(share_lost, (dx * dx + dy * dy) / corner2);
      for (int c = 0; c < 3; ++c)
        image.At(x, y, c) = static_cast<std::uint8_t>(
            std::lround(std::min(255.0, image.At(x, y, c) * factor[static_cast<std::size_t>(c)] * lens)));
    }
  photo.levels = BuildPyramid(image);
}

// White balance of a photo of a drift: red up, blue down.
inline std::array<double, 3> Drifted(std::size_t photo) {
  const double red = std::exp(0.08 * std::sin(2.0 * static_cast<double>(photo)));
  return {0.9 * red, 0.9, 0.9 / red};
}

}  // namespace lumi::test
