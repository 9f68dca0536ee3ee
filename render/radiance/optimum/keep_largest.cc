#include "render/radiance/optimum/keep_largest.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace lumi {
namespace {

struct Entry {
  std::int32_t camera;
  float weight;
};

void Shrink(std::vector<Entry>& row, float by) {
  double sum = 0, magnitude = 0;
  for (Entry& e : row) {
    e.weight = std::copysign(std::abs(e.weight) - by, e.weight);
    sum += static_cast<double>(e.weight);
    magnitude += static_cast<double>(std::abs(e.weight));
  }
  for (Entry& e : row)
    e.weight = magnitude > 0
                   ? e.weight + static_cast<float>((1 - sum) * static_cast<double>(std::abs(e.weight)) / magnitude)
                   : 1.0F / static_cast<float>(row.size());
}

// change(row) for every row of the table, which may only become shorter.
template <class F>
void ForRows(WeightTable& table, const F& change) {
  std::vector<Entry> row;
  std::int32_t begin = 0, out = 0;
  for (std::size_t s = 0; s < table.size(); ++s) {
    const std::int32_t end = table.first[s + 1];
    row.clear();
    for (std::int32_t i = begin; i < end; ++i)
      row.push_back({table.camera[static_cast<std::size_t>(i)], table.weight[static_cast<std::size_t>(i)]});
    begin = end;
    change(row);
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

}  // namespace

void KeepLargest(WeightTable& table, int k) {
  if (k < 1) throw std::invalid_argument("KeepLargest: k >= 1 is wanted");
  ForRows(table, [k](std::vector<Entry>& row) {
    if (row.size() <= static_cast<std::size_t>(k)) return;
    const auto kth = row.begin() + k;
    std::nth_element(row.begin(), kth, row.end(), [](const Entry& a, const Entry& b) {
      const float x = std::abs(a.weight), y = std::abs(b.weight);
      return x != y ? x > y : a.camera < b.camera;
    });
    const float edge = std::abs(kth->weight);
    row.erase(kth, row.end());
    Shrink(row, edge);
    std::sort(row.begin(), row.end(), [](const Entry& a, const Entry& b) { return a.camera < b.camera; });
  });
}

void DropSmall(WeightTable& table, float threshold) {
  if (!(threshold >= 0)) throw std::invalid_argument("DropSmall: threshold >= 0 is wanted");
  ForRows(table, [threshold](std::vector<Entry>& row) {
    if (std::none_of(row.begin(), row.end(), [threshold](const Entry& e) { return std::abs(e.weight) > threshold; }))
      return;
    std::erase_if(row, [threshold](const Entry& e) { return std::abs(e.weight) <= threshold; });
    Shrink(row, threshold);
  });
}

}  // namespace lumi
