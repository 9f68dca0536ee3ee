// Colours of the same scene points in several photos, from which exposures, white balances and vignetting are
// estimated.
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
  std::array<float, 3> rgb{};  // code values, neither dark enough to be noise nor bright enough to be clipped
  double r2 = 0;               // distance from the photo's middle over half of its diagonal, squared
};

// Calls its second argument with the photo of a view; thread-safe.
using PhotoReader = std::function<void(std::size_t view, const std::function<void(const Photo&)>& sample)>;

// Samples of the points with the longest tracks, until each photo has some hundred; each point has at least two
// samples.
std::vector<ColorSample> SampleTrackColors(const Scene& scene, const PhotoReader& photo_of);

}  // namespace lumi
