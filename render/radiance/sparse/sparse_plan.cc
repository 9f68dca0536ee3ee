#include "render/radiance/sparse/sparse_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "render/radiance/sparse/tessellate.h"
#include "render/radiance/sparse/weigh_samples.h"

namespace lumi {
namespace {

// Triangles a chunk.
constexpr std::size_t kTrianglesAChunk = 128;

// Whether a photo's gate is 1 at a point: min(1, f / kAlphaFullAt), or, with field of view off, whether the photo
// contains it. The region is convex in the photo, so testing a triangle's corners is enough.
class Gate {
 public:
  explicit Gate(const ViewSetup& setup) : r_(setup.sources), fading_(setup.settings.field_of_view) {
    // f = sin^2(pi s / 2) reaches kAlphaFullAt at this share of the feather.
    share_ = std::asin(std::sqrt(kAlphaFullAt)) / 1.57079632679F * 1.0001F;
  }
  bool Open(std::int32_t camera, const Eigen::Vector3f& offset) const {
    const auto j = static_cast<std::size_t>(camera);
    const float x = offset.x() - r_.dx[j], y = offset.y() - r_.dy[j], z = offset.z() - r_.dz[j];
    const float w = r_.m[6][j] * x + r_.m[7][j] * y + r_.m[8][j] * z;
    const float u = r_.m[0][j] * x + r_.m[1][j] * y + r_.m[2][j] * z,
                v = r_.m[3][j] * x + r_.m[4][j] * y + r_.m[5][j] * z;
    // A photo's own view is seen to its very border.
    const bool own = r_.dx[j] == 0 && r_.dy[j] == 0 && r_.dz[j] == 0;
    const float margin = own ? -0.01F : fading_ ? share_ * r_.feather_px[j] : 0.0F;
    return w > 0 && u >= margin * w && v >= margin * w && r_.width_px[j] * w - u >= margin * w &&
           r_.height_px[j] * w - v >= margin * w;
  }

 private:
  const RelativeSources& r_;
  const bool fading_;
  float share_ = 0;
};

struct CameraWeights {
  std::vector<std::int32_t> camera, count;
  std::vector<std::array<float, 3>> weight;
  std::vector<std::uint8_t> ends;
};

void Unite(const SparsePlan& plan, const WeightTable& table, const Gate& gate, const SparseTriangle& triangle,
           CameraWeights& out) {
  std::array<std::int32_t, 3> at, end;
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = table.first[static_cast<std::size_t>(triangle.vertex[i])];
    end[i] = table.first[static_cast<std::size_t>(triangle.vertex[i]) + 1];
  }
  std::int32_t count = 0;
  for (;; ++count) {
    std::int32_t next = std::numeric_limits<std::int32_t>::max();
    for (std::size_t i = 0; i < 3; ++i)
      if (at[i] < end[i]) next = std::min(next, table.camera[static_cast<std::size_t>(at[i])]);
    if (next == std::numeric_limits<std::int32_t>::max()) break;
    auto& weight = out.weight.emplace_back();
    bool open = true;
    for (std::size_t i = 0; i < 3; ++i) {
      weight[i] = 0;
      if (at[i] < end[i] && table.camera[static_cast<std::size_t>(at[i])] == next)
        weight[i] = table.weight[static_cast<std::size_t>(at[i]++)];
      open = open && gate.Open(next, plan.offset[static_cast<std::size_t>(triangle.vertex[i])]);
    }
    out.camera.push_back(next);
    out.ends.push_back(open ? 0 : 1);
  }
  out.count.push_back(count);
}

}  // namespace

void TessellateView(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges,
                    SparseGeometry& out) {
  if (!setup.settings.Sparse()) throw std::invalid_argument("TessellateView: settings without a grid");
  out.x_px.clear();
  out.offset.clear();
  out.normal.clear();
  out.triangles.clear();
  out.first_of_cell.clear();
  out.epipoles_px.clear();
#ifdef LUMI_NO_CGAL
  TessellateMesh(setup, proxy, for_ranges, out);
#else
  (proxy.coarse() ? TessellateFacets : TessellateMesh)(setup, proxy, for_ranges, out);
#endif
}

void PlanSparse(const ViewSetup& setup, const SparseProxy& proxy, const VisibilityMaps* visibility,
                const ForRanges& for_ranges, SparsePlan& plan) {
  TessellateView(setup, proxy, for_ranges, plan);
  const std::size_t n = plan.offset.size();
  const RaySamples rays = VertexRays(setup, plan);
  WeightTable table;
  plan.optimum = {};
  WeighSamples(setup, visibility, rays, for_ranges, table, plan.optimum);
  plan.samples = static_cast<int>(n);
  plan.alpha = std::move(table.alpha);

  const Gate gate(setup);
  const std::size_t chunks = (plan.triangles.size() + kTrianglesAChunk - 1) / kTrianglesAChunk;
  std::vector<CameraWeights> entries(chunks);
  for_ranges(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      for (std::size_t t = c * kTrianglesAChunk; t < std::min(plan.triangles.size(), (c + 1) * kTrianglesAChunk); ++t)
        Unite(plan, table, gate, plan.triangles[t], entries[c]);
  });
  plan.camera.clear();
  plan.weight.clear();
  plan.ends.clear();
  std::size_t t = 0;
  for (const CameraWeights& e : entries) {
    for (const std::int32_t count : e.count) {
      plan.triangles[t].first =
          static_cast<std::int32_t>(t == 0 ? 0 : plan.triangles[t - 1].first + plan.triangles[t - 1].count);
      plan.triangles[t++].count = count;
    }
    plan.camera.insert(plan.camera.end(), e.camera.begin(), e.camera.end());
    plan.weight.insert(plan.weight.end(), e.weight.begin(), e.weight.end());
    plan.ends.insert(plan.ends.end(), e.ends.begin(), e.ends.end());
  }
  for (SparseTriangle& s : plan.triangles) {
    bool inside = s.count > 0;
    for (std::int32_t i = s.first; i < s.first + s.count; ++i)
      inside = inside && plan.ends[static_cast<std::size_t>(i)] == 0;
    // Where a corner is a hole its weights do not sum to 1: what is interpolated wants normalising.
    for (const std::int32_t v : s.vertex) inside = inside && plan.alpha[static_cast<std::size_t>(v)] > 0;
    s.inside = inside;
  }
}

}  // namespace lumi
