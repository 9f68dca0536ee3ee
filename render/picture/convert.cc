#include "render/picture/convert.h"

#include <algorithm>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr std::size_t kRowsAtOnce = 32;

std::uint8_t Code(float x) { return static_cast<std::uint8_t>(std::min(std::max(x * 255.0F + 0.5F, 0.0F), 255.0F)); }

template <int channels, typename Convert>
Image8 Converted(const ImageF& image, const Convert& convert) {
  Image8 out(image.width, image.height, channels);
  ParallelFor(static_cast<std::size_t>(image.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      const float* in = image.Row(y);
      std::uint8_t* o = out.Row(y);
      for (int x = 0; x < image.width; ++x, in += 4, o += channels) convert(in, o);
    }
  });
  return out;
}

}  // namespace

Image8 ToRgb8(const ImageF& image) {
  return Converted<3>(image, [](const float* in, std::uint8_t* o) {
    for (int c = 0; c < 3; ++c) o[c] = Code(in[c]);
  });
}

Image8 ToRgba8(const ImageF& image) {
  return Converted<4>(image, [](const float* in, std::uint8_t* o) {
    for (int c = 0; c < 3; ++c) o[c] = in[3] > 0 ? Code(in[c] / in[3]) : 0;
    o[3] = Code(in[3]);
  });
}

Image8 ShownToRgba8(const ImageF& image) {
  return Converted<4>(image, [](const float* in, std::uint8_t* o) {
    for (int c = 0; c < 4; ++c) o[c] = Code(in[c]);
  });
}

double Coverage(const ImageF& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const float* in = image.Row(y);
    float row = 0;
    for (int x = 0; x < image.width; ++x) row += in[4 * x + 3];
    sum += row;
  }
  return sum / (static_cast<double>(image.width) * image.height);
}

}  // namespace lumi
