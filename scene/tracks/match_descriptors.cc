#include "scene/tracks/match_descriptors.h"

#include <algorithm>

namespace lumi {
namespace {

// Rows of one block of the product of two photos' descriptors: bounds the memory.
constexpr Eigen::Index kBlock = 256;

// The two largest of a stream.
struct BestTwo {
  float best = -2, second = -2;
  int at = -1;
  void Take(float value, int index) {
    if (value > best) {
      second = best;
      best = value;
      at = index;
    } else if (value > second) {
      second = value;
    }
  }
  // Distances of unit vectors: d^2 = 2 - 2 cosine.
  bool Passes(double ratio) const {
    return at >= 0 && std::max(0.0f, 1 - best) < static_cast<float>(ratio * ratio) * std::max(0.0f, 1 - second) + 1e-7f;
  }
};

}  // namespace

std::vector<DescriptorMatch> MatchDescriptors(const Descriptors& a, const Descriptors& b, double ratio,
                                              Eigen::Index most) {
  const Eigen::Index count_a = std::min(most, a.rows()), count_b = std::min(most, b.rows());
  std::vector<BestTwo> of_a(static_cast<std::size_t>(count_a)), of_b(static_cast<std::size_t>(count_b));
  Descriptors product;
  for (Eigen::Index begin = 0; begin < count_a; begin += kBlock) {
    const Eigen::Index rows = std::min(kBlock, count_a - begin);
    product.noalias() = a.middleRows(begin, rows) * b.topRows(count_b).transpose();
    for (Eigen::Index i = 0; i < rows; ++i)
      for (Eigen::Index j = 0; j < product.cols(); ++j) {
        const float value = product(i, j);
        of_a[static_cast<std::size_t>(begin + i)].Take(value, static_cast<int>(j));
        of_b[static_cast<std::size_t>(j)].Take(value, static_cast<int>(begin + i));
      }
  }
  std::vector<DescriptorMatch> matches;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].Passes(ratio)) continue;
    const BestTwo& back = of_b[static_cast<std::size_t>(of_a[i].at)];
    if (back.at == static_cast<int>(i) && back.Passes(ratio))
      matches.push_back({static_cast<int>(i), of_a[i].at, of_a[i].best});
  }
  return matches;
}

}  // namespace lumi
