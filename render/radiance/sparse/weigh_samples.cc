#include "render/radiance/sparse/weigh_samples.h"

#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

// Rays a chunk: enough to share the optimum's work between neighbours, few enough to spread.
constexpr std::size_t kChunk = 64;

void WeighChunk(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table, OptimumCounts& counts,
                WeighScratch& scratch) {
  (void)counts;
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.clear();
  std::vector<float> everyone;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    float alpha = 0;
    if (!(rays.t[i] > 0) || !std::isfinite(rays.t[i])) {
    } else if (setup.settings.k == 0) {
      alpha = WeighAll(setup.sources, visibility, rays.direction[i], rays.t[i], setup.settings, scratch, everyone);
      for (std::size_t j = 0; j < everyone.size(); ++j)
        if (everyone[j] > 0) {
          table.camera.push_back(static_cast<std::int32_t>(j));
          table.weight.push_back(everyone[j]);
        }
    } else {
      const RayWeights r = Weigh(setup.sources, visibility, rays.direction[i], rays.t[i], setup.settings, scratch);
      alpha = r.alpha;
      for (std::size_t j = 0; j < static_cast<std::size_t>(r.count); ++j) {
        table.camera.push_back(r.camera[j]);
        table.weight.push_back(r.weight[j]);
      }
    }
    table.alpha.push_back(alpha);
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
}

void Add(const OptimumCounts& c, OptimumCounts& to) {
  to.samples += c.samples;
  to.cameras += c.cameras;
  to.nugget_raised += c.nugget_raised;
  to.indefinite += c.indefinite;
  to.small_sums += c.small_sums;
}

// Few entries, nearly sorted: by insertion.
void SortByCamera(WeightTable& table) {
  for (std::size_t s = 0; s < table.size(); ++s) {
    const auto begin = static_cast<std::size_t>(table.first[s]), end = static_cast<std::size_t>(table.first[s + 1]);
    for (std::size_t i = begin + 1; i < end; ++i)
      for (std::size_t j = i; j > begin && table.camera[j - 1] > table.camera[j]; --j) {
        std::swap(table.camera[j - 1], table.camera[j]);
        std::swap(table.weight[j - 1], table.weight[j]);
      }
  }
}

}  // namespace

RaySamples VertexRays(const ViewSetup& setup, const SparseGeometry& geometry) {
  const std::size_t n = geometry.offset.size();
  const Eigen::Vector2d low(kInsidePx, kInsidePx), high = setup.desired.size_px.cast<double>() - low;
  RaySamples rays;
  rays.direction.resize(n);
  rays.t.resize(n);
  rays.normal = geometry.normal;
  for (std::size_t i = 0; i < n; ++i) {
    rays.t[i] = geometry.offset[i].norm();
    rays.direction[i] = rays.t[i] > 0 ? Eigen::Vector3f(geometry.offset[i] / rays.t[i]) : Eigen::Vector3f::UnitZ();
    const Eigen::Vector2d x = geometry.x_px[i].cast<double>(), inside = x.cwiseMax(low).cwiseMin(high);
    // A fine mesh's vertices outside the view stay there.
    if (x != inside && (x - inside).cwiseAbs().maxCoeff() <= kInsidePx)
      rays.direction[i] = (setup.ray_from_pixel * inside.homogeneous()).normalized().cast<float>();
  }
  return rays;
}

void WeighSamples(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, const ForRanges& for_ranges,
                  WeightTable& table, OptimumCounts& counts) {
  const std::size_t chunks = (rays.size() + kChunk - 1) / kChunk;
  std::vector<WeightTable> tables(chunks);
  std::vector<OptimumCounts> counted(chunks);
  for_ranges(chunks, 1, [&](std::size_t begin, std::size_t end) {
    WeighScratch scratch;
    RaySamples some;
    for (std::size_t c = begin; c < end; ++c) {
      const auto from = static_cast<std::ptrdiff_t>(c * kChunk), to = static_cast<std::ptrdiff_t>(std::min(rays.size(), (c + 1) * kChunk));
      some.direction.assign(rays.direction.begin() + from, rays.direction.begin() + to);
      some.t.assign(rays.t.begin() + from, rays.t.begin() + to);
      some.normal.assign(rays.normal.begin() + from, rays.normal.begin() + to);
      WeighChunk(setup, visibility, some, tables[c], counted[c], scratch);
      SortByCamera(tables[c]);
    }
  });
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.clear();
  for (std::size_t c = 0; c < chunks; ++c) {
    const std::int32_t base = table.first.back();
    for (std::size_t i = 1; i < tables[c].first.size(); ++i) table.first.push_back(base + tables[c].first[i]);
    table.camera.insert(table.camera.end(), tables[c].camera.begin(), tables[c].camera.end());
    table.weight.insert(table.weight.end(), tables[c].weight.begin(), tables[c].weight.end());
    table.alpha.insert(table.alpha.end(), tables[c].alpha.begin(), tables[c].alpha.end());
    Add(counted[c], counts);
  }
}

}  // namespace lumi
