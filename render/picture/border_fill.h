// What to show where no photo sees: smooth colours from around the hole (pull and push: Gortler et al. 1996,
// sec. 3.4.1; a pyramid of weighted means, read at the finest level that knows anything). Not a guess at what is there,
// and it does not flicker.
#pragma once

#include "scene/model/image.h"

namespace lumi {

// RGBA, premultiplied; alpha is 1 everywhere afterwards, and what was opaque stays as it was. Nothing happens to a
// picture without any colour.
void FillSmoothly(ImageF& image);

// The same for a picture that is kept: its colours are what is shown, opaque, and its alpha stays as it was. So alpha
// still says how much of a pixel the photos saw, and what was filled can be told from what was seen.
void FillAndMark(ImageF& image);

}  // namespace lumi
