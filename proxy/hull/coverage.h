// How a closed mesh's outlines fit silhouettes: each view's picture of the mesh, pixel by pixel, beside its silhouette.
#pragma once

#include <vector>

#include "proxy/hull/silhouette_cone.h"
#include "scene/geometry/mesh.h"

namespace lumi {

// 255 where the ray through a pixel's centre meets the closed mesh. Faces that reach behind the camera are left out.
Image8 RenderOutline(const Mesh& mesh, const Matrix34d& P, int width, int height);

struct SilhouetteFit {
  double coverage = 0;  // share of the silhouette's pixels that the outline covers; 1 for an empty silhouette
  double iou = 0;       // intersection over union
  double deepest_uncovered_px =
      0;  // distance of the deepest uncovered pixel from the silhouette's border (0.5: a border pixel)
};
struct UncoveredPixel {
  int x, y;
  float depth_px;  // from the silhouette's border
};
SilhouetteFit MeasureSilhouette(const Mesh& mesh, const SilhouetteView& view,
                                std::vector<UncoveredPixel>* uncovered = nullptr);
std::vector<SilhouetteFit> MeasureSilhouettes(const Mesh& mesh, const std::vector<SilhouetteView>& views,
                                              std::vector<std::vector<UncoveredPixel>>* uncovered = nullptr);

struct SilhouetteFitSummary {
  double coverage_min = 1, iou_min = 1, iou_median = 1, deepest_uncovered_px = 0;
};
SilhouetteFitSummary Summarize(const std::vector<SilhouetteFit>& fits);

// Enclosed by a closed mesh whose faces look outwards, in cubic world units.
double EnclosedVolume(const Mesh& mesh);

}  // namespace lumi
