// Cholesky's factorisation of a symmetric positive definite matrix whose rows begin late: of row i only what lies right
// of its first entry is stored, and stays zero left of it (an envelope: George, Liu 1981, section 4.2). The matrix is
// kept as tiles of kTile x kTile numbers, the products of tiles use the machine's registers, rows of tiles go to
// several threads. Every number is summed in one order, whatever the number of threads.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace lumi {

class TileCholesky {
 public:
  static constexpr int kTile = 48;

  // first_of[i]: of row i, the first column that may differ from 0, at most i.
  explicit TileCholesky(const std::vector<int>& first_of);

  int size() const { return size_; }
  void SetZero();
  // The address of entry (row, column) of the lower triangle, right of the row's first; the next rows of its tile
  // follow it, the next column is kTile further.
  double* At(int row, int column) { return Tile(row / kTile, column / kTile) + (column % kTile) * kTile + row % kTile; }

  // Puts L, of L L^T, in the matrix' place. False: it is not positive definite (to rounding), and is spoilt.
  bool Factorise();
  // x <- (L L^T)^-1 x
  void Solve(Eigen::VectorXd& x) const;

 private:
  static constexpr std::size_t kNumbers = std::size_t{kTile} * kTile;
  double* Tile(int i, int j) {
    return numbers_.data() + (begin_[static_cast<std::size_t>(i)] + static_cast<std::size_t>(j - First(i))) * kNumbers;
  }
  const double* Tile(int i, int j) const { return const_cast<TileCholesky*>(this)->Tile(i, j); }
  int First(int i) const { return first_[static_cast<std::size_t>(i)]; }

  int size_ = 0, tiles_ = 0;
  std::vector<int> first_;          // of a row of tiles, its first one
  std::vector<std::size_t> begin_;  // and where that is stored, in tiles
  std::vector<double> numbers_;     // tile after tile of a row, each column by column
};

}  // namespace lumi
