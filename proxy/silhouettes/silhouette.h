// Silhouettes: which pixels of a photo show the object (255) and which do not (0). From what the user has: masks,
// alpha, a known background, a rule on colours (colour_rule.h), a box around the object (grab_cut.h).
#pragma once

#include <array>
#include <string>

#include "scene/model/image.h"

namespace lumi {

// Grey, RGB or RGBA: object where the mean of the colours is 128 or more.
Image8 SilhouetteFromMask(const Image8& mask);
// Object where alpha is 128 or more. Throws std::invalid_argument without an alpha channel.
Image8 SilhouetteFromAlpha(const Image8& rgba);
// Whether any pixel is not fully opaque.
bool HasAlpha(const Image8& rgba);
// Object where a pixel's colour is farther than `threshold` (Euclidean, 0..441) from the background's: a photo of the
// same size, or one colour. The border's own median colour stands for an unknown background of one colour.
Image8 SilhouetteFromBackground(const Image8& photo, const Image8& background, double threshold);
Image8 SilhouetteFromBackground(const Image8& photo, const std::array<double, 3>& rgb, double threshold);
std::array<double, 3> BorderColour(const Image8& photo);

// For silhouettes whose pixels a rule has judged one by one: removes what no object's outline has.
struct CleanOptions {
  double close_px = 0;       // gaps up to about twice this wide are bridged, 0..100: dilated by it, then eroded
  double grow_px = 0;        // widened by this, or narrowed where negative, -100..100
  int min_part_px = 0;       // parts with fewer pixels are removed
  double min_radius_px = 0;  // parts that hold no circle of this radius are removed (specks, seams along the image's
                             // sides), 0..100; of nothing but such the one that holds the largest stays
  int min_hole_px = 0;       // holes with fewer pixels are filled
};
std::string Validate(const CleanOptions& options);  // empty, or what is wrong
Image8 Clean(const Image8& silhouette, const CleanOptions& options);

enum class SilhouetteKind {
  kNormal,
  kEmpty,  // no pixel
  kFull,   // every pixel
  kTiny,   // an inscribed circle of less than two pixels' radius: its shape is that of the pixels
};
struct SilhouetteInfo {
  SilhouetteKind kind = SilhouetteKind::kNormal;
  std::size_t pixels = 0;
  int parts = 0;  // connected over corners too
  int holes = 0;  // connected over sides
  bool touches_border = false;
};
SilhouetteInfo Describe(const Image8& silhouette);
std::string Name(SilhouetteKind kind);

}  // namespace lumi
