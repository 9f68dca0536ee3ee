// The tessellation of a sparse plan drawn over its picture (thesis Figs. 5-5 and 5-8, last rows).
#pragma once

#include "render/radiance/sparse/sparse_plan.h"
#include "scene/model/image.h"

namespace lumi {

// Edges one pixel wide, epipoles as crosses, over a premultiplied RGBA picture in [0,1].
void DrawTessellation(const SparseGeometry& geometry, ImageF& image);
// The cells of a grid of columns x rows samples, and the epipoles.
void DrawGrid(int columns, int rows, const std::vector<Eigen::Vector2f>& epipoles_px, ImageF& image);

}  // namespace lumi
