#include "render/cpu/sparse_blend.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "render/cpu/layer_shader.h"
#include "render/radiance/sparse/raster.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Rows that one thread blends before the next: about a grid cell, so that few triangles are begun twice.
constexpr int kBandRows = 32;

TriangleRows Rows(const SparsePlan& plan, const SparseTriangle& t) {
  return TriangleRows({plan.x_px[static_cast<std::size_t>(t.vertex[0])],
                       plan.x_px[static_cast<std::size_t>(t.vertex[1])],
                       plan.x_px[static_cast<std::size_t>(t.vertex[2])]});
}

// What a thread keeps.
struct BandWorkspace {
  LayerBatch batch;
  std::vector<PhotoLayer> layers;
  std::vector<float> weights;
  std::vector<float> nearest;          // inverse depths of a band
  std::vector<std::int32_t> triangle;  // and whose they are
};

class Blender {
 public:
  Blender(const SparsePlan& plan, const ViewSetup& setup, const BlendSources& sources, ImageF& image)
      : plan_(plan), shader_(setup, sources), axis_(setup.desired.P.row(2).head<3>().cast<float>()), image_(image) {
    // Triangles of each band, in order.
    bands_ = (image.height + kBandRows - 1) / kBandRows;
    first_.assign(static_cast<std::size_t>(bands_) + 1, 0);
    std::vector<std::pair<int, int>> range(plan.triangles.size());
    for (std::size_t t = 0; t < range.size(); ++t) {
      const auto [low, high] = Rows(plan, plan.triangles[t]).Rows(image.height);
      range[t] = low < high ? std::pair(low / kBandRows, (high - 1) / kBandRows + 1) : std::pair(0, 0);
      for (int b = range[t].first; b < range[t].second; ++b) ++first_[static_cast<std::size_t>(b) + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
    in_band_.resize(static_cast<std::size_t>(first_.back()));
    for (std::size_t t = 0; t < range.size(); ++t)
      for (int b = range[t].first; b < range[t].second; ++b)
        in_band_[static_cast<std::size_t>(next[static_cast<std::size_t>(b)]++)] = static_cast<std::int32_t>(t);
  }

  int bands() const { return bands_; }

  void Band(int band, BandWorkspace& work) const {
    const int begin = band * kBandRows, end = std::min(image_.height, begin + kBandRows);
    const auto from = static_cast<std::size_t>(first_[static_cast<std::size_t>(band)]),
               to = static_cast<std::size_t>(first_[static_cast<std::size_t>(band) + 1]);
    bool tested = false;
    for (std::size_t i = from; i < to; ++i) {
      const std::int32_t t = in_band_[i];
      if (plan_.triangles[static_cast<std::size_t>(t)].alone) continue;
      if (!tested) {
        work.nearest.assign(static_cast<std::size_t>((end - begin) * image_.width), 0.0F);
        work.triangle.assign(work.nearest.size(), -1);
        tested = true;
      }
      TestDepth(t, begin, end, work);
    }
    for (std::size_t i = from; i < to; ++i) Draw(in_band_[i], begin, end, work);
  }

 private:
  // False for a triangle without area.
  bool Plane(const SparseTriangle& t, std::array<Eigen::Vector2d, 3>& x_px, Eigen::Matrix3d& linear,
             LinearD& inverse_depth) const {
    Eigen::RowVector3d at;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<std::size_t>(t.vertex[i]);
      x_px[i] = plan_.x_px[v].cast<double>();
      at[static_cast<Eigen::Index>(i)] = 1.0 / static_cast<double>(axis_.dot(plan_.offset[v]));
    }
    if (!LinearFromCorners(x_px, linear)) return false;
    inverse_depth = at * linear;
    return inverse_depth.allFinite();
  }

  void TestDepth(std::int32_t index, int begin, int end, BandWorkspace& work) const {
    const SparseTriangle& t = plan_.triangles[static_cast<std::size_t>(index)];
    const TriangleRows rows = Rows(plan_, t);
    auto [low, high] = rows.Rows(image_.height);
    std::array<Eigen::Vector2d, 3> x_px;
    Eigen::Matrix3d linear;
    LinearD inverse_depth;
    if (!Plane(t, x_px, linear, inverse_depth)) return;
    for (int y = std::max(low, begin); y < std::min(high, end); ++y) {
      const auto [x0, x1] = rows.Span(y, image_.width);
      if (x0 >= x1) continue;
      const Linear f = About(inverse_depth, x0, y);
      float* nearest = work.nearest.data() + static_cast<std::ptrdiff_t>(y - begin) * image_.width + x0;
      std::int32_t* triangle = work.triangle.data() + static_cast<std::ptrdiff_t>(y - begin) * image_.width + x0;
      for (int i = 0; i < x1 - x0; ++i) {
        const float z = f.c + f.x * static_cast<float>(i);
        if (!(z > nearest[i])) continue;
        nearest[i] = z;
        triangle[i] = index;
      }
    }
  }

  void Draw(std::int32_t index, int begin, int end, BandWorkspace& work) const {
    const SparseTriangle& t = plan_.triangles[static_cast<std::size_t>(index)];
    if (t.count == 0) return;
    const TriangleRows rows = Rows(plan_, t);
    auto [low, high] = rows.Rows(image_.height);
    low = std::max(low, begin);
    high = std::min(high, end);
    LayerBatch& b = work.batch;
    b.n = 0;
    int x = -1, y = 0;  // the reference pixel, once there is one
    const bool sums_to_one = t.inside && !TakesMuch(t);
    const auto flush = [&] {
      if (b.n > 0) shader_.Shade(b, work.layers, sums_to_one, work.weights, image_.data.data());
      b.n = 0;
    };
    for (int row = low; row < high; ++row) {
      const auto [x0, x1] = rows.Span(row, image_.width);
      if (x0 >= x1) continue;
      if (x < 0) {
        x = x0;
        y = row;
        if (!PrepareLayers(t, x, y, work.layers)) return;
      }
      const std::int32_t* owner =
          t.alone ? nullptr : work.triangle.data() + static_cast<std::ptrdiff_t>(row - begin) * image_.width;
      for (int from = x0; from < x1;) {
        const int m = std::min(x1 - from, kBatch - b.n);
        if (owner) {
          for (int i = from; i < from + m; ++i) {
            Put(b, b.n, i - x, row - y, row * image_.width + i);
            b.n += owner[i] == index ? 1 : 0;
          }
        } else {
          for (int i = 0; i < m; ++i) Put(b, b.n + i, from + i - x, row - y, row * image_.width + from + i);
          b.n += m;
        }
        from += m;
        if (b.n == kBatch) flush();
      }
    }
    flush();
  }

  static void Put(LayerBatch& b, int at, int x, int y, int pixel) {
    b.x[at] = static_cast<float>(x);
    b.y[at] = static_cast<float>(y);
    b.pixel[at] = pixel;
  }

  // Whether the negative weights sum to less than -1 somewhere in the triangle, so that kMostTaken has to limit them.
  bool TakesMuch(const SparseTriangle& t) const {
    std::array<float, 3> taken{};
    for (auto i = static_cast<std::size_t>(t.first); i < static_cast<std::size_t>(t.first + t.count); ++i)
      for (std::size_t c = 0; c < 3; ++c) taken[c] -= std::min(plan_.weight[i][c], 0.0F);
    return std::max({taken[0], taken[1], taken[2]}) > kMostTaken / (1 - kMostTaken);
  }

  bool PrepareLayers(const SparseTriangle& t, int x, int y, std::vector<PhotoLayer>& layers) const {
    std::array<Eigen::Vector2d, 3> x_px;
    Eigen::Matrix3d linear;
    LinearD inverse_depth;
    if (!Plane(t, x_px, linear, inverse_depth)) return false;
    layers.clear();
    for (auto i = static_cast<std::size_t>(t.first); i < static_cast<std::size_t>(t.first + t.count); ++i) {
      PhotoLayer layer = shader_.Layer(static_cast<std::size_t>(plan_.camera[i]), inverse_depth, x_px, linear, x, y);
      const auto& w = plan_.weight[i];
      layer.weight = About(Eigen::RowVector3d(w[0], w[1], w[2]) * linear, x, y);
      layer.ends = plan_.ends[i] != 0;
      layers.push_back(layer);
    }
    return true;
  }

  const SparsePlan& plan_;
  const LayerShader shader_;
  const Eigen::RowVector3f axis_;
  ImageF& image_;
  int bands_ = 0;
  std::vector<std::int32_t> first_, in_band_;
};

}  // namespace

void BlendSparse(const SparsePlan& plan, const ViewSetup& setup, const BlendSources& sources, ImageF& image) {
  const Blender blender(plan, setup, sources, image);
  ParallelFor(static_cast<std::size_t>(blender.bands()), 1, [&](std::size_t begin, std::size_t end) {
    const auto work = std::make_unique<BandWorkspace>();
    for (std::size_t band = begin; band < end; ++band) {
      if (InterruptRequested()) return;
      blender.Band(static_cast<int>(band), *work);
    }
  });
}

}  // namespace lumi
