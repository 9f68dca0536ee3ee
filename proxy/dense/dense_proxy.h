// A closed mesh through dense points: depth maps of all photos (stereo.h), fused where photos agree (fusion.h),
// together with the sparse points, through the same graph cut as `delaunay`.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/dense/fusion.h"
#include "proxy/dense/stereo.h"

namespace lumi {

struct DenseOptions {
  StereoOptions stereo;
  FusionOptions fusion;
  double merge_px = 1.5;  // fused points nearer than so many pixels of the finest map become one, > 0
  int faces = 60000;      // the mesh is simplified to so many (simplify.h, kInPixels), >= 1000; 0: left as it is
};
std::string Validate(const DenseOptions& options);
std::map<std::string, std::string> OptionValues(const DenseOptions& options);

struct DenseSummary {
  StereoSummary stereo;
  std::size_t fused_points = 0;
  double fusion_s = 0;
  DelaunaySummary mesh;
  std::size_t faces_before = 0;   // it was simplified
  bool reached = true;            // false: its parts and holes need more faces than wanted
  std::size_t removed_parts = 0;  // so that it needs no more (proxy/simplify/small_parts.h)
  double simplify_s = 0;
};

// Wall-clock seconds of fusion and mesh for maps of this width, within a factor of two.
double EstimateMeshSeconds(const Scene& scene, int width);

// `input` holds the maps; sparse points come from the scene. Throws DataError where photos agree on nothing.
Mesh BuildDenseProxy(const Scene& scene, const FusionInput& input, const DenseOptions& options, ProgressSink& progress,
                     DenseSummary& summary);

}  // namespace lumi
