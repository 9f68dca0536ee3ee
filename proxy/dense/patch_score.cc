#include "proxy/dense/patch_score.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/program/kernel.h"

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

LUMI_KERNEL void ScorePatches(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                              const PlaneBatch& planes, float cost[kLanes]) {
  // Homogeneous pixel of a sample: q + dx qx + dy qy, affine since the inverse depth is.
  alignas(64) float q[3][kLanes], qx[3][kLanes], qy[3][kLanes];
  alignas(64) float sum[kLanes], square[kLanes], cross[kLanes], nearest[kLanes];
  for (int r = 0; r < 3; ++r) {
    for (int l = 0; l < kLanes; ++l) {
      q[r][l] =
          pair.a[3 * r] * patches.x[l] + pair.a[3 * r + 1] * patches.y[l] + pair.a[3 * r + 2] + planes.w[l] * pair.b[r];
      qx[r][l] = pair.a[3 * r] + planes.gx[l] * pair.b[r];
      qy[r][l] = pair.a[3 * r + 1] + planes.gy[l] * pair.b[r];
    }
  }
  for (int l = 0; l < kLanes; ++l) {
    sum[l] = square[l] = cross[l] = 0;
    nearest[l] = q[2][l];
  }
  const float right = static_cast<float>(source.width) - 1, bottom = static_cast<float>(source.height) - 1;
  const std::int32_t stride = source.width;
  const std::uint32_t* quads = source.quads.data();
  for (std::size_t s = 0; s < kPatchSamples; ++s) {
    const float dx = kOffsets.dx[s], dy = kOffsets.dy[s];
    for (int l = 0; l < kLanes; ++l) {
      const float z = q[2][l] + dx * qx[2][l] + dy * qy[2][l];
      const float inverse = 1 / z;
      // The smaller bound first: what is no number becomes it.
      const float u = std::min(std::max(0.0F, (q[0][l] + dx * qx[0][l] + dy * qy[0][l]) * inverse - 0.5F), right);
      const float v = std::min(std::max(0.0F, (q[1][l] + dx * qx[1][l] + dy * qy[1][l]) * inverse - 0.5F), bottom);
      nearest[l] = std::min(nearest[l], z);
      const auto i = static_cast<std::int32_t>(u), j = static_cast<std::int32_t>(v);
      const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
      const auto quad = static_cast<std::int32_t>(quads[j * stride + i]);
      const auto a = static_cast<float>(quad & 255), b = static_cast<float>((quad >> 8) & 255);
      const auto c = static_cast<float>((quad >> 16) & 255), d = static_cast<float>((quad >> 24) & 255);
      const float upper = a + fu * (b - a), lower = c + fu * (d - c);
      const float value = upper + fv * (lower - upper) - 128;
      const float weighed = patches.weight[s][l] * value;
      sum[l] += weighed;
      square[l] += weighed * value;
      cross[l] += patches.signal[s][l] * value;
    }
  }
  for (int l = 0; l < kLanes; ++l) {
    const float inverse = 1 / q[2][l];
    const float u = q[0][l] * inverse, v = q[1][l] * inverse;
    const float deviation = std::sqrt(std::max(square[l] - sum[l] * sum[l], 0.0F));
    const bool flat = patches.deviation[l] < kFlatDeviation || deviation < kFlatDeviation;
    const float correlation = cross[l] / std::max(patches.deviation[l] * deviation, 1e-12F);
    const float score = std::min(std::max(1 - correlation, 0.0F), 2.0F);
    const bool seen = nearest[l] > 0 && u >= 0 && v >= 0 && u <= right + 1 && v <= bottom + 1;
    cost[l] = !seen ? kUnseen : flat ? 1.0F : score;
  }
}

}  // namespace lumi
