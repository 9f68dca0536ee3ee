// The sparse frame plan (thesis sec. 5.1.3 and 5.2): weights at few samples of the view, interpolated across triangles
// that each lie in one plane of the proxy. A triangle is drawn once, with all its photos, and the depth buffer resolves
// which of several triangles over a pixel is seen. How it is made and blended: docs/sparse.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/optimum/optimum.h"
#include "render/radiance/rays.h"
#include "render/radiance/sparse/sparse_proxy.h"
#include "render/radiance/visibility.h"

namespace lumi {

// How the caller runs a loop: body(begin, end) over [0, count) in chunks of at least `grain`, in any order, perhaps at
// the same time (ParallelFor of scene/program/parallel.h; no threads here).
using ForRanges = std::function<void(std::size_t count, std::size_t grain,
                                     const std::function<void(std::size_t, std::size_t)>& body)>;

struct SparseTriangle {
  std::array<std::int32_t, 3> vertex;
  std::int32_t first = 0, count = 0;  // of its photos, in SparsePlan::camera and ::weight
  std::int32_t face = -1;             // of the proxy
  bool inside = false;                // no photo of the triangle ends in it or fades at its border: no gate is needed
  bool alone = false;                 // no other triangle lies over its pixels: no depth test is needed
};

// Where the samples are and which triangles they make: a plan without weights.
struct SparseGeometry {
  // Vertices, all in front of the view (triangles are clipped at the near plane).
  std::vector<Eigen::Vector2f> x_px;    // in the view; may lie outside it
  std::vector<Eigen::Vector3f> offset;  // proxy point - desired centre, normalised units
  std::vector<Eigen::Vector3f> normal;  // of the proxy there, unit
  std::vector<SparseTriangle> triangles;
  // Few facets: cell c of the grid (row by row) holds triangles first_of_cell[c] .. first_of_cell[c + 1], and no
  // triangle reaches into another cell. Empty for fine meshes.
  std::vector<std::int32_t> first_of_cell;
  std::vector<Eigen::Vector2f> epipoles_px;  // samples that are photos' centres
};

// The optimum's weights may be negative. Their sum is limited, continuously, to half of the positive sum: otherwise a
// gate that closes a positive weight would leave sums near 0.
constexpr float kMostTaken = 0.5F;

struct SparsePlan : SparseGeometry {
  std::vector<float> alpha;  // of a vertex; 0: no photo sees it
  // For each triangle, the union of its vertices' photos (at most 3k), ascending: weights at the three vertices, to be
  // interpolated linearly in the image.
  std::vector<std::int32_t> camera;
  std::vector<std::array<float, 3>> weight;
  std::vector<std::uint8_t> ends;  // 1: the photo ends in the triangle or fades there (a weight's gate is below 1)
  int samples = 0;                 // rays at which weights were computed
  OptimumCounts optimum;
};

// settings.Sparse() must hold. Replaces `plan`, reusing its memory. `visibility`: nullptr where it is off.
void PlanSparse(const ViewSetup& setup, const SparseProxy& proxy, const VisibilityMaps* visibility,
                const ForRanges& for_ranges, SparsePlan& plan);

// Its first half: samples and triangles. Grid lines, the borders of the proxy's facets and (settings.epipoles) the
// photos' centres for few facets; the mesh's own triangles, cut to the size of a grid cell, for many.
void TessellateView(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges, SparseGeometry& out);

}  // namespace lumi
