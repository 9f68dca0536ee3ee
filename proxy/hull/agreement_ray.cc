#include "proxy/hull/agreement_ray.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace lumi {
namespace {

constexpr double kStepPx = 1.0;  // between the points of a ray, in the view that sees them finest
constexpr int kMaxSteps = 4096;
constexpr float kSteepestPx = 1.5F;  // that a distance changes at most from one point of a ray to the next
constexpr float kBlockerPx =
    4;  // what a view in the way costs beside its distance: few far ones against many near ones

std::optional<std::pair<double, double>> Clip(const Box& box, const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction) {
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

// The largest distance over the views at x; gives up once it exceeds `enough`.
float LargestDistance(const std::vector<SilhouetteCone>& cones, const std::vector<std::int32_t>& order,
                      const Eigen::Vector3d& x, float enough) {
  float most = -std::numeric_limits<float>::infinity();
  for (const std::int32_t i : order) {
    most = std::max(most, cones[static_cast<std::size_t>(i)].Distance(x));
    if (most > enough) break;
  }
  return most;
}

}  // namespace

RayCaster::RayCaster(const std::vector<SilhouetteView>& views, const std::vector<SilhouetteCone>& cones, const Box& box,
                     const Eigen::Vector3d& origin, double unit)
    : views_(views), cones_(cones), box_(box), origin_(origin), unit_(unit) {
  const Eigen::Vector3d middle = 0.5 * (box.low + box.high);
  for (const SilhouetteCone& c : cones) finest_ = std::max(finest_, c.PixelsPerUnit(middle));
}

std::optional<AgreementRay> RayCaster::Through(std::size_t view, int x, int y, float depth_px) const {
  const Matrix34d& P = views_[view].P;
  const Eigen::Vector4d centre = CentreOfProjection(P);
  const auto direction = RayDirection(P, {x + 0.5, y + 0.5});
  if (!(std::abs(centre.w()) > 0) || !direction) return std::nullopt;
  const Eigen::Vector3d eye = (centre.head<3>() / centre.w() - origin_) / unit_, d = direction->normalized();
  AgreementRay ray;
  ray.depth_px = depth_px;
  if (const auto range = Clip(box_, eye, d)) {
    const double length = range->second - range->first;
    ray.steps = std::clamp(static_cast<int>(std::ceil(length * finest_ / kStepPx)), 1, kMaxSteps);
    ray.step = d * (length / ray.steps);
    ray.start = eye + d * range->first + 0.5 * ray.step;
  }
  return ray;
}

std::vector<AgreementRay> RayCaster::Sample(std::size_t view, int count) const {
  const Image8& mask = views_[view].mask;
  std::vector<AgreementRay> rays;
  // A stride along the scan that falls on other columns in each row.
  const double stride = std::max(1.0, static_cast<double>(CountObject(mask)) / count);
  double next = 0.5 * stride;
  std::size_t n = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.At(x, y, 0) < 128) continue;
      if (static_cast<double>(n++) < std::floor(next)) continue;
      next += stride;
      if (const auto ray = Through(view, x, y, -cones_[view].AtPixel(x + 0.5, y + 0.5))) rays.push_back(*ray);
    }
  }
  return rays;
}

RayAgreement Follow(const AgreementRay& ray, const std::vector<SilhouetteCone>& cones,
                    const std::vector<std::int32_t>& order, double cap_px) {
  RayAgreement result;
  const auto cap = static_cast<float>(cap_px);
  double best_at = 0;
  const auto visit = [&](double s) {
    const float most = LargestDistance(cones, order, ray.At(s), cap);
    if (most < result.needed_px) {
      result.needed_px = most;
      best_at = s;
    }
    return most;
  };
  // A point far from one view's silhouette stays far from it for the next few points of the ray, which are skipped.
  for (int s = 0; s < ray.steps && result.needed_px > kSparedDilationPx;)
    s += std::max(1, static_cast<int>((visit(s) - cap) / kSteepestPx));
  const double middle = best_at;
  for (const double offset : {-0.25, 0.25, -0.5, 0.5})
    if (ray.steps > 0 && result.needed_px > kSparedDilationPx) visit(middle + offset);
  if (result.needed_px <= cap) return result;
  const std::size_t most_blockers = std::max<std::size_t>(1, order.size() / 4);
  float least = std::numeric_limits<float>::infinity();
  std::vector<std::int32_t> blockers;
  // Steps from s on that cannot cost less than what is known.
  const auto weigh = [&](double s) {
    blockers.clear();
    float cost = 0, farthest = 0;
    for (const std::int32_t i : order) {
      const float away = cones[static_cast<std::size_t>(i)].Distance(ray.At(s)) - cap;
      if (!(away > 0)) continue;
      blockers.push_back(i);
      farthest = std::max(farthest, away);
      cost += away + kBlockerPx;
      if (!(cost < least) || blockers.size() > most_blockers)
        return static_cast<int>((farthest + kBlockerPx - std::min(least, farthest + kBlockerPx)) / kSteepestPx);
    }
    if (blockers.empty()) return 0;
    least = cost;
    result.blockers = blockers;
    result.blocked_at = s;
    return 0;
  };
  // From where the ray comes closest: what is found there spares most of the rest.
  const int middle_step = std::clamp(static_cast<int>(middle), 0, std::max(0, ray.steps - 1));
  for (int s = middle_step; s < ray.steps;) s += std::max(1, weigh(s));
  for (int s = middle_step - 1; s >= 0;) s -= std::max(1, weigh(s));
  return result;
}

std::vector<std::int32_t> SpreadOrder(const std::vector<std::size_t>& views) {
  std::vector<std::int32_t> order;
  const std::size_t n = views.size();
  std::size_t stride = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(0.38 * static_cast<double>(n))));
  while (std::gcd(stride, n) != 1) ++stride;
  for (std::size_t i = 0; i < n; ++i) order.push_back(static_cast<std::int32_t>(views[i * stride % n]));
  return order;
}

}  // namespace lumi
