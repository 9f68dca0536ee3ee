// The colours that photos of one scene point have in common: what exposures, white balances and vignetting are read
// off.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/scene.h"

namespace lumi {

// A photo's sight of a point.
struct ColorSample {
  std::size_t point = 0, photo = 0;
  std::array<float, 3> rgb{};  // code values: none so dark that it is noise, none so bright that it may be clipped
  double r2 = 0;               // distance from the photo's middle over half of its diagonal, squared
};

// Calls its second argument with the photo of a view; thread-safe.
using PhotoReader = std::function<void(std::size_t view, const std::function<void(const Photo&)>& sample)>;

// Of the points with the longest tracks, until each photo has some hundred; of each point two and more, or none.
std::vector<ColorSample> SampleTrackColors(const Scene& scene, const PhotoReader& photo_of);

}  // namespace lumi
