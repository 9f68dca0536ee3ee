// The sparse frame plan (thesis sec. 5.1.3 and 5.2): weights at few samples of the view, interpolated across triangles
// that each lie in one plane of the proxy. A triangle is drawn once, with all its photos, and the depth buffer resolves
// which of several triangles over a pixel is seen.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/optimum.h"
#include "scene/geometry/mesh.h"

namespace lumi {

struct SparseTriangle {
  std::array<std::int32_t, 3> vertex;
  std::int32_t first = 0, count = 0;       // of its photos, in SparsePlan::camera and ::weight
  std::int32_t face = -1;                  // of the proxy
  bool inside = false;                     // every photo of the triangle contains all of it, feather excluded: no gate is needed
};

struct SparsePlan {
  // Vertices, all in front of the view (triangles are clipped at the near plane).
  std::vector<Eigen::Vector2f> x_px;       // in the view; may lie outside it
  std::vector<Eigen::Vector3f> offset;     // proxy point - desired centre, normalised units
  std::vector<float> alpha;
  std::vector<SparseTriangle> triangles;
  // For each triangle, the union of its vertices' photos (at most 3k): weights at the three vertices, to be interpolated
  // linearly in the image.
  std::vector<std::int32_t> camera;
  std::vector<std::array<float, 3>> weight;
  std::vector<Eigen::Vector2f> epipoles_px;  // samples that are photos' centres
  int samples = 0;
  OptimumCounts optimum;
};

// The proxy as the sparse plan wants it: made once a proxy.
class SparseProxy;

// The candidate plan (ours): the view is cut into cells, columns x rows samples at their corners; a cell lists the k + 3
// best photos of each of its samples, and every pixel weighs its cell's photos exactly.
struct CandidatePlan {
  int cell_columns = 0, cell_rows = 0;     // one fewer than the samples a side
  double cell_width_px = 0, cell_height_px = 0;
  std::vector<std::int32_t> first;         // cells + 1
  std::vector<std::int32_t> camera;        // ascending in a cell
  std::vector<float> f_largest;            // a cell's largest field-of-view value over all photos: feeds alpha
};

}  // namespace lumi
