// The real-time weights (render/radiance/weights.h) of few photos over a batch of pixels: the pixels in lanes, the
// photos outside.
#pragma once

#include <cstddef>
#include <vector>

#include "render/cpu/layers.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"

namespace lumi {

struct CandidateRay {
  PhotoMap map;                  // as PhotoMaps::AtDepths: scaled by the inverse depth
  float dx = 0, dy = 0, dz = 0;  // its centre - the desired one
  float width_px = 0, height_px = 0, feather_px = 0;
  bool inner = false;                // f = 1 at every pixel: field of view need not be evaluated
  float terms = 0;                   // terms of h that are the same at all pixels (PhotoTerms)
  float focal_ratio = 1;             // focal length of the view / its own: read by Resolution::kDistance
  std::int32_t view = 0;             // into Sources::views
  const float* depth_map = nullptr;  // of VisibilityMaps, or nullptr: everything is visible
};

// How the proxy's plane lies at each pixel, for Resolution::kJacobian: 1 / depth changes by (dx, dy) / facing from
// pixel to pixel. With n the plane's normal, r the pixel's ray of depth 1 and s = 1 / depth: n.r, and s n.(the change
// of r). Any common factor serves; facing = 0: the plane is seen edge on.
struct PlaneSlopes {
  alignas(64) float dx[kBatch], dy[kBatch], facing[kBatch];
};

struct CandidateRule {
  Linear ray_x, ray_y, ray_z;  // the pixels' rays, depth 1
  int k = 4;                   // 1..kMaxBlend
  float alpha = 1, gamma = 1;
  bool field_of_view = true;  // off: f = 1, and beyond a photo's border its share of alpha is missing
  const PhotoFields* fields = nullptr;
  const RadianceSettings* settings = nullptr;  // alpha > 0; what the terms of h read
  const PlaneSlopes* slopes = nullptr;         // of the padded batch; read by Resolution::kJacobian
  int map_width = 0, map_height = 0;
};

// `weights` gets kBatch floats a candidate and b.alpha is set, both for the padded batch; b.inverse_depth holds 1 /
// depth, > 0. Sum 1 where alpha > 0 (field of view off: alpha is the sum).
void WeighCandidates(LayerBatch& b, const std::vector<CandidateRay>& candidates, const CandidateRule& rule,
                     std::vector<float>& weights);

}  // namespace lumi
