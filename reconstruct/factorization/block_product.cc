#include "reconstruct/factorization/block_product.h"

#include <algorithm>

#include "scene/program/registers.h"

namespace lumi {
namespace {

constexpr int kColumnsAtOnce = 4;       // of C: with twelve rows, what AVX2's registers hold
constexpr std::size_t kNearPairs = 32;  // their blocks stay in the first cache

// Four columns of C, in registers.
template <int kBytes>
struct Sums {
  using V = typename Register<kBytes>::Doubles;
  static constexpr int kLanes = kBytes / 8, kRegisters = kBlockRows / kLanes;
  V sum[kColumnsAtOnce][kRegisters];

  LUMI_INLINE void Load(const double* c, std::ptrdiff_t stride) {
    for (int n = 0; n < kColumnsAtOnce; ++n)
      for (int m = 0; m < kRegisters; ++m) sum[n][m] = LoadRegister<V>(c + n * stride + m * kLanes);
  }
  LUMI_INLINE void Store(double* c, std::ptrdiff_t stride) const {
    for (int n = 0; n < kColumnsAtOnce; ++n)
      for (int m = 0; m < kRegisters; ++m) StoreRegister(sum[n][m], c + n * stride + m * kLanes);
  }
  LUMI_INLINE void Subtract(const double* a, const double* b) {
    V column[kRegisters];
    for (int m = 0; m < kRegisters; ++m) column[m] = LoadRegister<V>(a + m * kLanes);
    for (int n = 0; n < kColumnsAtOnce; ++n)
      for (int m = 0; m < kRegisters; ++m) sum[n][m] -= column[m] * b[n];
  }
};

template <int kBytes>
LUMI_INLINE void Product(Columns a, Columns b, int depth, int columns, double* c, std::ptrdiff_t c_stride) {
  for (int n = 0; n < columns; n += kColumnsAtOnce) {
    Sums<kBytes> sums;
    sums.Load(c + n * c_stride, c_stride);
    for (int k = 0; k < depth; ++k) sums.Subtract(a.at + k * a.stride, b.at + n + k * b.stride);
    sums.Store(c + n * c_stride, c_stride);
  }
}

template <int kBytes>
LUMI_INLINE void Products(const BlockPair* pairs, std::size_t count, double* c, std::ptrdiff_t c_stride) {
  for (std::size_t begin = 0; begin < count; begin += kNearPairs) {
    const std::size_t end = std::min(count, begin + kNearPairs);
    for (int n = 0; n < kBlockRows; n += kColumnsAtOnce) {
      Sums<kBytes> sums;
      sums.Load(c + n * c_stride, c_stride);
      for (std::size_t p = begin; p < end; ++p)
        for (int k = 0; k < 3; ++k) sums.Subtract(pairs[p].a + k * kBlockRows, pairs[p].b + n + k * kBlockRows);
      sums.Store(c + n * c_stride, c_stride);
    }
  }
}

using ProductOf = void (*)(Columns, Columns, int, int, double*, std::ptrdiff_t);
LUMI_WITH_32 void Product32(Columns a, Columns b, int depth, int columns, double* c, std::ptrdiff_t c_stride) {
  Product<32>(a, b, depth, columns, c, c_stride);
}
LUMI_WITH_16 void Product16(Columns a, Columns b, int depth, int columns, double* c, std::ptrdiff_t c_stride) {
  Product<16>(a, b, depth, columns, c, c_stride);
}

using ProductsOf = void (*)(const BlockPair*, std::size_t, double*, std::ptrdiff_t);
LUMI_WITH_32 void Products32(const BlockPair* pairs, std::size_t count, double* c, std::ptrdiff_t c_stride) {
  Products<32>(pairs, count, c, c_stride);
}
LUMI_WITH_16 void Products16(const BlockPair* pairs, std::size_t count, double* c, std::ptrdiff_t c_stride) {
  Products<16>(pairs, count, c, c_stride);
}

}  // namespace

// Twelve rows are three registers of 32 bytes; wider ones would not come out even.
void SubtractProduct(Columns a, Columns b, int depth, int columns, double* c, std::ptrdiff_t c_stride) {
  static const ProductOf widest = WidestRegister() >= 32 ? Product32 : Product16;
  widest(a, b, depth, columns, c, c_stride);
}

void SubtractProducts(std::span<const BlockPair> pairs, double* c, std::ptrdiff_t c_stride) {
  static const ProductsOf widest = WidestRegister() >= 32 ? Products32 : Products16;
  widest(pairs.data(), pairs.size(), c, c_stride);
}

}  // namespace lumi
