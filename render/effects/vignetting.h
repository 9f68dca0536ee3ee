// How much darker a lens shows the corners of its photos, from scene points that photos see at different distances from
// their middles: log c = a_point + log gain_photo + log falloff_lens(r), by robust least squares over all of them at
// once, the points eliminated.
#pragma once

#include <cstddef>
#include <vector>

#include "render/effects/track_colors.h"
#include "scene/model/photo_correction.h"

namespace lumi {

struct Vignetting {
  std::vector<RadialFalloff> of_view;  // that of its lens; none where it is not darker by more than chance (99 %)
  double corner = 1;                   // corner over middle, of the lens that shows it most clearly
  double noise = 1;  // what that may be by chance alone (99 %), <= 1; 0 where the data say nothing of any lens
  bool Seen() const { return corner < 0.97 && corner < noise; }  // 3 %: seven code values in full white
};

// `lens_of_view`: numbers from 0; -1: of no lens that is known.
Vignetting EstimateVignetting(const std::vector<ColorSample>& samples, const std::vector<int>& lens_of_view);

// Cameras of one photo size, and of one focal length to 5 %, are one lens: reconstructions often give each photo a
// camera of its own. -1: of a lens with fewer than sixteen photos, or beyond the eight of most photos.
std::vector<int> LensesOfViews(const Scene& scene);

}  // namespace lumi
