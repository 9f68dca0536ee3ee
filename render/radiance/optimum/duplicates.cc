#include "render/radiance/optimum/duplicates.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "render/radiance/optimum/dense_solver.h"

namespace lumi {
namespace {

double Precision(double f) { return f * f / ((1 - f) * (1 + f) + kNugget); }

}  // namespace

PhotoGroups GroupByCentre(const RelativeSources& r, bool single) {
  const auto n = static_cast<std::size_t>(r.count);
  PhotoGroups g;
  g.group.assign(n, -1);
  std::vector<std::int32_t> order(n), leader(n);
  std::iota(order.begin(), order.end(), 0);
  std::iota(leader.begin(), leader.end(), 0);
  if (!single) {
    const auto centre = [&](std::int32_t j) {
      const auto i = static_cast<std::size_t>(j);
      return std::tuple(r.dx[i], r.dy[i], r.dz[i]);
    };
    std::sort(order.begin(), order.end(),
              [&](std::int32_t a, std::int32_t b) { return std::tuple(centre(a), a) < std::tuple(centre(b), b); });
    for (std::size_t i = 1; i < n; ++i)
      if (centre(order[i]) == centre(order[i - 1]))
        leader[static_cast<std::size_t>(order[i])] = leader[static_cast<std::size_t>(order[i - 1])];
  }
  std::int32_t groups = 0;
  for (std::size_t j = 0; j < n; ++j)
    g.group[j] = leader[j] == static_cast<std::int32_t>(j) ? groups++ : g.group[static_cast<std::size_t>(leader[j])];
  g.first.assign(static_cast<std::size_t>(groups) + 1, 0);
  for (const std::int32_t k : g.group) ++g.first[static_cast<std::size_t>(k) + 1];
  std::partial_sum(g.first.begin(), g.first.end(), g.first.begin());
  g.member.resize(n);
  std::vector<std::int32_t> next(g.first.begin(), g.first.end() - 1);
  for (std::size_t j = 0; j < n; ++j)
    g.member[static_cast<std::size_t>(next[static_cast<std::size_t>(g.group[j])]++)] = static_cast<std::int32_t>(j);
  return g;
}

double GroupFactor(const float* f, int count) {
  double precision = 0;
  for (int i = 0; i < count; ++i) precision += Precision(static_cast<double>(f[i]));
  return std::sqrt(precision / (1 + precision));
}

void MemberShares(const float* f, int count, double* share) {
  double precision = 0;
  for (int i = 0; i < count; ++i) precision += Precision(static_cast<double>(f[i]));
  const double scale = precision > 0 ? 1 / std::sqrt(precision * (1 + precision)) : 0.0;
  for (int i = 0; i < count; ++i) {
    const auto fi = static_cast<double>(f[i]);
    share[i] = scale * fi / ((1 - fi) * (1 + fi) + kNugget);
  }
}

}  // namespace lumi
