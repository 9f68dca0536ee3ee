#include "render/picture/border_fill.h"

#include <algorithm>
#include <vector>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Means of 2 x 2 premultiplied pixels. Their alpha, times 4, is how many pixels' worth of colour there is: where one of
// them is opaque the coarse pixel is, too, so that a hole closes by a factor of 2 a level.
ImageF Pulled(const ImageF& fine) {
  ImageF coarse((fine.width + 1) / 2, (fine.height + 1) / 2, 4);
  ParallelFor(static_cast<std::size_t>(coarse.height), 16, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < coarse.width; ++x) {
        float sum[4] = {};
        for (int dy = 0; dy < 2; ++dy)
          for (int dx = 0; dx < 2; ++dx) {
            const int fx = 2 * x + dx, fy = 2 * y + dy;
            if (fx >= fine.width || fy >= fine.height) continue;
            for (int c = 0; c < 4; ++c) sum[c] += fine.At(fx, fy, c);
          }
        const float scale = sum[3] > 1 ? 1 / sum[3] : 1.0F;
        for (int c = 0; c < 4; ++c) coarse.At(x, y, c) = scale * sum[c];
      }
  });
  return coarse;
}

// The coarse picture, bilinear, under the fine one.
void Push(const ImageF& coarse, ImageF& fine) {
  ParallelFor(static_cast<std::size_t>(fine.height), 16, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < fine.width; ++x) {
        const float missing = 1 - fine.At(x, y, 3);
        if (!(missing > 0)) continue;
        const float u =
            std::clamp(0.5F * (static_cast<float>(x) + 0.5F) - 0.5F, 0.0F, static_cast<float>(coarse.width - 1));
        const float v =
            std::clamp(0.5F * (static_cast<float>(y) + 0.5F) - 0.5F, 0.0F, static_cast<float>(coarse.height - 1));
        const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
        const int x1 = std::min(x0 + 1, coarse.width - 1), y1 = std::min(y0 + 1, coarse.height - 1);
        const float a = u - static_cast<float>(x0), b = v - static_cast<float>(y0);
        for (int c = 0; c < 4; ++c)
          fine.At(x, y, c) += missing * ((1 - b) * ((1 - a) * coarse.At(x0, y0, c) + a * coarse.At(x1, y0, c)) +
                                         b * ((1 - a) * coarse.At(x0, y1, c) + a * coarse.At(x1, y1, c)));
      }
  });
}

}  // namespace

void FillSmoothly(ImageF& image) {
  std::vector<ImageF> levels;
  levels.reserve(32);  // pointers into it stay
  const auto hole = [](const ImageF& level) {
    for (std::size_t i = 3; i < level.data.size(); i += 4)
      if (level.data[i] < 1) return true;
    return false;
  };
  const ImageF* last = &image;
  while (hole(*last) && std::max(last->width, last->height) > 1) {
    levels.push_back(Pulled(*last));
    last = &levels.back();
  }
  if (levels.empty()) return;
  // The last level: one pixel, or opaque. A picture nearly without colour has it, at full strength.
  ImageF& top = levels.back();
  for (std::size_t i = 0; i < top.data.size(); i += 4) {
    const float alpha = top.data[i + 3];
    if (!(alpha > 0)) return;
    for (std::size_t c = 0; c < 4; ++c) top.data[i + c] /= alpha;
  }
  for (std::size_t l = levels.size() - 1; l > 0; --l) Push(levels[l], levels[l - 1]);
  Push(levels.front(), image);
}

void FillAndMark(ImageF& image) {
  std::vector<float> seen(image.data.size() / 4);
  for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = image.data[4 * i + 3];
  FillSmoothly(image);
  for (std::size_t i = 0; i < seen.size(); ++i) image.data[4 * i + 3] = seen[i];
}

}  // namespace lumi
