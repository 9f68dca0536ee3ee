// Blends a SparsePlan on the CPU: each triangle once, with all its photos.
#pragma once

#include <vector>

#include "render/cpu/layers.h"
#include "render/photos/photo_set.h"
#include "render/radiance/sparse/sparse_plan.h"
#include "scene/model/image.h"

namespace lumi {

// What is blended: photos, or (photos == nullptr) a constant colour for each.
struct BlendSources {
  const PhotoLevels* photos = nullptr;
  const std::vector<Eigen::Vector3f>* colors = nullptr;  // RGB [0,1]
  std::vector<float> gains;                              // a factor on each photo's colours; empty: 1
};

// Into `image`: RGBA, [0,1], premultiplied, the view's size, zero before. Parallel inside.
void BlendSparse(const SparsePlan& plan, const ViewSetup& setup, const BlendSources& sources, ImageF& image);

}  // namespace lumi
