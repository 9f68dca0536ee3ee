// Which settings are worth having, and which to take for a budget.
//
//   std::vector<CostAndQuality> measured = {{5, 20.1}, {15, 30.4}, {16, 28.0}};   // ms, dB
//   ParetoFront(measured)            {0, 1}: the third is beaten in both
//   RecommendedRow(measured, 10.0)   {0, fits}
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace lumi {

struct CostAndQuality {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double cost = kNone;     // above 0; less is better
  double quality = kNone;  // more is better: an error enters with its sign changed
};

// Rows that no other row equals or beats in both cost and quality, cheapest first: cost and quality ascend strictly. Of
// equal rows the first is taken. Rows without a finite cost above 0 and a finite quality are on no front.
std::vector<std::size_t> ParetoFront(const std::vector<CostAndQuality>& rows);

// The best row of the front within the budget (none: no limit); where none fits, the cheapest. Throws
// std::invalid_argument where the front is empty.
struct Recommended {
  std::size_t row = 0;
  bool fits = false;
};
Recommended RecommendedRow(const std::vector<CostAndQuality>& rows, std::optional<double> budget);

}  // namespace lumi
