// The real-time weights (render/radiance/weights.h) of few photos over a batch of pixels: the pixels in lanes, the photos
// outside.
#pragma once

#include <cstddef>
#include <vector>

#include "render/cpu/layers.h"

namespace lumi {

struct CandidateRay {
  PhotoMap map;  // as PhotoMaps::AtDepths: scaled by the inverse depth
  float dx = 0, dy = 0, dz = 0;  // its centre - the desired one
  float width_px = 0, height_px = 0, feather_px = 0;
  bool inner = false;  // f = 1 at every pixel: field of view need not be evaluated
  const float* depth_map = nullptr;  // of VisibilityMaps, or nullptr: everything is visible
};

struct CandidateRule {
  Linear ray_x, ray_y, ray_z;  // the pixels' rays, depth 1
  int k = 4;  // 1..kMaxBlend
  float gamma = 1;
  bool field_of_view = true;  // off: f = 1, and a photo that ends leaves its share of alpha missing
  int map_width = 0, map_height = 0;
};

// `weights` gets kBatch floats a candidate and b.alpha is set, both for the padded batch; b.inverse_depth holds 1 / depth,
// > 0. Sum 1 where alpha > 0 (field of view off: alpha is the sum).
void WeighCandidates(LayerBatch& b, const std::vector<CandidateRay>& candidates, const CandidateRule& rule, std::vector<float>& weights);

}  // namespace lumi
