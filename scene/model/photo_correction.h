// What brings a photo's code values to the colours that its scene's photos share: a factor for each channel (white
// balance) and one that grows towards the corners (vignetting). All factors are at most 1, so that no highlight is
// lost; what that takes of the brightness stands in `scale`, and the photo's gain has it.
#pragma once

#include <array>
#include <cmath>

namespace lumi {

// A lens's brightness at r, the distance from a photo's middle over half of its diagonal: exp(a r^2 + b r^4), 1 in the
// middle. The exponent is linear in a and b, and no a and b make the brightness 0 or less.
struct RadialFalloff {
  double a = 0, b = 0;

  double At(double r2) const { return std::exp((a + b * r2) * r2); }
  double Corner() const { return std::exp(a + b); }
  bool operator==(const RadialFalloff&) const = default;
};

struct PhotoCorrection {
  std::array<double, 3> channel = {1, 1, 1};  // RGB; `scale` is in them
  RadialFalloff falloff;                      // divided out: a factor is channel / falloff
  double scale = 1;                           // the same for all photos of a scene
};

}  // namespace lumi
