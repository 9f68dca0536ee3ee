// Triangles to pixels. A pixel belongs to a triangle whose inside its centre lies in; on an edge, to the one below or
// right of it. The crossing of an edge with a row is computed from the edge's upper end whichever triangle asks, so
// that neighbours meet without a gap and without a pixel in common.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lumi {

class TriangleRows {
 public:
  explicit TriangleRows(std::array<Eigen::Vector2f, 3> x_px) {
    std::sort(x_px.begin(), x_px.end(),
              [](const auto& a, const auto& b) { return a.y() != b.y() ? a.y() < b.y() : a.x() < b.x(); });
    for (std::size_t i = 0; i < 3; ++i) x_[i] = x_px[i].cast<double>();
  }

  // Rows that may hold pixels, of a view `height` rows high.
  std::pair<int, int> Rows(int height) const {
    const double h = height;
    return {static_cast<int>(std::clamp(std::ceil(x_[0].y() - 0.5), 0.0, h)),
            static_cast<int>(std::clamp(std::ceil(x_[2].y() - 0.5), 0.0, h))};
  }

  // Pixels [first, second) of a row within [0, width).
  std::pair<int, int> Span(int row, int width) const {
    const double y = row + 0.5;
    const double a = Crossing(0, 2, y), b = y < x_[1].y() ? Crossing(0, 1, y) : Crossing(1, 2, y);
    const double w = width;
    const auto first = [&](double x) { return static_cast<int>(std::clamp(std::ceil(x - 0.5), 0.0, w)); };
    return {first(std::min(a, b)), first(std::max(a, b))};
  }

 private:
  double Crossing(std::size_t i, std::size_t j, double y) const {
    const double d = x_[j].y() - x_[i].y();
    return d > 0 ? x_[i].x() + (y - x_[i].y()) * ((x_[j].x() - x_[i].x()) / d) : x_[i].x();
  }
  std::array<Eigen::Vector2d, 3> x_;
};

}  // namespace lumi
