// Frames with chroma in every second column and row (4:2:0), 8 or 10 bits, to 8-bit RGB: what nearly all videos are.
//
// Chroma is interpolated as libswscale's accurate conversion does it (bicubic, B = 0, C = 0.6, from where its samples
// lie), which has no fast code for this and takes as long as the decoder; the fast conversion that it has repeats each
// sample. Fixed point in 16 bits: the result is the same on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace lumi::ffmpeg {

// R = scale (Y - black) + red_v V, G = ... + green_u U + green_v V, B = ... + blue_u U, in codes of 8 bits, with U and
// V about 0.
struct YuvMatrix {
  double scale = 1, black = 0;
  double red_v = 0, green_u = 0, green_v = 0, blue_u = 0;
};

// Sample is std::uint8_t, or std::uint16_t for 10 bits.
template <typename Sample>
struct Planes420 {
  int width = 0, height = 0;                   // of the luma; chroma has half of it, rounded up
  std::array<const std::uint8_t*, 3> first{};  // Y, U, V
  std::array<std::ptrdiff_t, 3> stride{};      // bytes from row to row
};

class Yuv420ToRgb {
 public:
  // Where a chroma sample lies, in luma pixels from the upper left one of its 2 x 2: 0 to 1.
  Yuv420ToRgb(const YuvMatrix& matrix, double chroma_x, double chroma_y);
  // 3 bytes a pixel, rows without gaps: 3 width height bytes.
  template <typename Sample>
  void Convert(const Planes420<Sample>& planes, std::uint8_t* rgb);

 private:
  // For the even and the odd column or row: four neighbouring samples, from `first` beside the one of this 2 x 2.
  struct Taps {
    int first = 0;
    std::array<std::int16_t, 4> weight{};  // in 2^-15
  };
  static std::array<Taps, 2> TapsFor(double chroma_at);

  std::array<Taps, 2> columns_, rows_;
  std::int16_t scale_ = 0, offset_ = 0, red_v_ = 0, green_u_ = 0, green_v_ = 0, blue_u_ = 0;
  std::vector<std::int16_t> sparse_, u_, v_;  // a row of chroma: its own columns, all columns
  std::vector<std::uint8_t> red_, green_, blue_;
};

}  // namespace lumi::ffmpeg
