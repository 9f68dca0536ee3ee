// From the renderer's picture (float RGBA, premultiplied) to what is shown and compared.
#pragma once

#include "scene/model/image.h"

namespace lumi {

// RGB over black: a hole counts as black.
Image8 ToRgb8(const ImageF& premultiplied);
// RGBA, straight alpha, for PNG.
Image8 ToRgba8(const ImageF& premultiplied);
// The same for a picture whose colours are not premultiplied but as shown (FillAndMark).
Image8 ShownToRgba8(const ImageF& shown);
// Mean of alpha over all pixels.
double Coverage(const ImageF& premultiplied);

}  // namespace lumi
