#include "reconstruct/factorization/tile_cholesky.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/factorization/block_product.h"
#include "scene/program/kernel.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kTile = TileCholesky::kTile;
static_assert(kTile % kBlockRows == 0);

// C -= A B^T, all of them tiles.
void SubtractTiles(const double* a, const double* b, double* c) {
  for (int m = 0; m < kTile; m += kBlockRows) SubtractProduct({a + m, kTile}, {b, kTile}, kTile, kTile, c + m, kTile);
}

// The tile's lower triangle becomes its factor.
bool FactoriseTile(double* a) {
  for (int j = 0; j < kTile; ++j) {
    double* column = a + j * kTile;
    for (int k = 0; k < j; ++k) {
      const double* before = a + k * kTile;
      const double factor = before[j];
      for (int i = j; i < kTile; ++i) column[i] -= factor * before[i];
    }
    if (!(column[j] > 0) || !std::isfinite(column[j])) return false;
    const double pivot = std::sqrt(column[j]);
    column[j] = pivot;
    for (int i = j + 1; i < kTile; ++i) column[i] /= pivot;
  }
  return true;
}

// A <- A L^-T
LUMI_KERNEL void DivideTile(const double* __restrict l, double* __restrict a) {
  for (int j = 0; j < kTile; ++j) {
    double* column = a + j * kTile;
    for (int k = 0; k < j; ++k) {
      const double factor = l[k * kTile + j];
      const double* before = a + k * kTile;
      for (int i = 0; i < kTile; ++i) column[i] -= factor * before[i];
    }
    const double inverse = 1 / l[j * kTile + j];
    for (int i = 0; i < kTile; ++i) column[i] *= inverse;
  }
}

using TileMap = Eigen::Map<const Eigen::Matrix<double, kTile, kTile>>;

}  // namespace

TileCholesky::TileCholesky(const std::vector<int>& first_of)
    : size_(static_cast<int>(first_of.size())), tiles_((size_ + kTile - 1) / kTile) {
  first_.resize(static_cast<std::size_t>(tiles_));
  begin_.resize(first_.size() + 1, 0);
  for (int i = 0; i < tiles_; ++i) {
    int first = i;
    for (int row = i * kTile; row < std::min(size_, (i + 1) * kTile); ++row)
      first = std::min(first, first_of[static_cast<std::size_t>(row)] / kTile);
    const auto at = static_cast<std::size_t>(i);
    first_[at] = first;
    begin_[at + 1] = begin_[at] + static_cast<std::size_t>(i - first + 1);
  }
  numbers_.resize(begin_.back() * kNumbers);
  SetZero();
}

void TileCholesky::SetZero() {
  std::ranges::fill(numbers_, 0.0);
  for (int row = size_; row < tiles_ * kTile; ++row) *At(row, row) = 1;  // what fills the last tile up
}

bool TileCholesky::Factorise() {
  // The rows of tiles that reach so far to the left, for each column.
  std::vector<std::vector<int>> below(first_.size());
  for (int i = 0; i < tiles_; ++i)
    for (int j = First(i); j < i; ++j) below[static_cast<std::size_t>(j)].push_back(i);
  for (int j = 0; j < tiles_; ++j) {
    for (int k = First(j); k < j; ++k) SubtractTiles(Tile(j, k), Tile(j, k), Tile(j, j));
    if (!FactoriseTile(Tile(j, j))) return false;
    const std::vector<int>& rows = below[static_cast<std::size_t>(j)];
    ParallelFor(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        const int i = rows[r];
        for (int k = std::max(First(i), First(j)); k < j; ++k) SubtractTiles(Tile(i, k), Tile(j, k), Tile(i, j));
        DivideTile(Tile(j, j), Tile(i, j));
      }
    });
  }
  return true;
}

void TileCholesky::Solve(Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(tiles_ * kTile);
  y.head(size_) = x;
  for (int i = 0; i < tiles_; ++i) {
    auto part = y.segment<kTile>(i * kTile);
    for (int k = First(i); k < i; ++k) part.noalias() -= TileMap(Tile(i, k)) * y.segment<kTile>(k * kTile);
    TileMap(Tile(i, i)).triangularView<Eigen::Lower>().solveInPlace(part);
  }
  for (int i = tiles_ - 1; i >= 0; --i) {
    auto part = y.segment<kTile>(i * kTile);
    TileMap(Tile(i, i)).transpose().triangularView<Eigen::Upper>().solveInPlace(part);
    for (int k = First(i); k < i; ++k) y.segment<kTile>(k * kTile).noalias() -= TileMap(Tile(i, k)).transpose() * part;
  }
  x = y.head(size_);
}

}  // namespace lumi
