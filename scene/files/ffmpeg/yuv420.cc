#include "scene/files/ffmpeg/yuv420.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "scene/program/kernel.h"

namespace lumi::ffmpeg {
namespace {

// Chroma and luma are held in 2^-7 of an 8-bit code, colours in 2^-5: with the overshoot of the bicubic (1.3 at most,
// in each direction) and any standard's matrix all of it fits 16 bits.
constexpr int kColourBits = 5;
constexpr int kMargin = 4;  // columns before and behind a row of chroma: its first and last sample again

double Bicubic(double x) {
  constexpr double kC = 0.6;
  x = std::abs(x);
  if (x < 1) return (2 - kC) * x * x * x - (3 - kC) * x * x + 1;
  return x < 2 ? -kC * (x * x * x - 5 * x * x + 8 * x - 4) : 0;
}

std::int16_t Fixed(double value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value * 32768, -32768.0, 32767.0)));
}

// a b / 2^15, rounded: one instruction for a register of them.
LUMI_INLINE std::int16_t Times(std::int16_t a, std::int16_t b) {
  return static_cast<std::int16_t>(((static_cast<int>(a) * b >> 14) + 1) >> 1);
}

template <typename Sample>
struct Depth;
template <>
struct Depth<std::uint8_t> {
  static constexpr int kShift = 7, kNeutral = 128;
};
template <>
struct Depth<std::uint16_t> {
  static constexpr int kShift = 5, kNeutral = 512;
};

template <typename Sample>
LUMI_INLINE void BlendRows(const std::array<const Sample*, 4>& row, const std::array<std::int16_t, 4>& w, int n,
                           std::int16_t* __restrict out) {
  const auto at = [](Sample s) {
    return static_cast<std::int16_t>((static_cast<std::int16_t>(s) - Depth<Sample>::kNeutral) *
                                     (1 << Depth<Sample>::kShift));
  };
  const Sample* __restrict a = row[0], * __restrict b = row[1], * __restrict c = row[2], * __restrict d = row[3];
  const std::int16_t wa = w[0], wb = w[1], wc = w[2], wd = w[3];
  for (int i = 0; i < n; ++i)
    out[i] = static_cast<std::int16_t>(Times(at(a[i]), wa) + Times(at(b[i]), wb) + Times(at(c[i]), wc) +
                                       Times(at(d[i]), wd));
}
LUMI_KERNEL void BlendRows8(const std::array<const std::uint8_t*, 4>& row, const std::array<std::int16_t, 4>& w, int n,
                            std::int16_t* __restrict out) {
  BlendRows(row, w, n, out);
}
LUMI_KERNEL void BlendRows10(const std::array<const std::uint16_t*, 4>& row, const std::array<std::int16_t, 4>& w,
                             int n, std::int16_t* __restrict out) {
  BlendRows(row, w, n, out);
}

// in: from the first sample of each phase on.
LUMI_KERNEL void SpreadColumns(const std::int16_t* even, const std::int16_t* odd,
                               const std::array<std::int16_t, 4>& even_weight,
                               const std::array<std::int16_t, 4>& odd_weight, int n, std::int16_t* __restrict out) {
  const std::array<std::int16_t, 4> we = even_weight, wo = odd_weight;
  for (int i = 0; i < n; ++i) {
    out[2 * i] = static_cast<std::int16_t>(Times(even[i], we[0]) + Times(even[i + 1], we[1]) +
                                           Times(even[i + 2], we[2]) + Times(even[i + 3], we[3]));
    out[2 * i + 1] = static_cast<std::int16_t>(Times(odd[i], wo[0]) + Times(odd[i + 1], wo[1]) +
                                               Times(odd[i + 2], wo[2]) + Times(odd[i + 3], wo[3]));
  }
}

struct Row {
  const std::int16_t *u, *v;
  std::uint8_t *red, *green, *blue;
};
struct FixedMatrix {
  std::int16_t scale, offset, red_v, green_u, green_v, blue_u;
};

template <typename Sample>
LUMI_INLINE void Colour(const Sample* __restrict y, const Row& row, const FixedMatrix& matrix, int n) {
  const FixedMatrix m = matrix;
  const std::int16_t* __restrict u = row.u, * __restrict v = row.v;
  std::uint8_t* __restrict red = row.red, * __restrict green = row.green, * __restrict blue = row.blue;
  const auto code = [](int colour) {
    const auto c = static_cast<std::int16_t>(static_cast<std::int16_t>(colour) >> kColourBits);
    return static_cast<std::uint8_t>(std::min<std::int16_t>(std::max<std::int16_t>(c, 0), 255));
  };
  for (int x = 0; x < n; ++x) {
    const int luma = Times(static_cast<std::int16_t>(y[x] << Depth<Sample>::kShift), m.scale) + m.offset;
    red[x] = code(luma + Times(v[x], m.red_v));
    green[x] = code(luma + Times(u[x], m.green_u) + Times(v[x], m.green_v));
    blue[x] = code(luma + Times(u[x], m.blue_u));
  }
}
LUMI_KERNEL void Colour8(const std::uint8_t* y, const Row& row, const FixedMatrix& m, int n) { Colour(y, row, m, n); }
LUMI_KERNEL void Colour10(const std::uint16_t* y, const Row& row, const FixedMatrix& m, int n) { Colour(y, row, m, n); }

}  // namespace

std::array<Yuv420ToRgb::Taps, 2> Yuv420ToRgb::TapsFor(double chroma_at) {
  std::array<Taps, 2> taps;
  for (int odd = 0; odd < 2; ++odd) {
    const double at = (odd - chroma_at) / 2;  // in chroma samples, from that of this 2 x 2
    const int first = static_cast<int>(std::floor(at)) - 1;
    taps[static_cast<std::size_t>(odd)].first = first;
    for (int i = 0; i < 4; ++i)
      taps[static_cast<std::size_t>(odd)].weight[static_cast<std::size_t>(i)] = Fixed(Bicubic(at - first - i));
  }
  return taps;
}

Yuv420ToRgb::Yuv420ToRgb(const YuvMatrix& m, double chroma_x, double chroma_y)
    : columns_(TapsFor(chroma_x)), rows_(TapsFor(chroma_y)) {
  constexpr double kFromLuma = 0.25;  // 2^-7 to 2^-5
  scale_ = Fixed(kFromLuma * m.scale);
  red_v_ = Fixed(kFromLuma * m.red_v);
  green_u_ = Fixed(kFromLuma * m.green_u);
  green_v_ = Fixed(kFromLuma * m.green_v);
  blue_u_ = Fixed(kFromLuma * m.blue_u);
  constexpr double kHalf = 0.5;  // so that cutting off rounds
  offset_ = static_cast<std::int16_t>(std::lround((kHalf - m.scale * m.black) * (1 << kColourBits)));
}

template <typename Sample>
void Yuv420ToRgb::Convert(const Planes420<Sample>& planes, std::uint8_t* rgb) {
  const int width = planes.width, half_width = (width + 1) / 2, half_height = (planes.height + 1) / 2;
  const auto columns = static_cast<std::size_t>(half_width);
  sparse_.resize(columns + 2 * kMargin);
  for (auto* all : {&u_, &v_}) all->resize(2 * columns);
  for (auto* colour : {&red_, &green_, &blue_}) colour->resize(static_cast<std::size_t>(width));
  const auto row_of = [&](std::size_t plane, int row) {
    return reinterpret_cast<const Sample*>(planes.first[plane] + row * planes.stride[plane]);
  };
  std::int16_t* sparse = sparse_.data() + kMargin;
  const auto spread = [&](std::size_t plane, int y, std::int16_t* all) {
    const Taps& taps = rows_[static_cast<std::size_t>(y % 2)];
    std::array<const Sample*, 4> row{};
    for (int i = 0; i < 4; ++i)
      row[static_cast<std::size_t>(i)] = row_of(plane, std::clamp(y / 2 + taps.first + i, 0, half_height - 1));
    if constexpr (sizeof(Sample) == 1)
      BlendRows8(row, taps.weight, half_width, sparse);
    else
      BlendRows10(row, taps.weight, half_width, sparse);
    std::fill_n(sparse - kMargin, kMargin, sparse[0]);
    std::fill_n(sparse + half_width, kMargin, sparse[half_width - 1]);
    SpreadColumns(sparse + columns_[0].first, sparse + columns_[1].first, columns_[0].weight, columns_[1].weight,
                  half_width, all);
  };
  const FixedMatrix matrix{scale_, offset_, red_v_, green_u_, green_v_, blue_u_};
  const Row row{u_.data(), v_.data(), red_.data(), green_.data(), blue_.data()};
  const cv::Mat colours[3] = {cv::Mat(1, width, CV_8U, red_.data()), cv::Mat(1, width, CV_8U, green_.data()),
                              cv::Mat(1, width, CV_8U, blue_.data())};
  for (int y = 0; y < planes.height; ++y) {
    spread(1, y, u_.data());
    spread(2, y, v_.data());
    if constexpr (sizeof(Sample) == 1)
      Colour8(row_of(0, y), row, matrix, width);
    else
      Colour10(row_of(0, y), row, matrix, width);
    cv::Mat side_by_side(1, width, CV_8UC3, rgb + static_cast<std::ptrdiff_t>(y) * width * 3);
    cv::merge(colours, 3, side_by_side);
  }
}

template void Yuv420ToRgb::Convert(const Planes420<std::uint8_t>&, std::uint8_t*);
template void Yuv420ToRgb::Convert(const Planes420<std::uint16_t>&, std::uint8_t*);

}  // namespace lumi::ffmpeg
