#include "proxy/hull/consistency.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kReserve = 0.8;  // of what may stay uncovered: rays are a sample

using RayResults = std::vector<std::vector<RayAgreement>>;

struct ViewNeed {
  double uncovered = 0;  // share of rays
  bool ok = true;
};

ViewNeed NeedOf(const std::vector<AgreementRay>& rays, const std::vector<RayAgreement>& results, double dilation_px,
                const AgreementOptions& options) {
  ViewNeed need;
  std::size_t uncovered = 0;
  double deepest_px = 0;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    if (results[r].needed_px <= dilation_px) continue;
    ++uncovered;
    deepest_px = std::max<double>(deepest_px, rays[r].depth_px);
  }
  if (!rays.empty()) need.uncovered = static_cast<double>(uncovered) / static_cast<double>(rays.size());
  need.ok = need.uncovered <= kReserve * options.max_uncovered && deepest_px <= options.max_uncovered_depth_px;
  return need;
}

RayResults NoResults(const std::vector<std::vector<AgreementRay>>& rays) {
  RayResults results(rays.size());
  for (std::size_t v = 0; v < rays.size(); ++v) results[v].resize(rays[v].size());
  return results;
}

// Asks every ray that needs more than `cap_px`, as far as is known.
void FollowAll(const std::vector<std::vector<AgreementRay>>& rays, const std::vector<SilhouetteCone>& cones,
               const std::vector<std::size_t>& used, double cap_px, ProgressSink& progress, RayResults& results) {
  const std::vector<std::int32_t> order = SpreadOrder(used);
  Progress steps(progress, "comparing silhouettes", static_cast<long>(used.size()));
  ParallelEach(used.size(), 1, [&](std::size_t n) {
    const std::size_t v = used[n];
    for (std::size_t r = 0; r < rays[v].size(); ++r)
      if (results[v][r].needed_px > cap_px) results[v][r] = Follow(rays[v][r], cones, order, cap_px);
    steps.Step();
  });
}

}  // namespace

Agreement FindAgreement(const std::vector<std::vector<AgreementRay>>& rays, const std::vector<SilhouetteCone>& cones,
                        const AgreementOptions& options, ProgressSink& progress) {
  Agreement agreement;
  agreement.used.resize(cones.size());
  std::iota(agreement.used.begin(), agreement.used.end(), std::size_t{0});
  RayResults results = NoResults(rays);
  for (;;) {
    options.go_on();
    // A ray that was covered stays covered when views are left out, and is not asked again.
    FollowAll(rays, cones, agreement.used, options.max_dilation_px, progress, results);

    std::map<std::size_t, double> blame;
    std::map<std::size_t, double> own;
    agreement.uncovered = 0;
    for (const std::size_t v : agreement.used) {
      const ViewNeed need = NeedOf(rays[v], results[v], options.max_dilation_px, options);
      own[v] = need.uncovered;
      agreement.uncovered = std::max(agreement.uncovered, need.uncovered);
      if (need.ok) continue;
      const double share = 1.0 / static_cast<double>(rays[v].size());
      for (const RayAgreement& r : results[v]) {
        if (r.needed_px <= options.max_dilation_px) continue;
        if (r.blockers.empty()) blame[v] += share;
        for (const std::int32_t k : r.blockers)
          blame[static_cast<std::size_t>(k)] += share / static_cast<double>(r.blockers.size());
      }
    }
    if (blame.empty() || agreement.used.size() <= 2 || agreement.used.size() < options.fewest_used) return agreement;
    double most = 0;
    for (const auto& [v, b] : blame) most = std::max(most, b);
    // The worst view is left out together with those as bad, a twentieth of the views at most, since each round asks
    // every ray again.
    std::vector<Disagreement> worst;
    for (const auto& [v, b] : blame)
      if (b >= 0.7 * most) worst.push_back({v, b, own[v]});
    std::ranges::stable_sort(worst, [](const Disagreement& a, const Disagreement& b) { return a.blame > b.blame; });
    worst.resize(std::min({worst.size(), 1 + agreement.used.size() / 20, agreement.used.size() - 2}));
    for (const Disagreement& w : worst) {
      agreement.used.erase(std::ranges::find(agreement.used, w.view));
      agreement.left_out.push_back(w);
    }
  }
}

NeededDilation FindDilation(const std::vector<std::vector<AgreementRay>>& rays,
                            const std::vector<SilhouetteCone>& cones, const std::vector<std::size_t>& used,
                            const AgreementOptions& options, ProgressSink& progress) {
  RayResults results = NoResults(rays);
  FollowAll(rays, cones, used, options.max_dilation_px, progress, results);
  NeededDilation needed;
  for (const std::size_t v : used) {
    double low = needed.px;
    if (NeedOf(rays[v], results[v], low, options).ok) continue;
    double high = options.max_dilation_px;
    needed.enough = needed.enough && NeedOf(rays[v], results[v], high, options).ok;
    while (high - low > 0.01) {
      const double half = 0.5 * (low + high);
      (NeedOf(rays[v], results[v], half, options).ok ? high : low) = half;
    }
    needed.px = high;
  }
  return needed;
}

}  // namespace lumi
