#include "reconstruct/nelder_mead.h"

#include <algorithm>
#include <cmath>

namespace lumi {

std::vector<double> NelderMead(const std::function<double(const std::vector<double>&)>& f, const std::vector<double>& start, const std::vector<double>& step,
                               int max_evaluations, double tolerance) {
  // The paper's reflection, expansion, contraction and shrinkage.
  constexpr double kReflect = 1, kExpand = 2, kContract = 0.5, kShrink = 0.5;
  struct Vertex {
    std::vector<double> x;
    double value;
  };
  std::vector<Vertex> simplex{{start, f(start)}};
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (step[i] == 0) continue;
    auto x = start;
    x[i] += step[i];
    simplex.push_back({x, f(x)});
  }
  const std::size_t n = simplex.size() - 1;
  int evaluations = static_cast<int>(simplex.size());
  const auto by_value = [](const Vertex& a, const Vertex& b) { return a.value < b.value; };
  while (n > 0 && evaluations < max_evaluations) {
    std::sort(simplex.begin(), simplex.end(), by_value);
    if (std::abs(simplex.back().value - simplex.front().value) <= tolerance * (std::abs(simplex.front().value) + tolerance)) break;
    std::vector<double> middle(start.size(), 0);
    for (std::size_t v = 0; v < n; ++v)
      for (std::size_t i = 0; i < middle.size(); ++i) middle[i] += simplex[v].x[i] / static_cast<double>(n);
    const auto along = [&](double t) {
      Vertex vertex{middle, 0};
      for (std::size_t i = 0; i < middle.size(); ++i) vertex.x[i] += t * (middle[i] - simplex.back().x[i]);
      vertex.value = f(vertex.x);
      ++evaluations;
      return vertex;
    };
    const Vertex reflected = along(kReflect);
    if (reflected.value < simplex.front().value) {
      const Vertex expanded = along(kExpand);
      simplex.back() = expanded.value < reflected.value ? expanded : reflected;
    } else if (reflected.value < simplex[n - 1].value) {
      simplex.back() = reflected;
    } else {
      const Vertex contracted = along(reflected.value < simplex.back().value ? kContract : -kContract);
      if (contracted.value < std::min(reflected.value, simplex.back().value)) {
        simplex.back() = contracted;
      } else {
        for (std::size_t v = 1; v <= n; ++v) {
          for (std::size_t i = 0; i < middle.size(); ++i)
            simplex[v].x[i] = simplex[0].x[i] + kShrink * (simplex[v].x[i] - simplex[0].x[i]);
          simplex[v].value = f(simplex[v].x);
          ++evaluations;
        }
      }
    }
  }
  return std::min_element(simplex.begin(), simplex.end(), by_value)->x;
}

}  // namespace lumi
