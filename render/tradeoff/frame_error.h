// How far one picture is from another, as the tables of accuracy against time print it.
#pragma once

#include "scene/files/json_keys.h"
#include "scene/model/image.h"

namespace lumi {

struct FrameError {
  double psnr_db = 0;  // 99 where equal
  double ssim = 0;
  // Squared error summed over the three channels, mean over pixels, code values (the measure of Fig. 5-4).
  double mse = 0;
  double coverage = 0;         // of the picture
  double false_color_mse = 0;  // where false colours are compared, too
};

void ListKeys(JsonKeys& j, FrameError& e);

// Pictures of the renderer (premultiplied, over black), in float: a difference below a code value counts. Throws
// std::invalid_argument where the sizes differ.
FrameError ErrorBetween(const ImageF& image, const ImageF& reference);
// Against a photograph, in its 8 bits, as everywhere else.
FrameError ErrorAgainstPhoto(const ImageF& image, const Image8& photo);
// Of the mean squared error alone: for false colour, whose structure means nothing.
double SquaredError(const ImageF& image, const ImageF& reference);

// The means of the fields.
FrameError Mean(const std::vector<FrameError>& errors);

}  // namespace lumi
