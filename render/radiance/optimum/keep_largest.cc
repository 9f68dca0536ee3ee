#include "render/radiance/optimum/keep_largest.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace lumi {

void KeepLargest(WeightTable& table, int k) {
  if (k < 1) throw std::invalid_argument("KeepLargest: k >= 1 is wanted");
  struct Entry {
    std::int32_t camera;
    float weight;
  };
  std::vector<Entry> row;
  std::int32_t begin = 0, out = 0;
  for (std::size_t s = 0; s < table.size(); ++s) {
    const std::int32_t end = table.first[s + 1];
    row.clear();
    for (std::int32_t i = begin; i < end; ++i) row.push_back({table.camera[static_cast<std::size_t>(i)], table.weight[static_cast<std::size_t>(i)]});
    begin = end;
    if (row.size() > static_cast<std::size_t>(k)) {
      const auto kth = row.begin() + k;
      std::nth_element(row.begin(), kth, row.end(), [](const Entry& a, const Entry& b) {
        const float x = std::abs(a.weight), y = std::abs(b.weight);
        return x != y ? x > y : a.camera < b.camera;
      });
      const float edge = std::abs(kth->weight);
      row.erase(kth, row.end());
      double sum = 0, magnitude = 0;
      for (Entry& e : row) {
        e.weight = std::copysign(std::abs(e.weight) - edge, e.weight);
        sum += static_cast<double>(e.weight);
        magnitude += static_cast<double>(std::abs(e.weight));
      }
      for (Entry& e : row)
        e.weight = magnitude > 0 ? e.weight + static_cast<float>((1 - sum) * static_cast<double>(std::abs(e.weight)) / magnitude)
                                 : 1.0F / static_cast<float>(k);
      std::sort(row.begin(), row.end(), [](const Entry& a, const Entry& b) { return a.camera < b.camera; });
    }
    table.first[s] = out;
    for (const Entry& e : row) {
      table.camera[static_cast<std::size_t>(out)] = e.camera;
      table.weight[static_cast<std::size_t>(out++)] = e.weight;
    }
  }
  if (!table.first.empty()) table.first[table.size()] = out;
  table.camera.resize(static_cast<std::size_t>(out));
  table.weight.resize(static_cast<std::size_t>(out));
}

}  // namespace lumi
