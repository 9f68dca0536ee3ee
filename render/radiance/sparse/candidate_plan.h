// The candidate plan (ours, not the thesis's): the sparse samples choose photos instead of weights. The view is cut
// into cells, columns x rows samples at their corners; a cell lists the k + 3 best photos of each of its samples, and
// every pixel weighs its cell's photos exactly. A photo is lost only if it is among a pixel's best but not among those
// of any sample.
#pragma once

#include <cstdint>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/proxy_tracer.h"
#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {

// Photos a sample lists beyond k.
constexpr int kSpareCandidates = 3;

struct CandidatePlan {
  int cell_columns = 0, cell_rows = 0;  // one fewer than the samples a side
  double cell_width_px = 0, cell_height_px = 0;
  std::vector<std::int32_t> first;   // cells + 1, row by row
  std::vector<std::int32_t> camera;  // ascending in a cell
  // The proxy's facets in each cell (SparseGeometry::first_of_cell), where there are few; no triangles for fine meshes.
  SparseGeometry geometry;
  int samples = 0;  // rays at which photos were ranked
};

// settings: Sparse(), k > 0, similarity kIdentity. For few facets the samples are the tessellation's vertices, so that
// every visible facet in a cell has its own; for a fine mesh the grid's, and more of them in cells where the mesh ends
// or its depth varies. Cells with a hole among their samples are sampled once more between them. Replaces `plan`.
void PlanCandidates(const ViewSetup& setup, const SparseProxy& proxy, const ProxyTracer& tracer,
                    const VisibilityMaps* visibility, const ForRanges& for_ranges, CandidatePlan& plan);

// Pixels whose centres lie in a cell; empty ones have a width or height of 0.
PixelWindow CellPixels(const CandidatePlan& plan, int cell, const Eigen::Vector2i& size_px);

// A cell's pixels, each weighed on the cell's photos alone, by any settings that PlanCandidates takes. `cell_setup` is
// scratch: it becomes `setup` with those photos. Replaces `out`.
void PlanCellPixels(const ViewSetup& setup, const ProxyTracer& tracer, const VisibilityMaps* visibility,
                    const CandidatePlan& plan, int cell, ViewSetup& cell_setup, FramePlan& out, WeighScratch& scratch);

}  // namespace lumi
