#include "render/cpu/tessellation_overlay.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace lumi {
namespace {

constexpr float kLineOpacity = 0.65F;
constexpr float kCrossPx = 5;
const Eigen::Vector3f kEdgeColor(1.0F, 1.0F, 1.0F);
const Eigen::Vector3f kEpipoleColor(1.0F, 0.15F, 0.1F);

void Over(ImageF& image, int x, int y, const Eigen::Vector3f& color, float opacity) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height || !(opacity > 0)) return;
  float* p = image.Row(y) + 4 * x;
  for (int c = 0; c < 3; ++c) p[c] += opacity * (color[c] - p[c]);
  p[3] += opacity * (1 - p[3]);
}

// Draws a line, clipped to the view: one step per pixel along its longer axis, each shared by the two pixels it runs
// between.
void Line(ImageF& image, const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector3f& color,
          float opacity) {
  const Eigen::Vector2d p = a.cast<double>(), d = b.cast<double>() - p;
  const Eigen::Vector2d size(image.width, image.height);
  double from = 0, to = 1;
  for (int k = 0; k < 2; ++k) {
    if (d[k] == 0) {
      if (p[k] < 0 || p[k] > size[k]) return;
      continue;
    }
    const double low = -p[k] / d[k], high = (size[k] - p[k]) / d[k];
    from = std::max(from, std::min(low, high));
    to = std::min(to, std::max(low, high));
  }
  if (!(from <= to)) return;
  const int major = std::abs(d.x()) >= std::abs(d.y()) ? 0 : 1;
  const double length = std::abs(d[major]) * (to - from);
  const int steps = std::max(1, static_cast<int>(std::ceil(length)));
  for (int i = 0; i <= steps; ++i) {
    // A line on the view's far border lies outside the last pixel: it is drawn inside.
    const Eigen::Vector2d x = (p + (from + (to - from) * i / steps) * d - Eigen::Vector2d(0.5, 0.5))
                                  .cwiseMax(0.0)
                                  .cwiseMin((size.array() - 1).matrix());
    const int m = static_cast<int>(std::lround(x[major])), n = static_cast<int>(std::floor(x[1 - major]));
    const auto part = static_cast<float>(x[1 - major] - n);
    for (int s = 0; s < 2; ++s)
      Over(image, major == 0 ? m : n + s, major == 0 ? n + s : m, color, opacity * (s == 0 ? 1 - part : part));
  }
}

void Crosses(const std::vector<Eigen::Vector2f>& at, ImageF& image) {
  for (const auto& e : at)
    for (const Eigen::Vector2f& d : {Eigen::Vector2f(kCrossPx, kCrossPx), Eigen::Vector2f(kCrossPx, -kCrossPx)})
      Line(image, e - d, e + d, kEpipoleColor, 1);
}

}  // namespace

void DrawTessellation(const SparseGeometry& geometry, ImageF& image) {
  std::set<std::array<float, 4>> drawn;  // triangles share edges, and facets share the image's
  for (const SparseTriangle& t : geometry.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      Eigen::Vector2f a = geometry.x_px[static_cast<std::size_t>(t.vertex[i])],
                      b = geometry.x_px[static_cast<std::size_t>(t.vertex[(i + 1) % 3])];
      if (std::pair(b.x(), b.y()) < std::pair(a.x(), a.y())) std::swap(a, b);
      if (drawn.insert({a.x(), a.y(), b.x(), b.y()}).second) Line(image, a, b, kEdgeColor, kLineOpacity);
    }
  Crosses(geometry.epipoles_px, image);
}

void DrawGrid(int columns, int rows, const std::vector<Eigen::Vector2f>& epipoles_px, ImageF& image) {
  const auto w = static_cast<float>(image.width), h = static_cast<float>(image.height);
  for (int i = 0; i < columns; ++i) {
    const float x = w * static_cast<float>(i) / static_cast<float>(columns - 1);
    Line(image, {x, 0}, {x, h}, kEdgeColor, kLineOpacity);
  }
  for (int j = 0; j < rows; ++j) {
    const float y = h * static_cast<float>(j) / static_cast<float>(rows - 1);
    Line(image, {0, y}, {w, y}, kEdgeColor, kLineOpacity);
  }
  Crosses(epipoles_px, image);
}

}  // namespace lumi
