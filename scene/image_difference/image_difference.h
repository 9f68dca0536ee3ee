// How far a rendered image is from a photograph, the same everywhere: PSNR and SSIM over all pixels of 8-bit RGB, a
// hole counts as black.
#pragma once

#include <optional>

#include "scene/model/image.h"

namespace lumi {

struct ImageDifference {
  double mse = 0;            // mean over pixels and channels, code values squared
  double psnr_db = 0;        // 10 log10(255^2 / mse); 99 where equal
  double mean_absolute = 0;  // code values
  double ssim = 0;           // Wang et al. 2004: 11x11 Gaussian, sigma 1.5, on luma (Rec. 601)
};

// Same size, 3 channels each; throws std::invalid_argument otherwise.
ImageDifference Compare(const Image8& image, const Image8& reference);

// PSNR over the pixels whose mask (one channel) is above 127, 99 dB where equal; nothing where there is no such pixel.
std::optional<double> PsnrWithin(const Image8& image, const Image8& reference, const Image8& mask);

// |a - b| * gain, clamped.
Image8 DifferenceImage(const Image8& image, const Image8& reference, double gain = 4.0);

}  // namespace lumi
