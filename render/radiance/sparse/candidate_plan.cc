#include "render/radiance/sparse/candidate_plan.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/radiance/sparse/tessellate.h"
#include "render/radiance/sparse/weigh_samples.h"

namespace lumi {
namespace {

// Probe rays along a cell's side over a fine mesh: where their depths differ, more of them become samples.
constexpr int kProbes = 4;
// A cell counts as uneven from this ratio of its farthest to its nearest depth.
constexpr float kUneven = 1.1F;

using Lists = std::vector<std::vector<std::int32_t>>;

// The photos of samples, to the cells that hold them.
struct CellSamples {
  RaySamples rays;
  std::vector<std::int32_t> cell;
  void Add(std::int32_t c, const Eigen::Vector3f& offset, const Eigen::Vector3f& normal) {
    const auto t = static_cast<float>(offset.cast<double>().norm());
    if (!(t > 0) || !std::isfinite(t)) return;
    rays.direction.push_back(offset / t);
    rays.t.push_back(t);
    rays.normal.push_back(normal);
    cell.push_back(c);
  }
};

void List(const WeightTable& table, std::size_t sample, std::vector<std::int32_t>& out) {
  out.insert(out.end(), table.camera.begin() + table.first[sample], table.camera.begin() + table.first[sample + 1]);
}

class Planner {
 public:
  Planner(const ViewSetup& setup, const VisibilityMaps* visibility, const ForRanges& for_ranges, CandidatePlan& plan)
      : setup_(setup), visibility_(visibility), for_ranges_(for_ranges), plan_(plan) {
    setup_.settings.k = std::min(setup.settings.k + kSpareCandidates, kMaxBlend);
    lists_.resize(static_cast<std::size_t>(plan.cell_columns * plan.cell_rows));
  }

  void FromFacets() {
    const SparseGeometry& g = plan_.geometry;
    const RaySamples rays = VertexRays(setup_, g);
    WeighSamples(setup_, visibility_, rays, for_ranges_, table_, counts_);
    plan_.samples = static_cast<int>(rays.size());
    CellSamples between;
    for (std::size_t c = 0; c < lists_.size(); ++c)
      for (auto t = static_cast<std::size_t>(g.first_of_cell[c]); t < static_cast<std::size_t>(g.first_of_cell[c + 1]);
           ++t) {
        const auto& v = g.triangles[t].vertex;
        bool hole = false;
        for (const std::int32_t i : v) {
          List(table_, static_cast<std::size_t>(i), lists_[c]);
          hole = hole || table_.alpha[static_cast<std::size_t>(i)] < 1;
        }
        if (!hole) continue;
        // A photo's border may lie between the corners.
        for (int i = 0; i <= 4; ++i)
          for (int j = 0; i + j <= 4; ++j)
            if (i < 4 && j < 4 && i + j > 0)
              between.Add(static_cast<std::int32_t>(c),
                          (static_cast<float>(i) * g.offset[static_cast<std::size_t>(v[0])] +
                           static_cast<float>(j) * g.offset[static_cast<std::size_t>(v[1])] +
                           static_cast<float>(4 - i - j) * g.offset[static_cast<std::size_t>(v[2])]) /
                              4,
                          g.normal[static_cast<std::size_t>(v[0])]);
      }
    Weigh(between);
  }

  void FromRays(const ProxyTracer& tracer) {
    const int columns = plan_.cell_columns * kProbes + 1, rows = plan_.cell_rows * kProbes + 1;
    const Eigen::Vector2i size = setup_.desired.size_px;
    std::vector<Eigen::Vector3f> direction(static_cast<std::size_t>(columns * rows));
    std::vector<float> t(direction.size());
    std::vector<Eigen::Vector3f> normal(setup_.settings.resolution == Resolution::kJacobian ? direction.size() : 0);
    const auto inside = [](double x, int side) { return std::clamp(x, kInsidePx, side - kInsidePx); };
    for_ranges_(static_cast<std::size_t>(rows), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y)
        for (int x = 0; x < columns; ++x)
          direction[y * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x)] =
              (setup_.ray_from_pixel * Eigen::Vector3d(inside(SamplePx(x, columns, size.x()), size.x()),
                                                       inside(SamplePx(static_cast<int>(y), rows, size.y()), size.y()),
                                                       1))
                  .normalized()
                  .cast<float>();
      const std::size_t from = begin * static_cast<std::size_t>(columns),
                        n = (end - begin) * static_cast<std::size_t>(columns);
      tracer.Trace(setup_.desired.centre.cast<float>(), std::span(direction).subspan(from, n),
                   std::span(t).subspan(from, n),
                   normal.empty() ? std::span<Eigen::Vector3f>() : std::span(normal).subspan(from, n));
    });
    // Which rays become samples; those on a border serve both cells.
    std::vector<bool> sampled(t.size(), false);
    const auto cells = [&](auto&& body) {
      for (int r = 0; r < plan_.cell_rows; ++r)
        for (int c = 0; c < plan_.cell_columns; ++c)
          body(static_cast<std::size_t>(r * plan_.cell_columns + c), r * kProbes, c * kProbes);
    };
    const auto at = [&](int y, int x) {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
    };
    cells([&](std::size_t, int y0, int x0) {
      float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
      std::size_t near = at(y0, x0), far = near;
      for (int y = y0; y <= y0 + kProbes; ++y)
        for (int x = x0; x <= x0 + kProbes; ++x) {
          const float d = t[at(y, x)];
          if (d < nearest) near = at(y, x);
          if (d > farthest && std::isfinite(d)) far = at(y, x);
          nearest = std::min(nearest, d);
          farthest = std::max(farthest, d);
        }
      const int step = farthest <= kUneven * nearest ? kProbes : 2;
      for (int y = y0; y <= y0 + kProbes; y += step)
        for (int x = x0; x <= x0 + kProbes; x += step) sampled[at(y, x)] = true;
      sampled[near] = sampled[far] = true;
    });
    RaySamples rays;
    std::vector<std::int32_t> sample(t.size(), -1);
    for (std::size_t i = 0; i < t.size(); ++i)
      if (sampled[i] && std::isfinite(t[i]) && t[i] > 0) {
        sample[i] = static_cast<std::int32_t>(rays.size());
        rays.direction.push_back(direction[i]);
        rays.t.push_back(t[i]);
        rays.normal.push_back(normal.empty() ? Eigen::Vector3f::Zero() : normal[i]);
      }
    WeighSamples(setup_, visibility_, rays, for_ranges_, table_, counts_);
    plan_.samples = static_cast<int>(rays.size());
    CellSamples between;
    cells([&](std::size_t c, int y0, int x0) {
      bool hole = false;
      for (int y = y0; y <= y0 + kProbes; ++y)
        for (int x = x0; x <= x0 + kProbes; ++x)
          if (const std::int32_t s = sample[at(y, x)]; s >= 0) {
            List(table_, static_cast<std::size_t>(s), lists_[c]);
            hole = hole || table_.alpha[static_cast<std::size_t>(s)] < 1;
          }
      if (!hole) return;
      for (int y = y0; y <= y0 + kProbes; ++y)
        for (int x = x0; x <= x0 + kProbes; ++x)
          if (sample[at(y, x)] < 0)
            between.Add(static_cast<std::int32_t>(c), direction[at(y, x)] * t[at(y, x)],
                        normal.empty() ? Eigen::Vector3f::Zero() : normal[at(y, x)]);
    });
    Weigh(between);
    if (setup_.settings.epipoles) AddEpipoles();
  }

  void Finish() {
    plan_.first.assign(1, 0);
    plan_.camera.clear();
    for (auto& list : lists_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      plan_.camera.insert(plan_.camera.end(), list.begin(), list.end());
      plan_.first.push_back(static_cast<std::int32_t>(plan_.camera.size()));
    }
  }

 private:
  void Weigh(const CellSamples& samples) {
    if (samples.cell.empty()) return;
    WeighSamples(setup_, visibility_, samples.rays, for_ranges_, table_, counts_);
    plan_.samples += static_cast<int>(samples.cell.size());
    for (std::size_t i = 0; i < samples.cell.size(); ++i)
      List(table_, i, lists_[static_cast<std::size_t>(samples.cell[i])]);
  }

  // Adds each photo to the list of the cell that its centre projects into, from before or behind the view. Weights are
  // computed at every pixel anyway.
  void AddEpipoles() {
    const RelativeSources& s = setup_.sources;
    const Eigen::Matrix3d M = setup_.desired.P.leftCols<3>();
    const Eigen::Vector2i size = setup_.desired.size_px;
    for (std::size_t j = 0; j < static_cast<std::size_t>(s.count); ++j) {
      if (!(s.enabled[j] > 0)) continue;
      const Eigen::Vector3d e = M * Eigen::Vector3d(s.dx[j], s.dy[j], s.dz[j]);
      const double w = std::abs(e.z());
      const Eigen::Vector2d x = e.z() < 0 ? Eigen::Vector2d(-e.head<2>()) : Eigen::Vector2d(e.head<2>());
      if (!(w > 0 && x.x() >= 0 && x.y() >= 0 && x.x() <= size.x() * w && x.y() <= size.y() * w)) continue;
      const Eigen::Vector2d px = x / w;
      const int column = std::min(static_cast<int>(px.x() / plan_.cell_width_px), plan_.cell_columns - 1);
      const int row = std::min(static_cast<int>(px.y() / plan_.cell_height_px), plan_.cell_rows - 1);
      lists_[static_cast<std::size_t>(row * plan_.cell_columns + column)].push_back(static_cast<std::int32_t>(j));
      plan_.geometry.epipoles_px.push_back(px.cast<float>());
    }
  }

  ViewSetup setup_;  // a copy: its samples list more photos
  const VisibilityMaps* visibility_;
  const ForRanges& for_ranges_;
  CandidatePlan& plan_;
  Lists lists_;
  WeightTable table_;
  OptimumCounts counts_;
};

}  // namespace

void PlanCandidates(const ViewSetup& setup, const SparseProxy& proxy, const ProxyTracer& tracer,
                    const VisibilityMaps* visibility, const ForRanges& for_ranges, CandidatePlan& plan) {
  const RadianceSettings& s = setup.settings;
  if (!s.Sparse() || s.k == 0 || s.similarity != Similarity::kIdentity)
    throw std::invalid_argument("PlanCandidates: settings without candidates");
  plan.cell_columns = s.grid_columns - 1;
  plan.cell_rows = s.grid_rows - 1;
  plan.cell_width_px = static_cast<double>(setup.desired.size_px.x()) / plan.cell_columns;
  plan.cell_height_px = static_cast<double>(setup.desired.size_px.y()) / plan.cell_rows;
  plan.geometry = {};
  Planner planner(setup, visibility, for_ranges, plan);
  if (proxy.coarse()) {
    TessellateView(setup, proxy, for_ranges, plan.geometry);
    planner.FromFacets();
  } else {
    planner.FromRays(tracer);
  }
  planner.Finish();
}

PixelWindow CellPixels(const CandidatePlan& plan, int cell, const Eigen::Vector2i& size_px) {
  const int column = cell % plan.cell_columns, row = cell / plan.cell_columns;
  const auto first = [](double edge, int size) { return std::clamp(static_cast<int>(std::ceil(edge - 0.5)), 0, size); };
  const int x = first(column * plan.cell_width_px, size_px.x()), y = first(row * plan.cell_height_px, size_px.y());
  return {x, y, first((column + 1) * plan.cell_width_px, size_px.x()) - x,
          first((row + 1) * plan.cell_height_px, size_px.y()) - y};
}

void PlanCellPixels(const ViewSetup& setup, const ProxyTracer& tracer, const VisibilityMaps* visibility,
                    const CandidatePlan& plan, int cell, ViewSetup& cell_setup, FramePlan& out, WeighScratch& scratch) {
  const auto from = static_cast<std::size_t>(plan.first[static_cast<std::size_t>(cell)]),
             to = static_cast<std::size_t>(plan.first[static_cast<std::size_t>(cell) + 1]);
  cell_setup.desired = setup.desired;
  cell_setup.settings = setup.settings;
  cell_setup.ray_from_pixel = setup.ray_from_pixel;
  cell_setup.focal_px = setup.focal_px;
  Subset(setup.sources, std::span(plan.camera).subspan(from, to - from), cell_setup.sources);
  PlanPixels(cell_setup, tracer, visibility, CellPixels(plan, cell, setup.desired.size_px), out, scratch);
  for (std::int32_t& camera : out.camera)
    if (camera >= 0) camera = cell_setup.sources.view[static_cast<std::size_t>(camera)];
}

}  // namespace lumi
