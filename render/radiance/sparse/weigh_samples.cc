#include "render/radiance/sparse/weigh_samples.h"

#include <algorithm>
#include <cmath>

#include "render/radiance/optimum/keep_largest.h"
#include "render/radiance/reconstruct.h"

namespace lumi {
namespace {

// Rays a chunk: enough to share the optimum's work between neighbours, few enough to spread.
constexpr std::size_t kRaysAChunk = 64;

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
    rays.t[i] = static_cast<float>(geometry.offset[i].cast<double>().norm());  // a float's squares end at 1e19
    rays.direction[i] = rays.t[i] > 0 ? Eigen::Vector3f(geometry.offset[i] / rays.t[i]) : Eigen::Vector3f::UnitZ();
    const Eigen::Vector2d x = geometry.x_px[i].cast<double>(), inside = x.cwiseMax(low).cwiseMin(high);
    if (x != inside) rays.direction[i] = (setup.ray_from_pixel * inside.homogeneous()).normalized().cast<float>();
  }
  return rays;
}

void WeighSamples(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
                  const ForRanges& for_ranges, WeightTable& table, OptimumCounts& counts) {
  const std::size_t chunks = (rays.size() + kRaysAChunk - 1) / kRaysAChunk;
  std::vector<WeightTable> tables(chunks);
  std::vector<OptimumCounts> counted(chunks);
  for_ranges(chunks, 1, [&](std::size_t begin, std::size_t end) {
    WeighScratch scratch;
    RaySamples some;
    for (std::size_t c = begin; c < end; ++c) {
      const auto from = static_cast<std::ptrdiff_t>(c * kRaysAChunk),
                 to = static_cast<std::ptrdiff_t>(std::min(rays.size(), (c + 1) * kRaysAChunk));
      some.direction.assign(rays.direction.begin() + from, rays.direction.begin() + to);
      some.t.assign(rays.t.begin() + from, rays.t.begin() + to);
      some.normal.assign(rays.normal.begin() + from, rays.normal.begin() + to);
      Reconstruct(setup, visibility, some, tables[c], counted[c], scratch);
      // A triangle draws few photos: what the optimum spreads over all is cut to the k that weigh most, continuously.
      if (setup.settings.similarity == Similarity::kFull && setup.settings.k > 0)
        KeepLargest(tables[c], setup.settings.k);
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
    counts += counted[c];
  }
}

}  // namespace lumi
