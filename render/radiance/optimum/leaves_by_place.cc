#include "render/radiance/optimum/leaves_by_place.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/radiance/frame_plan.h"

namespace lumi {

NodeGrid::Around NodeGrid::At(const Eigen::Vector3d& p) const {
  int low[3], high[3];
  double part[3];
  for (int c = 0; c < 3; ++c) {
    const double length = box.max()[c] - box.min()[c];
    const int last = count[c] - 1;
    const double x = length > 0 ? std::clamp((p[c] - box.min()[c]) / length, 0.0, 1.0) * last : 0.0;
    low[c] = std::min(static_cast<int>(x), std::max(last - 1, 0));
    high[c] = std::min(low[c] + 1, last);
    part[c] = x - low[c];
  }
  Around around{};
  for (int i = 0; i < 8; ++i) {
    int node[3];
    double share = 1;
    for (int c = 0; c < 3; ++c) {
      const bool up = (i >> c) & 1;
      node[c] = up ? high[c] : low[c];
      share *= up ? part[c] : 1 - part[c];
    }
    around.node[i] = (node[2] * count[1] + node[1]) * count[0] + node[0];
    around.share[i] = share;
  }
  return around;
}

void LeavesByPlace::Shares(const Eigen::Vector3d& p, std::span<double> share) const {
  std::ranges::fill(share, 0.0);
  const NodeGrid::Around around = grid.At(p);
  for (int i = 0; i < 8; ++i) share[kind[static_cast<std::size_t>(around.node[i])]] += around.share[i];
}

namespace {

// The rays of `rays` that `index` lists.
RaySamples Those(const RaySamples& rays, const std::vector<std::size_t>& index) {
  RaySamples some;
  const auto take = [&](const auto& from, auto& to) {
    if (from.size() < rays.size()) return;
    to.reserve(index.size());
    for (const std::size_t i : index) to.push_back(from[i]);
  };
  take(rays.direction, some.direction);
  take(rays.t, some.t);
  take(rays.normal, some.normal);
  take(rays.exact_direction, some.exact_direction);
  take(rays.exact_t, some.exact_t);
  take(rays.face, some.face);
  return some;
}

}  // namespace

void WeighByPlace(const LeavesByPlace& leaves, const ViewSetup& setup, const VisibilityMaps* visibility,
                  const RaySamples& rays, WeightTable& table, OptimumCounts& counts) {
  const std::size_t kinds = leaves.kinds.size();
  std::vector<std::array<double, LeavesByPlace::kMostKinds>> share(rays.size());
  std::vector<std::vector<std::size_t>> of_kind(kinds);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    share[i].fill(0);
    if (!(rays.t[i] > 0) || !std::isfinite(rays.t[i])) continue;
    leaves.Shares(setup.desired.centre + static_cast<double>(rays.t[i]) * rays.direction[i].cast<double>(),
                  std::span(share[i]).first(kinds));
    for (std::size_t k = 0; k < kinds; ++k)
      if (share[i][k] > 0) of_kind[k].push_back(i);
  }
  ViewSetup own = setup;
  own.settings.by_place = nullptr;
  std::vector<WeightTable> tables(kinds);
  for (std::size_t k = 0; k < kinds; ++k) {
    if (of_kind[k].empty()) continue;
    own.settings.r_min_rad = leaves.kinds[k].r_min_rad;
    own.settings.r_max_rad = leaves.kinds[k].r_max_rad;
    own.settings.noise = leaves.kinds[k].noise;
    WeighOptimal(own, visibility, Those(rays, of_kind[k]), tables[k], counts);
  }
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.assign(rays.size(), 0.0F);
  std::vector<std::size_t> next(kinds, 0);  // row of each kind's table
  std::vector<std::int32_t> place(static_cast<std::size_t>(setup.sources.count), -1);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::size_t begin = table.camera.size();
    for (std::size_t k = 0; k < kinds; ++k) {
      if (!(share[i][k] > 0)) continue;
      const WeightTable& from = tables[k];
      const std::size_t row = next[k]++;
      // Whether a photo sees the point does not depend on the leaves.
      table.alpha[i] = std::max(table.alpha[i], from.alpha[row]);
      for (auto e = static_cast<std::size_t>(from.first[row]); e < static_cast<std::size_t>(from.first[row + 1]); ++e) {
        const auto w = static_cast<float>(share[i][k] * static_cast<double>(from.weight[e]));
        std::int32_t& at = place[static_cast<std::size_t>(from.camera[e])];
        if (at < 0) {
          at = static_cast<std::int32_t>(table.camera.size());
          table.camera.push_back(from.camera[e]);
          table.weight.push_back(w);
        } else {
          table.weight[static_cast<std::size_t>(at)] += w;
        }
      }
    }
    for (std::size_t e = begin; e < table.camera.size(); ++e) place[static_cast<std::size_t>(table.camera[e])] = -1;
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
}

}  // namespace lumi
