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
  std::vector<RadialFalloff> of_view;  // that of its lens; none if the corner is not darker by more than chance (99 %)
  double corner = 1;                   // corner over middle, of the lens that shows it most clearly
  double noise = 1;  // the corner that chance alone may give (99 %), <= 1; 0: the data determine no lens
  bool Seen() const { return corner < 0.97 && corner < noise; }  // 3 %: seven code values in full white
};

// `lens_of_view`: lens numbers from 0; -1: unknown.
Vignetting EstimateVignetting(const std::vector<ColorSample>& samples, const std::vector<int>& lens_of_view);

// Cameras with the same photo size and the same focal length (to 5 %) count as one lens, because reconstructions often
// give each photo its own camera. -1: the lens has fewer than sixteen photos, or is not among the eight with most
// photos.
std::vector<int> LensesOfViews(const Scene& scene);

}  // namespace lumi
