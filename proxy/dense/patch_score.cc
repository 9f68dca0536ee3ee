#include "proxy/dense/patch_score.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "scene/program/registers.h"

namespace lumi {
namespace {

// A sample counts 1/sqrt(e) where it differs by so many code values, or lies so many pixels off.
constexpr float kColourSigma = 14.0F, kSpaceSigmaPx = 5.0F;
// And so much less on the other side of a silhouette's outline.
constexpr float kBeyondOutline = 1e-3F;

struct SampleOffsets {
  std::array<float, kPatchSamples> dx, dy;
};
constexpr SampleOffsets kOffsets = [] {
  SampleOffsets o{};
  std::size_t s = 0;
  for (int y = -kPatchRadiusPx; y <= kPatchRadiusPx; y += 2) {
    for (int x = -kPatchRadiusPx; x <= kPatchRadiusPx; x += 2) {
      if (x == 0 && y == 0) continue;
      o.dx[s] = static_cast<float>(x);
      o.dy[s] = static_cast<float>(y);
      ++s;
    }
  }
  return o;
}();

// By the difference of two code values.
const std::array<float, 256>& ColourWeights() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t;
    for (std::size_t d = 0; d < t.size(); ++d) {
      const float share = static_cast<float>(d) / kColourSigma;
      t[d] = std::exp(-0.5F * share * share);
    }
    return t;
  }();
  return table;
}

}  // namespace

QuadImage PackQuads(const Image8& grey) {
  QuadImage packed;
  packed.width = grey.width;
  packed.height = grey.height;
  packed.quads.resize(grey.data.size());
  for (int y = 0; y < grey.height; ++y) {
    const std::uint8_t* upper = grey.Row(y);
    const std::uint8_t* lower = grey.Row(std::min(y + 1, grey.height - 1));
    std::uint32_t* out = packed.quads.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(grey.width);
    for (int x = 0; x < grey.width; ++x) {
      const int next = std::min(x + 1, grey.width - 1);
      out[x] = static_cast<std::uint32_t>(upper[x]) | static_cast<std::uint32_t>(upper[next]) << 8 |
               static_cast<std::uint32_t>(lower[x]) << 16 | static_cast<std::uint32_t>(lower[next]) << 24;
    }
  }
  return packed;
}

Image8 GreyOf(const Image8& rgb) {
  Image8 grey(rgb.width, rgb.height, 1);
  for (std::size_t p = 0; p < grey.data.size(); ++p) {
    const std::uint8_t* c = rgb.data.data() + p * static_cast<std::size_t>(rgb.channels);
    grey.data[p] = static_cast<std::uint8_t>((299 * c[0] + 587 * c[1] + 114 * c[2] + 500) / 1000);
  }
  return grey;
}

void MakePatches(const Image8& grey, const int x[kLanes], int y, PatchBatch& out, const Image8& object) {
  const std::array<float, 256>& colour = ColourWeights();
  for (int l = 0; l < kLanes; ++l) {
    const int middle = grey.Row(y)[x[l]];
    const bool of_object = !object.empty() && object.Row(y)[x[l]] > 127;
    float sum = 0, mean = 0, square = 0;
    std::array<float, kPatchSamples> value, weight;
    for (std::size_t s = 0; s < kPatchSamples; ++s) {
      const int i = std::clamp(x[l] + static_cast<int>(kOffsets.dx[s]), 0, grey.width - 1);
      const int j = std::clamp(y + static_cast<int>(kOffsets.dy[s]), 0, grey.height - 1);
      const int v = grey.Row(j)[i];
      const float off = kOffsets.dx[s] * kOffsets.dx[s] + kOffsets.dy[s] * kOffsets.dy[s];
      // A Gaussian of the distance: 1 / (1 + x)^2 is as good here and needs no exponential.
      const float fall = 1 + off / (4 * kSpaceSigmaPx * kSpaceSigmaPx);
      weight[s] = colour[static_cast<std::size_t>(std::abs(v - middle))] / (fall * fall);
      if (!object.empty() && (object.Row(j)[i] > 127) != of_object) weight[s] *= kBeyondOutline;
      value[s] = static_cast<float>(v - middle);
      sum += weight[s];
      mean += weight[s] * value[s];
      square += weight[s] * value[s] * value[s];
    }
    // Where nothing around is like the middle all weights are small, their ratios are as good as ever; none is 0.
    const float scale = 1 / std::max(sum, 1e-30F);
    mean *= scale;
    for (std::size_t s = 0; s < kPatchSamples; ++s) {
      out.weight[s][l] = weight[s] * scale;
      out.signal[s][l] = weight[s] * scale * (value[s] - mean);
    }
    out.deviation[l] = std::sqrt(std::max(square * scale - mean * mean, 0.0F));
    out.x[l] = static_cast<float>(x[l]) + 0.5F;
    out.y[l] = static_cast<float>(y) + 0.5F;
  }
}

namespace {

// Clamped to [0, high], where the lower bound is a hair above 0, which keeps it one instruction; NaN becomes the lower
// bound.
template <class V>
LUMI_INLINE V Clamped(V x, float high) {
  const V least = V{} + std::numeric_limits<float>::min(), most = V{} + high;
  const V positive = x > least ? x : least;
  return positive < most ? positive : most;
}

template <class V>
LUMI_INLINE V Magnitude(V x) {
  const V zero{};
  return x < zero ? -x : x;
}

// An index a lane, two lanes a move to an integer register. Halves are put together in registers: the compiler would
// write the four quarters of 64 bytes to memory and read them as one, which processors wait for.
template <int kBytes>
LUMI_INLINE typename Register<kBytes>::Ints Fetch(const std::uint32_t* from, typename Register<kBytes>::Ints index) {
  if constexpr (kBytes == 64) {
    const auto first = Fetch<32>(from, __builtin_shufflevector(index, index, 0, 1, 2, 3, 4, 5, 6, 7));
    const auto second = Fetch<32>(from, __builtin_shufflevector(index, index, 8, 9, 10, 11, 12, 13, 14, 15));
    return __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  } else {
    const auto pairs = std::bit_cast<typename Register<kBytes>::Pairs>(index);
    typename Register<kBytes>::Ints quad{};
    for (int p = 0; p < Register<kBytes>::kNumbers / 2; ++p) {
      quad[2 * p] = static_cast<std::int32_t>(from[static_cast<std::uint32_t>(pairs[p])]);
      quad[2 * p + 1] = static_cast<std::int32_t>(from[pairs[p] >> 32]);
    }
    return quad;
  }
}

// Pixels `from`, from + 1 ... of the batch, a register full: all of a patch's sums are in registers then.
template <int kBytes>
LUMI_INLINE void ScoreRegister(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                               const PlaneBatch& planes, int from, float* __restrict cost) {
  using R = Register<kBytes>;
  using V = typename R::Floats;
  using I = typename R::Ints;
  // Homogeneous pixel of a sample: q + dx qx + dy qy, affine since the inverse depth is.
  V q[3], qx[3], qy[3];
  const V x = LoadRegister<V>(patches.x + from), y = LoadRegister<V>(patches.y + from),
          w = LoadRegister<V>(planes.w + from), gx = LoadRegister<V>(planes.gx + from),
          gy = LoadRegister<V>(planes.gy + from);
  for (int r = 0; r < 3; ++r) {
    q[r] = pair.a[3 * r] * x + pair.a[3 * r + 1] * y + pair.a[3 * r + 2] + w * pair.b[r];
    qx[r] = pair.a[3 * r] + gx * pair.b[r];
    qy[r] = pair.a[3 * r + 1] + gy * pair.b[r];
  }
  const float right = static_cast<float>(source.width) - 1, bottom = static_cast<float>(source.height) - 1;
  const std::int32_t stride = source.width;
  const std::uint32_t* quads = source.quads.data();
  V sum{}, square{}, cross{};
  std::size_t s = 0;  // in the order of kOffsets
  for (int j = -kPatchRadiusPx; j <= kPatchRadiusPx; j += 2) {
    const auto dy = static_cast<float>(j);
    const V row0 = q[0] + dy * qy[0], row1 = q[1] + dy * qy[1], row2 = q[2] + dy * qy[2];
#pragma GCC unroll 1
    for (int i = -kPatchRadiusPx; i <= kPatchRadiusPx; i += 2) {
      if (i == 0 && j == 0) continue;
      const auto dx = static_cast<float>(i);
      const V inverse = 1.0F / (row2 + dx * qx[2]);
      const V u = Clamped((row0 + dx * qx[0]) * inverse - 0.5F, right);
      const V v = Clamped((row1 + dx * qx[1]) * inverse - 0.5F, bottom);
      const I left = __builtin_convertvector(u, I), upper = __builtin_convertvector(v, I);
      const V fu = u - __builtin_convertvector(left, V), fv = v - __builtin_convertvector(upper, V);
      const I quad = Fetch<kBytes>(quads, upper * stride + left);
      const V a = __builtin_convertvector(quad & 255, V), b = __builtin_convertvector((quad >> 8) & 255, V);
      const V c = __builtin_convertvector((quad >> 16) & 255, V), d = __builtin_convertvector((quad >> 24) & 255, V);
      const V above = a + fu * (b - a), below = c + fu * (d - c);
      const V value = above + fv * (below - above) - 128.0F;
      const V weighed = LoadRegister<V>(patches.weight[s] + from) * value;
      sum += weighed;
      square += weighed * value;
      cross += LoadRegister<V>(patches.signal[s] + from) * value;
      ++s;
    }
  }
  // Depth is affine as well: the corner of the patch that is nearest speaks for all samples.
  const V side = Magnitude(qx[2]) + Magnitude(qy[2]);
  const V nearest = q[2] - static_cast<float>(kPatchRadiusPx) * side;
  for (int l = 0; l < R::kNumbers; ++l) {
    const float inverse = 1 / q[2][l];
    const float at_u = q[0][l] * inverse, at_v = q[1][l] * inverse;
    const float deviation = std::sqrt(std::max(square[l] - sum[l] * sum[l], 0.0F)), own = patches.deviation[from + l];
    const bool flat = own < kFlatDeviation || deviation < kFlatDeviation;
    const float correlation = cross[l] / std::max(own * deviation, 1e-12F);
    const float score = std::min(std::max(1 - correlation, 0.0F), 2.0F);
    const bool seen = nearest[l] > 0 && at_u >= 0 && at_v >= 0 && at_u <= right + 1 && at_v <= bottom + 1;
    cost[from + l] = !seen ? kUnseen : flat ? 1.0F : score;
  }
}

template <int kBytes>
LUMI_INLINE void ScoreAll(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                          const PlaneBatch& planes, float* __restrict cost) {
  for (int from = 0; from < kLanes; from += Register<kBytes>::kNumbers)
    ScoreRegister<kBytes>(patches, source, pair, planes, from, cost);
}

LUMI_WITH_64 void Score64(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                          const PlaneBatch& planes, float* cost) {
  ScoreAll<64>(patches, source, pair, planes, cost);
}
LUMI_WITH_32 void Score32(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                          const PlaneBatch& planes, float* cost) {
  ScoreAll<32>(patches, source, pair, planes, cost);
}
LUMI_WITH_16 void Score16(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                          const PlaneBatch& planes, float* cost) {
  ScoreAll<16>(patches, source, pair, planes, cost);
}

}  // namespace

void ScorePatches(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                  const PlaneBatch& planes, float cost[kLanes], int register_bytes) {
  (register_bytes == 64 ? Score64 : register_bytes == 32 ? Score32 : Score16)(patches, source, pair, planes, cost);
}

}  // namespace lumi
