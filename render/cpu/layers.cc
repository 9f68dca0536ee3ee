#include "render/cpu/layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/radiance/kernel.h"
#include "render/radiance/settings.h"

#if defined(__x86_64__) && !defined(LUMI_NO_TARGET_CLONES)
#include <immintrin.h>
#define LUMI_X86_FETCH
#endif

namespace lumi {

PhotoLevels::PhotoLevels(const std::vector<Photo>& photos, std::span<const int> seen) {
  widened_.reserve(photos.size());
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const Photo& photo = photos[p];
    const int last = static_cast<int>(photo.levels.size()) - 1,
              from = seen.empty() || last < 0 ? 0 : std::clamp(seen[p] - photo.level0_shift, 0, last);
    Entry e;
    e.first = static_cast<int>(levels_.size());
    e.shift = photo.level0_shift + from;
    for (const Image8& image : std::span(photo.levels).subspan(static_cast<std::size_t>(from))) {
      if (image.width < 2 || image.height < 2) {
        if (e.count > 0 || image.empty()) break;
        Image8& wide = widened_.emplace_back(std::max(2, image.width), std::max(2, image.height), 3);
        for (int y = 0; y < wide.height; ++y)
          for (int x = 0; x < wide.width; ++x)
            for (int c = 0; c < 3; ++c)
              wide.At(x, y, c) = image.At(std::min(x, image.width - 1), std::min(y, image.height - 1), c);
        levels_.push_back({wide.data.data(), wide.width, wide.height});
        e.count = 1;
        break;
      }
      levels_.push_back({image.data.data(), image.width, image.height});
      ++e.count;
    }
    entries_.push_back(e);
  }
}

void LayerBatch::Pad() {
  for (int i = n; i < padded(); ++i) {
    x[i] = x[n - 1];
    y[i] = y[n - 1];
    inverse_depth[i] = inverse_depth[n - 1];
  }
}

void LayerBatch::Clear(bool constants) {
  const auto m = static_cast<std::size_t>(padded());
  if (constants) {
    std::memset(rgb, 0, 4 * m * sizeof(rgb[0]));
    return;
  }
  std::memset(sum, 0, m * sizeof(sum[0]));
  std::memset(color, 0, 4 * m * sizeof(color[0]));
}

LUMI_KERNEL void EvaluateWeights(const LayerBatch& b, const Linear& f, float lowest, float* __restrict out) {
  const float* __restrict x = b.x;
  const float* __restrict y = b.y;
  const float c = f.c, fx = f.x, fy = f.y;
  const int n = b.padded();
  for (int i = 0; i < n; ++i) out[i] = std::max(lowest, c + fx * x[i] + fy * y[i]);
}

LUMI_KERNEL void EvaluateGate(const LayerBatch& b, const PhotoMap& map, float width_px, float height_px,
                              float feather_px, float* __restrict out) {
  const float* __restrict x = b.x;
  const float* __restrict y = b.y;
  const Linear mu = map.u, mv = map.v, mw = map.w;
  const bool hard = feather_px <= 0;
  const float inverse = hard ? 0.0F : 1 / feather_px;
  const int n = b.padded();
  for (int i = 0; i < n; ++i) {
    const float w = mw.c + mw.x * x[i] + mw.y * y[i];
    const float iw = 1.0F / (w > 0 ? w : 1.0F);
    const float u = (mu.c + mu.x * x[i] + mu.y * y[i]) * iw;
    const float v = (mv.c + mv.x * x[i] + mv.y * y[i]) * iw;
    const float edge = std::min(std::min(u, width_px - u), std::min(v, height_px - v));
    const float f = hard ? 1.0F : RaisedCosine(edge * inverse);
    out[i] = ((w > 0) & (edge >= 0)) ? std::min(1.0F, f * (1 / kAlphaFullAt)) : 0.0F;
  }
}

LUMI_KERNEL void ScaleByLevel(const LayerBatch& b, const Linear& f, float last, float level, float* __restrict out) {
  const float* __restrict x = b.x;
  const float* __restrict y = b.y;
  const float c = f.c, fx = f.x, fy = f.y;
  const int n = b.padded();
  for (int i = 0; i < n; ++i) {
    const float l = std::min(std::max(0.0F, c + fx * x[i] + fy * y[i]), last);
    out[i] *= std::max(0.0F, 1 - std::abs(l - level));
  }
}

namespace {

template <bool kDepths>
[[gnu::always_inline]] inline void Map(LayerBatch& b, int begin, int end, const PhotoMap& map, const LevelView& level,
                                       const float* __restrict weight, float weight_one) {
  const float* __restrict x = b.x;
  const float* __restrict y = b.y;
  const float* __restrict inverse_depth = b.inverse_depth;
  std::int32_t* __restrict offset = b.offset;
  std::int32_t* __restrict top = b.top;
  std::int32_t* __restrict bottom = b.bottom;
  std::int32_t* __restrict sum = b.sum;
  const Linear mu = map.u, mv = map.v, mw = map.w;
  const auto right = static_cast<float>(level.width - 1), low = static_cast<float>(level.height - 1);
  const std::int32_t last_x = level.width - 2, last_y = level.height - 2, stride = 3 * level.width;
  for (int i = begin; i < end; ++i) {
    float w = mw.c + mw.x * x[i] + mw.y * y[i], us = mu.c + mu.x * x[i] + mu.y * y[i],
          vs = mv.c + mv.x * x[i] + mv.y * y[i];
    if constexpr (kDepths) {
      w += mw.d * inverse_depth[i];
      us += mu.d * inverse_depth[i];
      vs += mv.d * inverse_depth[i];
    }
    const float iw = 1.0F / std::max(1e-30F, w);
    // Clamped to the centres of the border pixels: no colour from outside a photo.
    const float u = std::min(std::max(0.0F, us * iw - 0.5F), right);
    const float v = std::min(std::max(0.0F, vs * iw - 0.5F), low);
    const std::int32_t x0 = std::min(static_cast<std::int32_t>(u), last_x),
                       y0 = std::min(static_cast<std::int32_t>(v), last_y);
    const float ax = u - static_cast<float>(x0), ay = v - static_cast<float>(y0);
    const auto all =
        static_cast<std::int32_t>(std::min(std::max(weight[i] * weight_one, -kWeightOne), kWeightOne) + 0.5F);
    const auto below = static_cast<std::int32_t>(static_cast<float>(all) * ay + 0.5F);
    const std::int32_t above = all - below;
    const auto above_right = static_cast<std::int32_t>(static_cast<float>(above) * ax + 0.5F);
    const auto below_right = static_cast<std::int32_t>(static_cast<float>(below) * ax + 0.5F);
    offset[i] = y0 * stride + 3 * x0;
    top[i] = ((above - above_right) & 0xFFFF) | (above_right << 16);
    bottom[i] = ((below - below_right) & 0xFFFF) | (below_right << 16);
    sum[i] += all;
  }
}

LUMI_KERNEL void MapPlane(LayerBatch& b, int begin, int end, const PhotoMap& map, const LevelView& level,
                          const float* weight, float weight_one) {
  Map<false>(b, begin, end, map, level, weight, weight_one);
}
LUMI_KERNEL void MapDepths(LayerBatch& b, int begin, int end, const PhotoMap& map, const LevelView& level,
                           const float* weight, float weight_one) {
  Map<true>(b, begin, end, map, level, weight, weight_one);
}

}  // namespace

void MapToLevel(LayerBatch& b, int begin, int end, const PhotoMap& map, const LevelView& level, const float* weight,
                float weight_one) {
  const int padded = std::min(b.padded(), (end + 15) / 16 * 16);
  (b.depths ? MapDepths : MapPlane)(b, begin, padded, map, level, weight, weight_one);
}

namespace {

// Two texels of a row are read with 8 bytes: those from the upper one, and those that end with the lower one's sixth,
// so that nothing outside the picture is touched.
void FetchPortable(LayerBatch& b, int begin, int end, const LevelView& level) {
  const std::ptrdiff_t stride = 3 * static_cast<std::ptrdiff_t>(level.width);
  for (int i = begin; i < end; ++i) {
    const std::uint8_t *p = level.base + b.offset[i], *q = p + stride;
    const std::int32_t t0 = static_cast<std::int16_t>(b.top[i] & 0xFFFF), t1 = b.top[i] >> 16;
    const std::int32_t b0 = static_cast<std::int16_t>(b.bottom[i] & 0xFFFF), b1 = b.bottom[i] >> 16;
    std::int32_t* c = b.color + 4 * i;
    for (int k = 0; k < 3; ++k) c[k] += t0 * p[k] + t1 * p[k + 3] + b0 * q[k] + b1 * q[k + 3];
  }
}

#ifdef LUMI_X86_FETCH
#if defined(__clang__)
#define LUMI_KEEP_CALL noinline
#else
// GCC 12 treats a function compiled for another target than its caller as free of side effects, and drops the call.
#define LUMI_KEEP_CALL noipa
#endif
__attribute__((target("arch=x86-64-v3"), LUMI_KEEP_CALL)) void FetchV3(LayerBatch& b, int begin, int end,
                                                                       const LevelView& level) {
  // r r' g g' b b' as 16-bit numbers, to be multiplied by a pair of weights and added in pairs.
  const __m128i pick_top = _mm_setr_epi8(0, -1, 3, -1, 1, -1, 4, -1, 2, -1, 5, -1, -1, -1, -1, -1);
  const __m128i pick_bottom = _mm_setr_epi8(2, -1, 5, -1, 3, -1, 6, -1, 4, -1, 7, -1, -1, -1, -1, -1);
  const std::uint8_t *base = level.base, *next = level.base + 3 * static_cast<std::ptrdiff_t>(level.width) - 2;
  const std::int32_t *offset = b.offset, *top = b.top, *bottom = b.bottom;
  std::int32_t* color = b.color;
  for (int i = begin; i < end; ++i) {
    const std::ptrdiff_t o = offset[i];
    const __m128i p = _mm_shuffle_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(base + o)), pick_top);
    const __m128i q = _mm_shuffle_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(next + o)), pick_bottom);
    // Broadcast by the load itself, not by a shuffle.
    const __m128i above = _mm_castps_si128(_mm_broadcast_ss(reinterpret_cast<const float*>(top + i)));
    const __m128i below = _mm_castps_si128(_mm_broadcast_ss(reinterpret_cast<const float*>(bottom + i)));
    const __m128i s = _mm_add_epi32(_mm_madd_epi16(p, above), _mm_madd_epi16(q, below));
    __m128i* c = reinterpret_cast<__m128i*>(color + 4 * i);
    _mm_store_si128(c, _mm_add_epi32(_mm_load_si128(c), s));
  }
}
#endif

}  // namespace

void FetchLayer(LayerBatch& b, int begin, int end, const LevelView& level) {
  end = std::min(end, b.n);
#ifdef LUMI_X86_FETCH
  static const bool v3 = __builtin_cpu_supports("avx2");
  if (v3) return FetchV3(b, begin, end, level);
#endif
  FetchPortable(b, begin, end, level);
}

LUMI_KERNEL void AddConstant(LayerBatch& b, int begin, int end, const float* __restrict weight,
                             const float* __restrict rgb) {
  float* __restrict out = b.rgb;
  for (int i = begin; i < end; ++i)
    for (int c = 0; c < 3; ++c) out[4 * i + c] += weight[i] * rgb[c];
}

LUMI_KERNEL void ScaleBySum(LayerBatch& b) {
  float* __restrict scale = b.scale;
  const float* __restrict alpha = b.alpha;
  const std::int32_t* __restrict sum = b.sum;
  const int n = b.padded();
  for (int i = 0; i < n; ++i)
    scale[i] = sum[i] > 0 ? alpha[i] / (255.0F * static_cast<float>(std::max(sum[i], 1))) : 0.0F;
}

LUMI_KERNEL void StoreColors(const LayerBatch& b, float* __restrict rgba) {
  for (int i = 0; i < b.n; ++i) {
    float* out = rgba + 4 * static_cast<std::ptrdiff_t>(b.pixel[i]);
    for (int c = 0; c < 4; ++c) out[c] = static_cast<float>(b.color[4 * i + c]) * b.scale[i];
    out[3] = b.alpha[i];
  }
}

LUMI_KERNEL void StoreConstants(const LayerBatch& b, float* __restrict rgba) {
  for (int i = 0; i < b.n; ++i) {
    float* out = rgba + 4 * static_cast<std::ptrdiff_t>(b.pixel[i]);
    for (int c = 0; c < 3; ++c) out[c] = b.rgb[4 * i + c] * b.scale[i];
    out[3] = b.alpha[i];
  }
}

}  // namespace lumi
