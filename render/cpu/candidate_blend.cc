#include "render/cpu/candidate_blend.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/cpu/candidate_weights.h"
#include "render/cpu/layer_shader.h"
#include "render/radiance/measures/evaluate.h"
#include "render/radiance/sparse/raster.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// In a cell of a fine mesh, pyramid levels are taken from this many points along each side.
constexpr int kLevelSamples = 2;

struct Workspace {
  LayerBatch batch;
  PlaneSlopes slopes;  // of the batch, for Resolution::kJacobian
  std::vector<CandidateRay> rays;
  std::vector<PhotoLayer> layers;
  std::vector<float> weights;
  std::vector<float> nearest;          // inverse depths of a cell's pixels
  std::vector<std::int32_t> triangle;  // and whose they are
  std::vector<Eigen::Vector3f> direction, normal;
  std::vector<float> t;
  std::vector<SurfacePoint> points;  // where a cell's levels are taken
};

struct PixelRect {
  int x0, y0, x1, y1;
  int width() const { return x1 - x0; }
};

class CandidateBlender {
 public:
  CandidateBlender(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer,
                   const VisibilityMaps* visibility, const BlendSources& sources, ImageF& image)
      : plan_(plan),
        setup_(setup),
        tracer_(tracer),
        maps_(setup),
        shader_(setup, sources),
        axis_(setup.desired.P.row(2).head<3>().cast<float>()),
        ray_step_x_(setup.ray_from_pixel.col(0).cast<float>()),
        ray_step_y_(setup.ray_from_pixel.col(1).cast<float>()),
        image_(image) {
    const RelativeSources& r = setup.sources;
    candidates_.resize(static_cast<std::size_t>(r.count));
    for (std::size_t j = 0; j < candidates_.size(); ++j) {
      CandidateRay& c = candidates_[j];
      c.dx = r.dx[j];
      c.dy = r.dy[j];
      c.dz = r.dz[j];
      c.width_px = r.width_px[j];
      c.height_px = r.height_px[j];
      c.feather_px = r.feather_px[j];
      c.view = r.view[j];
      c.focal_ratio = r.desired_focal_px / r.focal_px[j];
      if (visibility && !visibility->empty()) c.depth_map = visibility->Map(static_cast<int>(j)).data();
    }
    const RadianceSettings& s = setup.settings;
    rule_.k = s.k;
    rule_.alpha = static_cast<float>(s.alpha);
    rule_.gamma = static_cast<float>(s.gamma);
    rule_.field_of_view = s.field_of_view;
    rule_.settings = &s;
    rule_.fields = r.fields.get();
    ForEachTerm([&]<typename M> {
      if (ReadsStretch<M> && M::Factor(s) > 0) planes_ = s.resolution == Resolution::kJacobian;
    });
    const std::vector<float> terms = PhotoTerms(r, s);
    for (std::size_t j = 0; j < candidates_.size(); ++j) candidates_[j].terms = terms[j];
    if (visibility) {
      rule_.map_width = visibility->width();
      rule_.map_height = visibility->height();
    }
  }

  void Cell(int cell, Workspace& work) const {
    const auto c = static_cast<std::size_t>(cell);
    if (plan_.first[c] == plan_.first[c + 1]) return;
    const PixelRect rect = Pixels(cell);
    if (rect.x0 >= rect.x1 || rect.y0 >= rect.y1) return;
    if (plan_.geometry.first_of_cell.empty())
      FineCell(cell, rect, work);
    else
      FacetCell(cell, rect, work);
  }

 private:
  // Pixels whose centres lie in the cell.
  PixelRect Pixels(int cell) const {
    const int column = cell % plan_.cell_columns, row = cell / plan_.cell_columns;
    const auto first = [](double edge, int size) {
      return std::clamp(static_cast<int>(std::ceil(edge - 0.5)), 0, size);
    };
    return {first(column * plan_.cell_width_px, image_.width), first(row * plan_.cell_height_px, image_.height),
            first((column + 1) * plan_.cell_width_px, image_.width),
            first((row + 1) * plan_.cell_height_px, image_.height)};
  }

  TriangleRows Rows(const SparseTriangle& t) const {
    const auto& x = plan_.geometry.x_px;
    return TriangleRows({x[static_cast<std::size_t>(t.vertex[0])], x[static_cast<std::size_t>(t.vertex[1])],
                         x[static_cast<std::size_t>(t.vertex[2])]});
  }

  // Computes the plane of a triangle. Returns twice its area in pixels, 0 if it has none.
  double Plane(const SparseTriangle& t, std::array<Eigen::Vector2d, 3>& x_px, Eigen::Matrix3d& linear,
               LinearD& inverse_depth) const {
    Eigen::RowVector3d at;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto v = static_cast<std::size_t>(t.vertex[i]);
      x_px[i] = plan_.geometry.x_px[v].cast<double>();
      at[static_cast<Eigen::Index>(i)] = 1.0 / static_cast<double>(axis_.dot(plan_.geometry.offset[v]));
    }
    if (!LinearFromCorners(x_px, linear)) return 0;
    inverse_depth = at * linear;
    const Eigen::Vector2d u = x_px[1] - x_px[0], v = x_px[2] - x_px[0];
    return inverse_depth.allFinite() ? std::abs(u.x() * v.y() - u.y() * v.x()) : 0;
  }

  // Draws one facet at a time: its triangles in the cell lie in one plane and share batches.
  void FacetCell(int cell, const PixelRect& rect, Workspace& work) const {
    const auto c = static_cast<std::size_t>(cell);
    const auto from = static_cast<std::size_t>(plan_.geometry.first_of_cell[c]),
               to = static_cast<std::size_t>(plan_.geometry.first_of_cell[c + 1]);
    const auto& triangles = plan_.geometry.triangles;
    if (std::any_of(triangles.begin() + static_cast<std::ptrdiff_t>(from),
                    triangles.begin() + static_cast<std::ptrdiff_t>(to), [](const auto& t) { return !t.alone; }))
      TestDepths(from, to, rect, work);
    std::vector<bool> drawn(to - from, false);
    for (std::size_t first = from; first < to; ++first) {
      if (drawn[first - from]) continue;
      double largest = 0;
      std::array<Eigen::Vector2d, 3> x_px, corners;
      Eigen::Matrix3d linear, best_linear;
      LinearD inverse_depth = LinearD::Zero(), best = LinearD::Zero();
      for (std::size_t t = first; t < to; ++t)
        if (triangles[t].face == triangles[first].face)
          if (const double area = Plane(triangles[t], x_px, linear, inverse_depth); area > largest) {
            largest = area;
            corners = x_px;
            best_linear = linear;
            best = inverse_depth;
          }
      if (!(largest > 0)) {
        drawn[first - from] = true;
        continue;
      }
      Prepare(cell, rect, work,
              [&](std::size_t photo) { return shader_.Layer(photo, best, corners, best_linear, rect.x0, rect.y0); });
      for (std::size_t i = 0; i < work.rays.size(); ++i) work.rays[i].inner = Inner(work.layers[i], rect);
      LayerBatch& b = work.batch;
      b.n = 0;
      b.depths = false;
      const Linear depth = About(best, rect.x0, rect.y0);
      if (planes_) {
        std::fill_n(work.slopes.dx, kBatch, depth.x);
        std::fill_n(work.slopes.dy, kBatch, depth.y);
        std::fill_n(work.slopes.facing, kBatch, 1.0F);
      }
      for (std::size_t t = first; t < to; ++t) {
        if (triangles[t].face != triangles[first].face) continue;
        drawn[t - from] = true;
        const TriangleRows rows = Rows(triangles[t]);
        auto [low, high] = rows.Rows(image_.height);
        for (int y = std::max(low, rect.y0); y < std::min(high, rect.y1); ++y) {
          auto [x0, x1] = rows.Span(y, image_.width);
          x0 = std::max(x0, rect.x0);
          x1 = std::min(x1, rect.x1);
          const std::int32_t* owner =
              triangles[t].alone
                  ? nullptr
                  : work.triangle.data() + static_cast<std::ptrdiff_t>(y - rect.y0) * rect.width() - rect.x0;
          for (int x = x0; x < x1; ++x) {
            if (owner && owner[x] != static_cast<std::int32_t>(t)) continue;
            const auto dx = static_cast<float>(x - rect.x0), dy = static_cast<float>(y - rect.y0);
            b.x[b.n] = dx;
            b.y[b.n] = dy;
            b.inverse_depth[b.n] = depth.c + depth.x * dx + depth.y * dy;
            b.pixel[b.n] = y * image_.width + x;
            if (++b.n == kBatch) Flush(work);
          }
        }
      }
      Flush(work);
    }
  }

  // Whether a photo contains a cell's pixels, feather excluded. The photo's inner region is convex and the map to it a
  // homography wherever w > 0, so testing the cell's corners is enough.
  bool Inner(const PhotoLayer& layer, const PixelRect& rect) const {
    const RelativeSources& r = setup_.sources;
    const std::size_t j = layer.photo;
    constexpr float kRoundingPx = 0.01F;
    const float margin = r.feather_px[j] + kRoundingPx;
    for (const int x : {0, rect.x1 - 1 - rect.x0})
      for (const int y : {0, rect.y1 - 1 - rect.y0}) {
        const auto at = [&](const Linear& f) {
          return f.c + f.x * static_cast<float>(x) + f.y * static_cast<float>(y);
        };
        const float u = at(layer.map.u), v = at(layer.map.v), w = at(layer.map.w);
        if (!(w > 0 && u >= margin * w && v >= margin * w && r.width_px[j] * w - u >= margin * w &&
              r.height_px[j] * w - v >= margin * w))
          return false;
      }
    return true;
  }

  void TestDepths(std::size_t from, std::size_t to, const PixelRect& rect, Workspace& work) const {
    work.nearest.assign(static_cast<std::size_t>(rect.width() * (rect.y1 - rect.y0)), 0.0F);
    work.triangle.assign(work.nearest.size(), -1);
    for (std::size_t t = from; t < to; ++t) {
      const SparseTriangle& triangle = plan_.geometry.triangles[t];
      std::array<Eigen::Vector2d, 3> x_px;
      Eigen::Matrix3d linear;
      LinearD inverse_depth = LinearD::Zero();
      if (triangle.alone || !(Plane(triangle, x_px, linear, inverse_depth) > 0)) continue;
      const Linear f = About(inverse_depth, rect.x0, rect.y0);
      const TriangleRows rows = Rows(triangle);
      auto [low, high] = rows.Rows(image_.height);
      for (int y = std::max(low, rect.y0); y < std::min(high, rect.y1); ++y) {
        const auto [x0, x1] = rows.Span(y, image_.width);
        for (int x = std::max(x0, rect.x0); x < std::min(x1, rect.x1); ++x) {
          const auto at = static_cast<std::size_t>((y - rect.y0) * rect.width() + x - rect.x0);
          const float z = f.c + f.x * static_cast<float>(x - rect.x0) + f.y * static_cast<float>(y - rect.y0);
          if (!(z > work.nearest[at])) continue;
          work.nearest[at] = z;
          work.triangle[at] = static_cast<std::int32_t>(t);
        }
      }
    }
  }

  void FineCell(int cell, const PixelRect& rect, Workspace& work) const {
    const auto n = static_cast<std::size_t>(rect.width() * (rect.y1 - rect.y0));
    work.direction.resize(n);
    work.t.resize(n);
    std::size_t i = 0;
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x)
        work.direction[i++] = (setup_.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>();
    work.normal.resize(planes_ || setup_.settings.prefilter ? n : 0);
    tracer_.Trace(setup_.desired.centre.cast<float>(), work.direction, work.t, work.normal);
    const auto hit = [&](std::size_t k) { return work.t[k] > 0 && std::isfinite(work.t[k]); };
    if (std::none_of(work.t.begin(), work.t.end(), [](float t) { return t > 0 && std::isfinite(t); })) return;
    work.points.clear();
    if (!work.normal.empty())
      for (int row = 0; row < kLevelSamples; ++row)
        for (int column = 0; column < kLevelSamples; ++column) {
          const auto at = [](int k, int size) { return (2 * k + 1) * size / (2 * kLevelSamples); };
          const auto k = static_cast<std::size_t>(at(row, rect.y1 - rect.y0) * rect.width() + at(column, rect.width()));
          if (!hit(k)) continue;
          const Eigen::Vector3f offset = work.t[k] * work.direction[k];
          work.points.push_back({offset, work.normal[k], work.normal[k].dot(offset), axis_.dot(offset)});
        }
    Prepare(cell, rect, work,
            [&](std::size_t photo) { return shader_.LayerAtDepths(photo, work.points, rect.x0, rect.y0); });
    LayerBatch& b = work.batch;
    b.n = 0;
    b.depths = true;
    i = 0;
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x, ++i) {
        if (!hit(i)) continue;
        b.x[b.n] = static_cast<float>(x - rect.x0);
        b.y[b.n] = static_cast<float>(y - rect.y0);
        b.inverse_depth[b.n] = 1 / (work.t[i] * axis_.dot(work.direction[i]));
        b.pixel[b.n] = y * image_.width + x;
        if (planes_) SetSlopes(work, i);
        if (++b.n == kBatch) Flush(work);
      }
    Flush(work);
  }

  // Slopes of the batch's next pixel (ray i of the cell), all scaled by the ray's depth over its length.
  void SetSlopes(Workspace& work, std::size_t i) const {
    // A triangle without a normal faces the view.
    const Eigen::Vector3f& normal = work.normal[i].squaredNorm() > 0 ? work.normal[i] : work.direction[i];
    const auto at = static_cast<std::size_t>(work.batch.n);
    work.slopes.dx[at] = normal.dot(ray_step_x_) / work.t[i];
    work.slopes.dy[at] = normal.dot(ray_step_y_) / work.t[i];
    work.slopes.facing[at] = normal.dot(work.direction[i]);
  }

  template <typename MakeLayer>
  void Prepare(int cell, const PixelRect& rect, Workspace& work, MakeLayer&& layer) const {
    work.rays.clear();
    work.layers.clear();
    for (auto i = static_cast<std::size_t>(plan_.first[static_cast<std::size_t>(cell)]);
         i < static_cast<std::size_t>(plan_.first[static_cast<std::size_t>(cell) + 1]); ++i) {
      const auto photo = static_cast<std::size_t>(plan_.camera[i]);
      work.rays.push_back(candidates_[photo]);
      work.rays.back().map = maps_.AtDepths(photo, rect.x0, rect.y0);
      work.layers.push_back(layer(photo));
    }
  }

  void Flush(Workspace& work) const {
    LayerBatch& b = work.batch;
    if (b.n == 0) return;
    if (planes_)
      for (float* slope : {work.slopes.dx, work.slopes.dy, work.slopes.facing})
        std::fill(slope + b.n, slope + b.padded(), slope[b.n - 1]);
    b.Pad();
    CandidateRule rule = rule_;
    rule.slopes = &work.slopes;
    // The batch's reference is its cell's first pixel, whose centre is at b.x = b.y = 0.
    const int x = b.pixel[0] % image_.width - static_cast<int>(b.x[0]),
              y = b.pixel[0] / image_.width - static_cast<int>(b.y[0]);
    rule.ray_x = About(setup_.ray_from_pixel.row(0), x, y);
    rule.ray_y = About(setup_.ray_from_pixel.row(1), x, y);
    rule.ray_z = About(setup_.ray_from_pixel.row(2), x, y);
    WeighCandidates(b, work.rays, rule, work.weights);
    shader_.ShadeWeighted(b, work.layers, work.weights, image_.data.data());
    b.n = 0;
  }

  const CandidatePlan& plan_;
  const ViewSetup& setup_;
  const ProxyTracer& tracer_;
  const PhotoMaps maps_;
  const LayerShader shader_;
  const Eigen::RowVector3f axis_;
  const Eigen::Vector3f ray_step_x_, ray_step_y_;  // from pixel to pixel, at depth 1
  ImageF& image_;
  std::vector<CandidateRay> candidates_;
  CandidateRule rule_;
  bool planes_ = false;  // whether the slopes of the proxy are read
};

}  // namespace

bool CanBlendCandidates(const RadianceSettings& s) {
  return s.Sparse() && s.k > 0 && s.similarity == Similarity::kIdentity && s.correlation == Correlation::kInverse &&
         s.alpha > 0;
}

void BlendCandidates(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer,
                     const VisibilityMaps* visibility, const BlendSources& sources, ImageF& image) {
  const CandidateBlender blender(plan, setup, tracer, visibility, sources, image);
  ParallelFor(static_cast<std::size_t>(plan.cell_columns) * static_cast<std::size_t>(plan.cell_rows), 1,
              [&](std::size_t begin, std::size_t end) {
                const auto work = std::make_unique<Workspace>();
                for (std::size_t cell = begin; cell < end; ++cell) {
                  if (InterruptRequested()) return;
                  blender.Cell(static_cast<int>(cell), *work);
                }
              });
}

}  // namespace lumi
