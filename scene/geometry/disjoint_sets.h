// Things 0, 1, 2 ... that are joined step by step into sets; each set is named by its least member.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace lumi {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t Find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(std::size_t i, std::size_t j) { parent_[std::max(Find(i), Find(j))] = std::min(Find(i), Find(j)); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace lumi
