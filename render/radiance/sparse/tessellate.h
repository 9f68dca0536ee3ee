// The two ways of TessellateView (sparse_plan.h).
#pragma once

#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {

// Nearer than this to the view's principal plane (normalised units) a proxy is cut off.
constexpr double kNearPlane = 1e-6;

// Pixel of the sample in column i of n over `size_px` pixels.
inline double SamplePx(int i, int n, int size_px) { return static_cast<double>(i) * size_px / (n - 1); }

void TessellateFacets(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges,
                      SparseGeometry& out);
void TessellateMesh(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges, SparseGeometry& out);

}  // namespace lumi
