#include "proxy/hull/consistency.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kStepPx = 1.0;     // between the points of a ray, in the view that sees them finest
constexpr int kMaxSteps = 4096;
constexpr double kReserve = 0.8;    // of what may stay uncovered: rays are a sample
constexpr float kCoveredPx = 0.25F; // a dilation that everybody can spare: less is not asked for
constexpr float kSteepestPx = 1.5F; // that a distance changes at most from one point of a ray to the next

struct AgreementRay {
  Eigen::Vector3d start, step;  // in the cones' frame
  int steps = 0;
  float depth_px = 0;           // of its pixel inside its silhouette
};

struct RayResult {
  float needed = kInfinity;           // dilation in pixels
  std::vector<std::int32_t> blockers; // where that is too much: the fewest views that stand in the way; empty: too many do
};

std::optional<std::pair<double, double>> Clip(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double from = 0, to = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < box.low[a] || origin[a] > box.high[a]) return std::nullopt;
      continue;
    }
    double near = (box.low[a] - origin[a]) / direction[a], far = (box.high[a] - origin[a]) / direction[a];
    if (near > far) std::swap(near, far);
    from = std::max(from, near);
    to = std::min(to, far);
  }
  if (!(from < to)) return std::nullopt;
  return std::make_pair(from, to);
}

// Rays through pixels of a silhouette, evenly spread over it.
std::vector<AgreementRay> SampleRays(const SilhouetteView& view, const SilhouetteCone& cone, const Box& box, const Eigen::Vector3d& origin,
                                     double unit, double finest, int count) {
  std::vector<AgreementRay> rays;
  const Eigen::Vector4d centre = CentreOfProjection(view.P);
  if (!(std::abs(centre.w()) > 0)) return rays;
  const Eigen::Vector3d eye = (centre.head<3>() / centre.w() - origin) / unit;
  std::size_t pixels = 0;
  for (const std::uint8_t m : view.mask.data) pixels += m >= 128 ? 1 : 0;
  // A stride along the scan that falls on other columns in each row.
  const double stride = std::max(1.0, static_cast<double>(pixels) / count);
  double next = 0.5 * stride;
  std::size_t n = 0;
  for (int y = 0; y < view.mask.height; ++y) {
    for (int x = 0; x < view.mask.width; ++x) {
      if (view.mask.At(x, y, 0) < 128) continue;
      if (static_cast<double>(n++) < std::floor(next)) continue;
      next += stride;
      const auto direction = RayDirection(view.P, {x + 0.5, y + 0.5});
      if (!direction) continue;
      const Eigen::Vector3d d = direction->normalized();
      AgreementRay ray;
      ray.depth_px = -cone.AtPixel(x + 0.5, y + 0.5);
      const auto range = Clip(box, eye, d);
      if (range) {
        const double length = range->second - range->first;
        ray.steps = std::clamp(static_cast<int>(std::ceil(length * finest / kStepPx)), 1, kMaxSteps);
        ray.step = d * (length / ray.steps);
        ray.start = eye + d * range->first + 0.5 * ray.step;
      }
      rays.push_back(ray);
    }
  }
  return rays;
}

// The largest distance over the views at x; gives up once it exceeds `enough`.
float LargestDistance(const std::vector<SilhouetteCone>& cones, const std::vector<std::int32_t>& order, const Eigen::Vector3d& x, float enough) {
  float most = -kInfinity;
  for (const std::int32_t i : order) {
    most = std::max(most, cones[static_cast<std::size_t>(i)].Distance(x));
    if (most > enough) break;
  }
  return most;
}

RayResult Follow(const AgreementRay& ray, const std::vector<SilhouetteCone>& cones, const std::vector<std::int32_t>& order, float cap) {
  RayResult result;
  double best_at = 0;
  const auto visit = [&](double s) {
    const float most = LargestDistance(cones, order, ray.start + s * ray.step, cap);
    if (most < result.needed) {
      result.needed = most;
      best_at = s;
    }
    return most;
  };
  // What is far from one view's content is so for the next few points.
  for (int s = 0; s < ray.steps && result.needed > kCoveredPx;) s += std::max(1, static_cast<int>((visit(s) - cap) / kSteepestPx));
  const double middle = best_at;
  for (const double offset : {-0.25, 0.25, -0.5, 0.5}) {
    if (ray.steps > 0 && result.needed > kCoveredPx) visit(middle + offset);
  }
  if (result.needed <= cap) return result;
  std::size_t fewest = 1 + std::max<std::size_t>(1, order.size() / 4);
  std::vector<std::int32_t> blockers;
  for (int s = 0; s < ray.steps && fewest > 1; ++s) {
    blockers.clear();
    for (const std::int32_t i : order) {
      if (cones[static_cast<std::size_t>(i)].Distance(ray.start + s * ray.step) > cap) blockers.push_back(i);
      if (blockers.size() >= fewest) break;
    }
    if (blockers.empty() || blockers.size() >= fewest) continue;
    fewest = blockers.size();
    result.blockers = blockers;
  }
  return result;
}

// Views far from each other in the list first: a point outside is found to be so by few of them.
std::vector<std::int32_t> SpreadOrder(const std::vector<std::size_t>& active) {
  std::vector<std::int32_t> order;
  const std::size_t n = active.size();
  std::size_t stride = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(0.38 * static_cast<double>(n))));
  while (std::gcd(stride, n) != 1) ++stride;
  for (std::size_t i = 0; i < n; ++i) order.push_back(static_cast<std::int32_t>(active[i * stride % n]));
  return order;
}

struct ViewNeed {
  double uncovered = 0;       // share of rays
  double deepest_px = 0;
  bool ok = true;
};

ViewNeed NeedOf(const std::vector<AgreementRay>& rays, const std::vector<RayResult>& results, double dilation_px, const AgreementOptions& options) {
  ViewNeed need;
  std::size_t uncovered = 0;
  for (std::size_t r = 0; r < rays.size(); ++r) {
    if (results[r].needed <= dilation_px) continue;
    ++uncovered;
    need.deepest_px = std::max<double>(need.deepest_px, rays[r].depth_px);
  }
  if (!rays.empty()) need.uncovered = static_cast<double>(uncovered) / static_cast<double>(rays.size());
  need.ok = need.uncovered <= kReserve * options.max_uncovered && need.deepest_px <= options.max_uncovered_depth_px;
  return need;
}

}  // namespace

Agreement FindAgreement(const std::vector<SilhouetteView>& views, const std::vector<SilhouetteCone>& cones, const Box& box,
                        const Eigen::Vector3d& origin, double unit, const AgreementOptions& options, ProgressSink& progress) {
  Agreement agreement;
  agreement.used.resize(cones.size());
  std::iota(agreement.used.begin(), agreement.used.end(), std::size_t{0});
  const Eigen::Vector3d middle = 0.5 * (box.low + box.high);
  double finest = 0;
  for (const SilhouetteCone& c : cones) finest = std::max(finest, c.PixelsPerUnit(middle));

  std::vector<std::vector<AgreementRay>> rays(cones.size());
  ParallelFor(cones.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) rays[v] = SampleRays(views[v], cones[v], box, origin, unit, finest, options.rays_per_view);
  });

  std::vector<std::vector<RayResult>> results(cones.size());
  for (std::size_t v = 0; v < cones.size(); ++v) results[v].resize(rays[v].size());
  const auto cap = static_cast<float>(options.max_dilation_px);
  // Asks every ray that needs more than `above` again.
  const auto follow = [&](float above) {
    const std::vector<std::int32_t> order = SpreadOrder(agreement.used);
    Progress steps(progress, "comparing silhouettes", static_cast<long>(agreement.used.size()));
    ParallelFor(agreement.used.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const std::size_t v = agreement.used[n];
        for (std::size_t r = 0; r < rays[v].size(); ++r) {
          if (results[v][r].needed > above) results[v][r] = Follow(rays[v][r], cones, order, cap);
        }
        CheckInterrupted();
        steps.Step();
      }
    });
  };
  for (;;) {
    follow(cap);  // what is covered stays covered without the views left out since

    std::map<std::size_t, double> blame;
    std::map<std::size_t, double> own;
    for (const std::size_t v : agreement.used) {
      const ViewNeed need = NeedOf(rays[v], results[v], options.max_dilation_px, options);
      own[v] = need.uncovered;
      if (need.ok) continue;
      const double share = 1.0 / static_cast<double>(rays[v].size());
      for (const RayResult& r : results[v]) {
        if (r.needed <= options.max_dilation_px) continue;
        if (r.blockers.empty()) blame[v] += share;
        for (const std::int32_t k : r.blockers) blame[static_cast<std::size_t>(k)] += share / static_cast<double>(r.blockers.size());
      }
    }
    if (blame.empty() || agreement.used.size() <= 2) break;
    double most = 0;
    for (const auto& [v, b] : blame) most = std::max(most, b);
    // Together with the worst those that are as bad, a twentieth of the views at most: each round asks every ray again.
    std::vector<Disagreement> worst;
    for (const auto& [v, b] : blame) {
      if (b >= 0.7 * most) worst.push_back({v, b, own[v]});
    }
    std::stable_sort(worst.begin(), worst.end(), [](const Disagreement& a, const Disagreement& b) { return a.blame > b.blame; });
    worst.resize(std::min({worst.size(), 1 + agreement.used.size() / 20, agreement.used.size() - 2}));
    for (const Disagreement& w : worst) {
      agreement.used.erase(std::find(agreement.used.begin(), agreement.used.end(), w.view));
      agreement.left_out.push_back(w);
    }
  }

  if (!agreement.left_out.empty()) follow(kCoveredPx);
  // The least dilation at which each of the used views is covered.
  for (const std::size_t v : agreement.used) {
    agreement.uncovered = std::max(agreement.uncovered, NeedOf(rays[v], results[v], options.max_dilation_px, options).uncovered);
    double low = agreement.dilation_px;
    if (NeedOf(rays[v], results[v], low, options).ok) continue;
    double high = options.max_dilation_px;
    while (high - low > 0.01) {
      const double half = 0.5 * (low + high);
      (NeedOf(rays[v], results[v], half, options).ok ? high : low) = half;
    }
    agreement.dilation_px = high;
  }
  return agreement;
}

}  // namespace lumi
