#include "proxy/moving/belief_propagation.h"

#include <algorithm>
#include <optional>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kSweeps = 40;

// m(k) = min over l of m(l) + slope |k - l|, and at most the least m + most: in place, then moved so that the least is
// 0.
void TruncatedLinear(float* m, std::size_t d, float slope, float most) {
  float least = *std::min_element(m, m + d);
  for (std::size_t l = 1; l < d; ++l) m[l] = std::min(m[l], m[l - 1] + slope);
  for (std::size_t l = d - 1; l-- > 0;) m[l] = std::min(m[l], m[l + 1] + slope);
  for (std::size_t l = 0; l < d; ++l) m[l] = std::min(m[l], least + most) - least;
}

}  // namespace

std::vector<double> SmoothLabels(const std::vector<float>& data, int grid_columns, int grid_rows, float slope,
                                 float most) {
  const auto columns = static_cast<std::size_t>(grid_columns), rows = static_cast<std::size_t>(grid_rows);
  const std::size_t n = columns * rows, d = data.size() / n;
  // message[k][s]: to s from its neighbour k (left, right, above, below).
  std::vector<float> message[4];
  for (auto& m : message) m.assign(n * d, 0);
  const auto neighbour = [&](std::size_t s, int k) -> std::optional<std::size_t> {
    const std::size_t c = s % columns, r = s / columns;
    if (k == 0) return c > 0 ? std::optional(s - 1) : std::nullopt;
    if (k == 1) return c + 1 < columns ? std::optional(s + 1) : std::nullopt;
    if (k == 2) return r > 0 ? std::optional(s - columns) : std::nullopt;
    return r + 1 < rows ? std::optional(s + columns) : std::nullopt;
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    ParallelFor(rows, 4, [&](std::size_t begin, std::size_t end) {
      std::vector<float> belief(d), out(d);
      for (std::size_t r = begin; r < end; ++r)
        for (std::size_t c = (r + static_cast<std::size_t>(sweep)) % 2; c < columns; c += 2) {
          const std::size_t s = r * columns + c;
          for (std::size_t l = 0; l < d; ++l)
            belief[l] = data[s * d + l] + message[0][s * d + l] + message[1][s * d + l] + message[2][s * d + l] +
                        message[3][s * d + l];
          for (int k = 0; k < 4; ++k) {
            const auto to = neighbour(s, k);
            if (!to) continue;
            for (std::size_t l = 0; l < d; ++l) out[l] = belief[l] - message[k][s * d + l];
            TruncatedLinear(out.data(), d, slope, most);
            std::ranges::copy(out, message[k ^ 1].begin() + static_cast<std::ptrdiff_t>(*to * d));
          }
        }
    });
  std::vector<double> label(n);
  for (std::size_t s = 0; s < n; ++s) {
    std::vector<double> belief(d);
    for (std::size_t l = 0; l < d; ++l)
      belief[l] = static_cast<double>(data[s * d + l] + message[0][s * d + l] + message[1][s * d + l] +
                                      message[2][s * d + l] + message[3][s * d + l]);
    const auto best = static_cast<std::size_t>(std::ranges::min_element(belief) - belief.begin());
    label[s] = static_cast<double>(best);
    if (best == 0 || best + 1 == d) continue;
    // Between planes: the parabola through the best and its neighbours.
    const double before = belief[best - 1] - belief[best], after = belief[best + 1] - belief[best];
    if (before + after > 0) label[s] += 0.5 * (before - after) / (before + after);
  }
  return label;
}

}  // namespace lumi
