// H.264 whose frames are coded as two pictures, a field each, as camcorders write it. Encoders at hand do not: this one
// writes every sample as it is (I_PCM; ITU-T H.264, 7.3).
#pragma once

#include <cstdint>
#include <string>

namespace lumi::test {

class FieldCoder {
 public:
  static constexpr int kWidth = 64, kHeight = 64;

  // Frame `index` from the start, its upper field of luma `top`, its lower of `bottom`.
  static std::string Frame(int index, int top, int bottom) {
    return (index == 0 ? Sequence() + Picture() : "") + Field(index, false, top) + Field(index, true, bottom);
  }

  static std::string Field(int index, bool bottom, int luma);

 private:
  struct Bits {
    std::string bytes;
    int used = 8;  // of the last byte
    void Put(int count, std::uint32_t value) {
      for (int i = count - 1; i >= 0; --i) {
        if (used == 8) bytes.push_back(0), used = 0;
        bytes.back() = static_cast<char>(static_cast<unsigned char>(bytes.back()) | ((value >> i & 1) << (7 - used)));
        ++used;
      }
    }
    void Golomb(std::uint32_t value) {
      int length = 0;
      while ((value + 1) >> (length + 1)) ++length;
      Put(length, 0);
      Put(length + 1, value + 1);
    }
  };

  static std::string Unit(int header, Bits bits) {
    bits.Put(1, 1);
    std::string unit{'\0', '\0', '\0', '\1', static_cast<char>(header)};
    int zeros = 0;
    for (const char c : bits.bytes) {
      if (zeros >= 2 && static_cast<unsigned char>(c) <= 3) unit.push_back(3), zeros = 0;
      unit.push_back(c);
      zeros = c == 0 ? zeros + 1 : 0;
    }
    return unit;
  }

  static std::string Sequence() {
    Bits b;
    b.Put(24, 77 << 16 | 30);  // Main, level 3
    for (const int value : {0, 0, 0, 4, 1}) b.Golomb(static_cast<std::uint32_t>(value));
    b.Put(1, 0);
    b.Golomb(kWidth / 16 - 1);
    b.Golomb(kHeight / 32 - 1);
    b.Put(5, 0b00101);  // fields, not of mixed macroblocks; direct 8x8; no crop; VUI
    b.Put(5, 0b00001);  // timing
    b.Put(32, 1);
    b.Put(32, 50);  // fields a second
    b.Put(5, 0b10000);
    return Unit(0x67, b);
  }
  static std::string Picture() {
    Bits b;
    b.Golomb(0), b.Golomb(0);
    b.Put(2, 0);
    for (int i = 0; i < 3; ++i) b.Golomb(0);
    b.Put(3, 0);
    for (int i = 0; i < 3; ++i) b.Golomb(0);
    b.Put(3, 0);
    return Unit(0x68, b);
  }
};

inline std::string FieldCoder::Field(int index, bool bottom, int luma) {
  Bits delimiter;
  delimiter.Put(3, 0);
  const bool first = index == 0 && !bottom;
  Bits b;
  b.Golomb(0), b.Golomb(7), b.Golomb(0);  // from the first macroblock on, all of them within the picture
  b.Put(4, static_cast<std::uint32_t>(index) % 16);
  b.Put(2, bottom ? 0b11 : 0b10);
  if (first) b.Golomb(0);
  b.Put(8, static_cast<std::uint32_t>(2 * index + bottom) % 256);
  b.Put(first ? 2 : 1, 0);
  b.Golomb(0);
  for (int i = 0; i < kWidth / 16 * (kHeight / 32); ++i) {
    b.Golomb(25);
    b.used = 8;
    b.bytes.append(256, static_cast<char>(luma));
    b.bytes.append(128, static_cast<char>(128));
  }
  return Unit(9, delimiter) + Unit(first ? 0x65 : 0x61, b);
}

}  // namespace lumi::test
