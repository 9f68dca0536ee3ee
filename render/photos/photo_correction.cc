#include "render/photos/photo_correction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lumi {
namespace {

// A lens's brightness over r^2: an exponential a pixel would cost more than the rest of the pass.
class FalloffTable {
 public:
  explicit FalloffTable(const RadialFalloff& falloff, int width, int height)
      : middle_x_(0.5F * static_cast<float>(width)), middle_y_(0.5F * static_cast<float>(height)) {
    steps_a_px2_ = static_cast<float>(kSteps) / (middle_x_ * middle_x_ + middle_y_ * middle_y_);
    for (std::size_t i = 0; i < value_.size(); ++i)
      value_[i] = static_cast<float>(falloff.At(std::min(1.0, static_cast<double>(i) / kSteps)));
  }
  float At(int x, int y) const {
    const float dx = static_cast<float>(x) + 0.5F - middle_x_, dy = static_cast<float>(y) + 0.5F - middle_y_;
    const float place = (dx * dx + dy * dy) * steps_a_px2_;
    const auto i = static_cast<std::size_t>(place);
    return value_[i] + (place - static_cast<float>(i)) * (value_[i + 1] - value_[i]);
  }

 private:
  static constexpr int kSteps = 512;  // linear between them: 1e-5 of what an exponential would give
  float middle_x_, middle_y_, steps_a_px2_ = 0;
  std::array<float, kSteps + 2> value_{};
};

std::array<float, 3> Channels(const PhotoCorrection& correction) {
  return {static_cast<float>(correction.channel[0]), static_cast<float>(correction.channel[1]),
          static_cast<float>(correction.channel[2])};
}

}  // namespace

void Correct(const PhotoCorrection& correction, Image8& photo) {
  const FalloffTable falloff(correction.falloff, photo.width, photo.height);
  const std::array<float, 3> channel = Channels(correction);
  for (int y = 0; y < photo.height; ++y) {
    std::uint8_t* rgb = photo.Row(y);
    for (int x = 0; x < photo.width; ++x, rgb += 3) {
      const float lens = 1 / falloff.At(x, y);
      for (std::size_t c = 0; c < 3; ++c)
        rgb[c] = static_cast<std::uint8_t>(std::min(255.0F, static_cast<float>(rgb[c]) * channel[c] * lens + 0.5F));
    }
  }
}

void GiveBack(const PhotoCorrection& correction, ImageF& picture) {
  const FalloffTable falloff(correction.falloff, picture.width, picture.height);
  const std::array<float, 3> channel = Channels(correction);
  for (int y = 0; y < picture.height; ++y) {
    float* rgba = picture.Row(y);
    for (int x = 0; x < picture.width; ++x, rgba += 4) {
      const float lens = falloff.At(x, y);
      for (std::size_t c = 0; c < 3; ++c) rgba[c] *= lens / channel[c];
    }
  }
}

}  // namespace lumi
