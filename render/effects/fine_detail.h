// How much fine detail a photo shows around a point, against its coarser detail there: energies of the gradients across
// the weaker direction. Camera motion removes fine detail along its direction, defocus in every direction; exposure,
// contrast and haze change fine and coarse detail alike.
#pragma once

#include <optional>

#include "scene/model/image.h"

namespace lumi {

// Standard deviation of a photo's grey values (the mean of its channels) from noise, in its flattest parts.
double NoiseSigma(const Image8& photo);

struct FineDetail {
  double log_ratio = 0;      // fine over coarse, natural logarithm; both after subtracting noise
  double log_fine = 0;       // fine detail over the brightness, which contrast changes too
  double fine_to_noise = 0;  // below about 4: a patch without texture
};

// At (x, y) in the pixels of an RGB photo, whose noise is `noise_sigma`. `step_px` >= 1: another photo of the same
// place, with pixels as large as `step_px` of these, has the same ratio. nullopt near the photo's border, or where it
// is nearly black or white.
std::optional<FineDetail> MeasureFineDetail(const Image8& photo, double x, double y, double step_px,
                                            double noise_sigma);

}  // namespace lumi
