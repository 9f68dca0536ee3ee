#include "render/radiance/sparse/hidden.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "render/radiance/sparse/raster.h"

namespace lumi {
namespace {

constexpr int kHiddenBandRows = 32;
constexpr float kNearEnough = 0.99F;

// 1 / depth over a triangle's pixels.
struct InverseDepth {
  double x0, y0, at, dx, dy;
  float operator()(int x, int y) const { return static_cast<float>(at + dx * (x + 0.5 - x0) + dy * (y + 0.5 - y0)); }
};

class Buffer {
 public:
  Buffer(const ViewSetup& setup, const SparseGeometry& g) : g_(g), size_(setup.desired.size_px) {
    const Eigen::RowVector3f axis = setup.desired.P.row(2).head<3>().cast<float>();
    inverse_depth_.reserve(g.offset.size());
    for (const auto& o : g.offset) inverse_depth_.push_back(1 / axis.dot(o));
    bands_ = (size_.y() + kHiddenBandRows - 1) / kHiddenBandRows;
    first_.assign(static_cast<std::size_t>(bands_) + 1, 0);
    const auto range = [&](const SparseTriangle& t) {
      float low = X(t, 0).y(), high = low;
      for (std::size_t i = 1; i < 3; ++i) {
        low = std::min(low, X(t, i).y());
        high = std::max(high, X(t, i).y());
      }
      const auto band = [&](float y) {
        return static_cast<int>(std::clamp(std::floor(y / kHiddenBandRows), 0.0F, static_cast<float>(bands_ - 1)));
      };
      return std::pair(band(low), band(high));
    };
    for (const SparseTriangle& t : g.triangles)
      for (auto [b, last] = range(t); b <= last; ++b) ++first_[static_cast<std::size_t>(b) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    in_band_.resize(static_cast<std::size_t>(first_.back()));
    std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < g.triangles.size(); ++t)
      for (auto [b, last] = range(g.triangles[t]); b <= last; ++b)
        in_band_[static_cast<std::size_t>(next[static_cast<std::size_t>(b)]++)] = static_cast<std::int32_t>(t);
  }

  int bands() const { return bands_; }

  // Triangles of a band that are seen there.
  void Seen(int band, std::vector<float>& nearest, std::vector<std::int32_t>& out) const {
    const int begin = band * kHiddenBandRows, end = std::min(size_.y(), begin + kHiddenBandRows);
    nearest.assign(static_cast<std::size_t>((end - begin) * size_.x()), 0.0F);
    const auto from = static_cast<std::size_t>(first_[static_cast<std::size_t>(band)]),
               to = static_cast<std::size_t>(first_[static_cast<std::size_t>(band) + 1]);
    const auto at = [&](int x, int y) -> float& {
      return nearest[static_cast<std::size_t>((y - begin) * size_.x() + x)];
    };
    const auto rows = [&](const SparseTriangle& t, auto&& body) {
      InverseDepth z;
      if (!Plane(t, z)) return;
      const TriangleRows r({X(t, 0), X(t, 1), X(t, 2)});
      const auto [low, high] = r.Rows(size_.y());
      for (int y = std::max(low, begin); y < std::min(high, end); ++y) {
        const auto [x0, x1] = r.Span(y, size_.x());
        if (x0 < x1 && !body(z, y, x0, x1)) return;
      }
    };
    for (std::size_t i = from; i < to; ++i)
      rows(g_.triangles[static_cast<std::size_t>(in_band_[i])], [&](const InverseDepth& z, int y, int x0, int x1) {
        for (int x = x0; x < x1; ++x) at(x, y) = std::max(at(x, y), z(x, y));
        return true;
      });
    for (std::size_t i = from; i < to; ++i) {
      const SparseTriangle& t = g_.triangles[static_cast<std::size_t>(in_band_[i])];
      bool any = false, seen = false;
      rows(t, [&](const InverseDepth& z, int y, int x0, int x1) {
        any = true;
        for (int x = x0; x < x1 && !seen; ++x) seen = z(x, y) >= kNearEnough * at(x, y);
        return !seen;
      });
      // Between pixels' centres: by the pixel that a corner lies in.
      for (std::size_t k = 0; k < 3 && !any && !seen; ++k) {
        const auto pixel = [](float v, int side) {
          return static_cast<int>(std::floor(std::clamp(v, -1.0F, static_cast<float>(side) + 1.0F)));
        };
        const int x = pixel(X(t, k).x(), size_.x()), y = pixel(X(t, k).y(), size_.y());
        seen = x >= 0 && x < size_.x() && y >= begin && y < end && Z(t, k) >= kNearEnough * at(x, y);
      }
      if (seen) out.push_back(in_band_[i]);
    }
  }

 private:
  const Eigen::Vector2f& X(const SparseTriangle& t, std::size_t i) const {
    return g_.x_px[static_cast<std::size_t>(t.vertex[i])];
  }
  float Z(const SparseTriangle& t, std::size_t i) const {
    return inverse_depth_[static_cast<std::size_t>(t.vertex[i])];
  }

  bool Plane(const SparseTriangle& t, InverseDepth& out) const {
    const Eigen::Vector2d d1 = (X(t, 1) - X(t, 0)).cast<double>(), d2 = (X(t, 2) - X(t, 0)).cast<double>();
    const double area = d1.x() * d2.y() - d1.y() * d2.x(), z1 = Z(t, 1) - Z(t, 0), z2 = Z(t, 2) - Z(t, 0);
    if (!(std::abs(area) > 0)) return false;
    out = {X(t, 0).x(), X(t, 0).y(), Z(t, 0), (z1 * d2.y() - z2 * d1.y()) / area, (z2 * d1.x() - z1 * d2.x()) / area};
    return std::isfinite(out.dx) && std::isfinite(out.dy);
  }

  const SparseGeometry& g_;
  const Eigen::Vector2i size_;
  int bands_ = 0;
  std::vector<float> inverse_depth_;
  std::vector<std::int32_t> first_, in_band_;
};

}  // namespace

void DropHidden(const ViewSetup& setup, const ForRanges& for_ranges, SparseGeometry& g) {
  const Buffer buffer(setup, g);
  std::vector<std::vector<std::int32_t>> seen(static_cast<std::size_t>(buffer.bands()));
  for_ranges(seen.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> nearest;
    for (std::size_t b = begin; b < end; ++b) buffer.Seen(static_cast<int>(b), nearest, seen[b]);
  });
  std::vector<bool> keep(g.triangles.size(), false);
  for (const auto& band : seen)
    for (const std::int32_t t : band) keep[static_cast<std::size_t>(t)] = true;

  std::vector<std::int32_t> number(g.x_px.size(), -1);
  std::size_t triangles = 0, vertices = 0;
  for (std::size_t t = 0; t < g.triangles.size(); ++t) {
    if (!keep[t]) continue;
    for (const std::int32_t v : g.triangles[t].vertex) number[static_cast<std::size_t>(v)] = 0;
    g.triangles[triangles++] = SparseTriangle(g.triangles[t]);
  }
  g.triangles.resize(triangles);
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    g.x_px[vertices] = Eigen::Vector2f(g.x_px[v]);
    g.offset[vertices] = Eigen::Vector3f(g.offset[v]);
    g.normal[vertices] = Eigen::Vector3f(g.normal[v]);
    number[v] = static_cast<std::int32_t>(vertices++);
  }
  g.x_px.resize(vertices);
  g.offset.resize(vertices);
  g.normal.resize(vertices);
  for (SparseTriangle& t : g.triangles)
    for (std::int32_t& v : t.vertex) v = number[static_cast<std::size_t>(v)];
}

}  // namespace lumi
