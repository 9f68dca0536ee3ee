#include "stabilize/view_area.h"

#include <algorithm>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kSamplesASide = 41;
constexpr int kHalvings = 12;

using Polygon = std::vector<Eigen::Vector2d>;

bool Inside(const Polygon& polygon, const Eigen::Vector2d& x) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[j];
    if ((a.y() > x.y()) != (b.y() > x.y()) && x.x() < (b.x() - a.x()) * (x.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

// Pictures count as a little larger than they are: a pixel that is half seen counts as seen.
constexpr double kGrown = 1.002;

}  // namespace

std::vector<double> ViewScales(const FilmedScene& film, const std::vector<Matrix34d>& P,
                               const ViewAreaOptions& options) {
  const auto n = static_cast<std::ptrdiff_t>(film.frames.size());
  const Eigen::Vector2d half = film.half();
  std::vector<double> scales(film.frames.size(), options.least);
  ParallelEach(film.frames.size(), 8, [&](std::size_t t) {
    std::vector<Polygon> seen;
    const auto at = static_cast<std::ptrdiff_t>(t);
    for (std::ptrdiff_t s = std::max<std::ptrdiff_t>(0, at - options.half_window);
         s <= std::min(n - 1, at + options.half_window); ++s) {
      Polygon polygon;
      bool whole = true;
      for (const Eigen::Vector4d& X : film.frames[static_cast<std::size_t>(s)].border) {
        const Eigen::Vector3d q = P[t] * X;
        whole = whole && q.z() > 1e-9;
        if (whole) polygon.push_back(kGrown * q.head<2>() / q.z());
      }
      if (whole && polygon.size() >= 3) seen.push_back(std::move(polygon));
    }
    // A frame without points has no known depth: only its own picture is taken to fill it.
    if (seen.empty()) {
      scales[t] = film.frames[t].border.empty() ? 1 : options.least;
      return;
    }
    const auto all_seen = [&](double scale) {
      for (int i = 0; i < 4 * kSamplesASide; ++i) {
        const double u = 2.0 * (i % kSamplesASide) / kSamplesASide - 1;
        const Eigen::Vector2d on[4] = {{u, -1}, {1, u}, {-u, 1}, {-1, -u}};
        const Eigen::Vector2d x = scale * on[i / kSamplesASide].cwiseProduct(half);
        if (std::ranges::none_of(seen, [&](const Polygon& p) { return Inside(p, x); })) return false;
      }
      return true;
    };
    if (all_seen(1)) {
      scales[t] = 1;
      return;
    }
    double low = options.least, high = 1;
    for (int i = 0; i < kHalvings; ++i) (all_seen(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    scales[t] = low;
  });
  return scales;
}

Matrix34d CroppedTo(const Matrix34d& P, double scale) {
  Matrix34d zoomed = P;
  zoomed.topRows<2>() /= scale;
  return zoomed / zoomed.norm();
}

Matrix34d CroppedInPixels(const Matrix34d& P_px, const Eigen::Vector2i& size_px, double scale) {
  Matrix34d zoomed = P_px;
  zoomed.topRows<2>() = P_px.topRows<2>() / scale + (1 - 1 / scale) * 0.5 * size_px.cast<double>() * P_px.row(2);
  return zoomed;
}

}  // namespace lumi
