// Pictures as plain arrays, row-major from the top left, channels interleaved. 8-bit values are the photo's own code
// values (sRGB for photographs); all blending here happens on those, as in the thesis.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/model/picture_memory.h"

namespace lumi {

template <typename T>
struct Image {
  using Values = std::vector<T>;
  int width = 0;
  int height = 0;
  int channels = 0;
  Values data;  // height x width x channels

  Image() = default;
  Image(int w, int h, int c, T value = T{}) : width(w), height(h), channels(c) {
    const auto n = static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * static_cast<std::size_t>(c);
    Reserve(n);
    data.assign(n, value);
  }
  Image(const Image& other) { *this = other; }
  Image& operator=(const Image& other) {
    if (this == &other) return *this;
    width = other.width, height = other.height, channels = other.channels;
    Reserve(other.data.size());
    data = other.data;
    return *this;
  }
  Image(Image&&) noexcept = default;
  Image& operator=(Image&&) noexcept = default;
  ~Image() = default;
  bool empty() const { return data.empty(); }
  T* Row(int y) { return data.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width * channels); }
  const T* Row(int y) const {
    return data.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width * channels);
  }
  T& At(int x, int y, int c) { return Row(y)[x * channels + c]; }
  const T& At(int x, int y, int c) const { return Row(y)[x * channels + c]; }

 private:
  void Reserve(std::size_t n) {
    if (n <= data.capacity()) return;
    data.clear();  // reserve() would copy the old values before the advice is given
    data.reserve(n);
    WantLargePages(data.data(), n * sizeof(T));
  }
};

using Image8 = Image<std::uint8_t>;
using ImageF = Image<float>;

}  // namespace lumi
