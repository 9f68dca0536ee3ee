#include "render/radiance/sparse/weigh_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "render/radiance/optimum/coherent_order.h"
#include "render/radiance/optimum/keep_largest.h"
#include "render/radiance/reconstruct.h"
#include "render/radiance/sparse/cameras_in_sight.h"

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

namespace {

// From so many cameras on, those that see nothing of a chunk's points are left out of its ranking. Their weights are 0
// either way.
constexpr int kManyCameras = 512;

bool OnlyWhoSeesCounts(const ViewSetup& setup) {
  return setup.settings.field_of_view && setup.settings.combine == Combine::kSmooth && !setup.method;
}

// A chunk's rays, and where they came from.
struct Chunk {
  RaySamples rays;
  Eigen::AlignedBox3f box;
  void Take(const RaySamples& from, std::span<const std::uint32_t> which) {
    rays.direction.clear();
    rays.t.clear();
    rays.normal.clear();
    box.setEmpty();
    for (const std::uint32_t i : which) {
      rays.direction.push_back(from.direction[i]);
      rays.t.push_back(from.t[i]);
      if (i < from.normal.size()) rays.normal.push_back(from.normal[i]);
      box.extend(from.t[i] * from.direction[i]);
    }
  }
};

// What a thread ranks with: the view's setup with some of its cameras.
class Part {
 public:
  explicit Part(const ViewSetup& setup) : all_(setup) {
    part_.desired = setup.desired;
    part_.settings = setup.settings;
    part_.ray_from_pixel = setup.ray_from_pixel;
    part_.focal_px = setup.focal_px;
  }
  const ViewSetup& Seeing(const Eigen::AlignedBox3f& box) {
    CamerasInSight(all_.sources, box, seeing_);
    Subset(all_.sources, seeing_, part_.sources);
    return part_;
  }
  std::int32_t Camera(std::int32_t of_part) const { return seeing_[static_cast<std::size_t>(of_part)]; }

 private:
  const ViewSetup& all_;
  ViewSetup part_;
  std::vector<std::int32_t> seeing_;
};

}  // namespace

void WeighSamples(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
                  const ForRanges& for_ranges, WeightTable& table, OptimumCounts& counts) {
  // Points that lie close together are seen by few cameras.
  const bool many = setup.sources.count >= kManyCameras && OnlyWhoSeesCounts(setup);
  std::vector<std::uint32_t> order;
  if (many) {
    order = CoherentOrder(rays, kRaysAChunk);
  } else {
    order.resize(rays.size());
    std::iota(order.begin(), order.end(), 0U);
  }
  const std::size_t chunks = (order.size() + kRaysAChunk - 1) / kRaysAChunk;
  std::vector<WeightTable> tables(chunks);
  std::vector<OptimumCounts> counted(chunks);
  for_ranges(chunks, 1, [&](std::size_t begin, std::size_t end) {
    WeighScratch scratch;
    Chunk chunk;
    std::optional<Part> part;
    if (many) part.emplace(setup);
    for (std::size_t c = begin; c < end; ++c) {
      chunk.Take(rays,
                 std::span(order).subspan(c * kRaysAChunk, std::min(kRaysAChunk, order.size() - c * kRaysAChunk)));
      Reconstruct(part ? part->Seeing(chunk.box) : setup, visibility, chunk.rays, tables[c], counted[c], scratch);
      if (part)
        for (std::int32_t& camera : tables[c].camera) camera = part->Camera(camera);
      // A triangle draws few photos: the optimum's weights over all of them are reduced, continuously, to the k
      // largest.
      if (setup.settings.similarity == Similarity::kFull && setup.settings.k > 0)
        KeepLargest(tables[c], setup.settings.k);
      SortByCamera(tables[c]);
    }
  });
  // In the rays' own order.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> row(rays.size(), {0, 0});  // of which chunk, which of its rays
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  for (auto& r : row) r.first = kNone;
  for (std::size_t i = 0; i < order.size(); ++i)
    row[order[i]] = {static_cast<std::uint32_t>(i / kRaysAChunk), static_cast<std::uint32_t>(i % kRaysAChunk)};
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.clear();
  for (const auto& [c, i] : row) {
    if (c == kNone) {  // it misses the proxy
      table.alpha.push_back(0);
    } else {
      const WeightTable& from = tables[c];
      const auto begin = static_cast<std::ptrdiff_t>(from.first[i]),
                 end = static_cast<std::ptrdiff_t>(from.first[i + 1]);
      table.camera.insert(table.camera.end(), from.camera.begin() + begin, from.camera.begin() + end);
      table.weight.insert(table.weight.end(), from.weight.begin() + begin, from.weight.begin() + end);
      table.alpha.push_back(from.alpha[i]);
    }
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
  for (const OptimumCounts& c : counted) counts += c;
}

}  // namespace lumi
