// C -= A B^T for blocks of twelve rows, the products that bundle adjustment spends its time on. Columns lie one after
// the other, `stride` numbers apart.
#pragma once

#include <cstddef>
#include <span>

namespace lumi {

inline constexpr int kBlockRows = 12;

struct Columns {
  const double* at;
  std::ptrdiff_t stride;
};

// C (12 rows x `columns`, a multiple of 4; stride c_stride) -= A (12 x depth) B^T (B: `columns` x depth).
void SubtractProduct(Columns a, Columns b, int depth, int columns, double* c, std::ptrdiff_t c_stride);

// C (12 x 12) -= sum of A_n B_n^T, each of twelve rows and three columns that lie without gap.
struct BlockPair {
  const double *a, *b;
};
void SubtractProducts(std::span<const BlockPair> pairs, double* c, std::ptrdiff_t c_stride);

}  // namespace lumi
