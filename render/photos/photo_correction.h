// A photo's own colours taken out where it is read, and given back to a picture that is compared with it: passes over
// whole pictures, beside the kernels that blend.
#pragma once

#include "scene/model/image.h"
#include "scene/model/photo_correction.h"

namespace lumi {

// RGB.
void Correct(const PhotoCorrection& correction, Image8& photo);
// The inverse, of a picture of the photo's own view at any size: RGBA, colours multiplied by alpha.
void GiveBack(const PhotoCorrection& correction, ImageF& picture);

}  // namespace lumi
