#include "scene/tradeoff/front.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace lumi {

std::vector<std::size_t> ParetoFront(const std::vector<CostAndQuality>& rows) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].cost > 0 && std::isfinite(rows[i].cost) && std::isfinite(rows[i].quality)) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return rows[a].cost != rows[b].cost ? rows[a].cost < rows[b].cost : rows[a].quality > rows[b].quality;
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order)
    if (front.empty() || rows[i].quality > rows[front.back()].quality) front.push_back(i);
  return front;
}

Recommended RecommendedRow(const std::vector<CostAndQuality>& rows, std::optional<double> budget) {
  const std::vector<std::size_t> front = ParetoFront(rows);
  if (front.empty()) throw std::invalid_argument("RecommendedRow: no row has a cost and a quality");
  Recommended best{front.front(), false};
  for (const std::size_t i : front)
    if (!budget || rows[i].cost <= *budget) best = {i, true};
  return best;
}

}  // namespace lumi
