#include "render/tradeoff/frame_error.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/picture/convert.h"
#include "scene/image_difference/image_difference.h"

namespace lumi {
namespace {

constexpr double kEqualPsnrDb = 99;
constexpr double kWhite = 255;

}  // namespace

void ListKeys(JsonKeys& j, FrameError& e) {
  j("psnr_db", e.psnr_db, "ssim", e.ssim, "mse", e.mse, "false_color_mse", e.false_color_mse);
}

double SquaredError(const ImageF& image, const ImageF& reference) {
  if (image.width != reference.width || image.height != reference.height || image.channels != 4 ||
      reference.channels != 4 || image.empty())
    throw std::invalid_argument("frame error: two RGBA pictures of one size are wanted");
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const float *a = image.Row(y), *b = reference.Row(y);
    double row = 0;
    for (int x = 0; x < image.width; ++x, a += 4, b += 4)
      for (int c = 0; c < 3; ++c) {
        // A renderer's picture may leave [0, 1] by rounding, or where the optimum's weights are negative; a screen's
        // does not.
        const double d = kWhite * (std::clamp(a[c], 0.0F, 1.0F) - std::clamp(b[c], 0.0F, 1.0F));
        row += d * d;
      }
    sum += row;
  }
  return sum / (static_cast<double>(image.width) * image.height);
}

FrameError ErrorBetween(const ImageF& image, const ImageF& reference) {
  FrameError e;
  e.mse = SquaredError(image, reference);
  e.psnr_db = e.mse > 0 ? std::min(kEqualPsnrDb, 10 * std::log10(3 * kWhite * kWhite / e.mse)) : kEqualPsnrDb;
  e.ssim = Compare(ToRgb8(image), ToRgb8(reference)).ssim;
  e.coverage = Coverage(image);
  return e;
}

FrameError ErrorAgainstPhoto(const ImageF& image, const Image8& photo) {
  const ImageDifference d = Compare(ToRgb8(image), photo);
  return {d.psnr_db, d.ssim, 3 * d.mse, Coverage(image)};
}

FrameError Mean(const std::vector<FrameError>& errors) {
  FrameError mean;
  const double n = static_cast<double>(errors.size());
  for (const FrameError& e : errors) {
    mean.psnr_db += e.psnr_db / n;
    mean.ssim += e.ssim / n;
    mean.mse += e.mse / n;
    mean.coverage += e.coverage / n;
    mean.false_color_mse += e.false_color_mse / n;
  }
  return mean;
}

}  // namespace lumi
