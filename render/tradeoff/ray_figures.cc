#include "render/tradeoff/ray_figures.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <random>
#include <span>

#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kTableRays = 200, kWays = 20;
constexpr unsigned kHiddenBatches = 20;  // of kTableRays rays, at most, to find rays with a hidden photo
constexpr double kTail = 0.05;           // of a distribution: one ray in twenty may be worse
constexpr double kIsUsed = 1e-3;         // a photo counts as used if it has this weight near its own camera
constexpr double kLeads = 0.05;  // least weight of the photo that counts most: below it, all photos count about alike

// f(i) for i < n on all cores. A method may refuse some views: its exception is thrown again only if it refuses all.
template <typename F>
void ForRays(std::size_t n, const F& f) {
  std::mutex failing;
  std::exception_ptr failure;
  std::size_t failed = 0;
  ParallelFor(n, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) try {
        f(i);
      } catch (const DataError&) {
        const std::lock_guard lock(failing);
        failure = std::current_exception();
        ++failed;
      }
  });
  CheckInterrupted();
  if (n > 0 && failed == n) std::rethrow_exception(failure);
}

std::optional<double> QuantileOf(std::vector<double> values, double share) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return std::nullopt;
  return Quantile(std::move(values), share);
}
std::optional<double> MeanOf(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return std::nullopt;
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();
double SumOf(const std::vector<double>& weights) {
  double sum = 0;
  for (const double w : weights) sum += w;
  return sum;
}

// A point of the surface on a ray of photo j through this pixel.
std::optional<Eigen::Vector3d> SurfaceAt(const RayBench& bench, const RenderView& view, const Eigen::Vector2d& x_px) {
  const auto direction = RayDirection(view.P, x_px);
  if (!direction) return std::nullopt;
  const Eigen::Vector3d d = direction->normalized();
  const double t = bench.Trace(view.centre, d);
  if (!(t > 0) || !std::isfinite(t)) return std::nullopt;
  return Eigen::Vector3d(view.centre + t * d);
}

class RayProperties {
 public:
  RayProperties(const RayBench& bench, const RadianceSettings& s) : bench_(bench), s_(s) {
    plain_ = s;
    plain_.resolution = Resolution::kOff;
    plain_.time = false;
  }

  RayFigures Measure() {
    RayFigures f;
    const auto& views = bench_.sources().views;
    const std::vector<RayBench::Ray> rays = bench_.RandomRays(kTableRays);
    std::vector<double> direction(rays.size(), kNoFigure), differences(rays.size(), kNoFigure),
        coarse(rays.size(), kNoFigure);
    ForRays(rays.size(), [&](std::size_t i) {
      direction[i] = DirectionError(rays[i]);
      differences[i] = RayDifference(rays[i]);
      coarse[i] = CoarseRatio(rays[i]);
    });
    f.direction_error = QuantileOf(direction, 0.5);
    f.ray_difference = QuantileOf(differences, 1 - kTail);
    f.coarse_weight_ratio = QuantileOf(coarse, 0.5);

    // Rays with a hidden photo are rare over open surfaces: more are drawn, and the first kTableRays of them count.
    std::vector<double> hidden;
    for (unsigned batch = 0; batch < kHiddenBatches && hidden.size() < kTableRays; ++batch) {
      const std::vector<RayBench::Ray> more = bench_.RandomRays(kTableRays, 0.3, 700 + batch);
      std::vector<double> weights(more.size(), kNoFigure);
      ForRays(more.size(), [&](std::size_t i) { weights[i] = HiddenWeight(more[i]); });
      std::erase_if(weights, [](double w) { return !std::isfinite(w); });
      hidden.insert(hidden.end(), weights.begin(), weights.end());
    }
    hidden.resize(std::min<std::size_t>(hidden.size(), kTableRays));
    f.hidden_weight = MeanOf(hidden);

    const std::vector<RayBench::Ray> own = bench_.RandomRays(kTableRays, 0, 11);
    std::vector<double> own_weights(own.size(), kNoFigure);
    ForRays(own.size(), [&](std::size_t i) {
      const auto w = bench_.WeightsAt(own[i].eye, own[i].p, Clear(), bench_.Facing(own[i].eye, own[i].p));
      if (SumOf(w) > 0) own_weights[i] = w[static_cast<std::size_t>(own[i].near)];
    });
    f.own_weight = QuantileOf(own_weights, kTail);

    std::vector<double> used(views.size(), kNoFigure);
    std::vector<double> border(views.size() * kBorderRays, kNoFigure);
    ForRays(views.size(), [&](std::size_t j) {
      used[j] = Used(j);
      for (std::size_t k = 0; k < kBorderRays; ++k) border[j * kBorderRays + k] = BorderWeight(j, k);
    });
    f.photos_used = MeanOf(used);
    f.border_weight = QuantileOf(border, 1 - kTail);

    const std::vector<RayBench::Ray> ends = bench_.RandomRays(2 * kWays, 0.3, 5);
    std::vector<double> jumps(ends.size() / 2, kNoFigure);
    ForRays(jumps.size(), [&](std::size_t i) { jumps[i] = Jump(ends[2 * i], ends[2 * i + 1]); });
    f.jump = QuantileOf(jumps, 1);
    return f;
  }

 private:
  static constexpr std::size_t kBorderRays = 4;
  static constexpr double kWellInside = 0.02;  // of the photo's smaller side: as wide as the default feather
  static constexpr double kInside = 1e-4;  // of the photo's size: at the border, but inside it whatever the rounding

  // Settings for a photo at its own camera, without visibility: its feathers beside silhouettes belong to another
  // column.
  RadianceSettings Clear() const {
    RadianceSettings s = plain_;
    s.visibility = false;
    return s;
  }

  double DirectionError(const RayBench::Ray& ray) const {
    const auto weights = bench_.WeightsAt(ray.eye, ray.p, s_, bench_.Facing(ray.eye, ray.p));
    const double sum = SumOf(weights);
    const Eigen::Vector3d back = (ray.eye - ray.p).normalized();
    Eigen::Vector3d blended = Eigen::Vector3d::Zero(), all = Eigen::Vector3d::Zero();
    int seeing = 0;
    for (std::size_t j = 0; j < weights.size(); ++j) {
      const Eigen::Vector3d u = (bench_.sources().views[j].centre - ray.p).normalized();
      blended += weights[j] * u;
      if (!Contains(j, ray.p)) continue;
      all += u;
      ++seeing;
    }
    if (!(sum > 0) || seeing < 3) return kNoFigure;
    const double textured = (all / seeing - back).norm();
    return textured > 0 ? (blended / sum - back).norm() / textured : kNoFigure;
  }

  // Both views look in one direction, so that they differ in position only.
  double RayDifference(const RayBench::Ray& ray) const {
    const Eigen::Matrix3d facing = bench_.Facing(ray.eye, ray.p);
    const Eigen::Vector3d nearer = ray.eye + 0.5 * (ray.p - ray.eye);
    return RayBench::LargestDifference(bench_.WeightsAt(ray.eye, ray.p, plain_, facing),
                                       bench_.WeightsAt(nearer, ray.p, plain_, facing));
  }

  // The photo that counts most, moved away along its own ray to a quarter of its resolution.
  double CoarseRatio(const RayBench::Ray& ray) const {
    const Eigen::Matrix3d facing = bench_.Facing(ray.eye, ray.p);
    const auto before = bench_.WeightsAt(bench_.sources(), ray.eye, ray.p, s_, facing, nullptr);
    const auto most = static_cast<std::size_t>(std::ranges::max_element(before) - before.begin());
    if (!(before[most] > kLeads)) return kNoFigure;
    Sources moved = bench_.sources();
    RenderView& v = moved.views[most];
    v.centre = ray.p + 4 * (v.centre - ray.p);
    v.P.col(3) = -v.P.leftCols<3>() * v.centre;
    const auto after = bench_.WeightsAt(moved, ray.eye, ray.p, s_, facing, nullptr);
    return after[most] / before[most];
  }

  // Only for points that one of the four photos nearest in angle cannot see and another photo can.
  double HiddenWeight(const RayBench::Ray& ray) const {
    const VisibilityMaps* maps = bench_.Visibility(s_);
    if (!maps) return kNoFigure;
    std::vector<std::pair<double, std::size_t>> near;
    const Eigen::Vector3d back = (ray.eye - ray.p).normalized();
    for (std::size_t j = 0; j < bench_.sources().views.size(); ++j)
      if (Contains(j, ray.p)) {
        const Eigen::Vector3d u = (bench_.sources().views[j].centre - ray.p).normalized();
        near.emplace_back((u - back).norm(), j);
      }
    std::ranges::sort(near);
    const auto hidden = [&](std::size_t j) {
      const RenderView& v = bench_.sources().views[j];
      const Eigen::Vector3d to = ray.p - v.centre;
      return bench_.Trace(v.centre, to.normalized()) < (1 - static_cast<double>(kBlockedFrom)) * to.norm();
    };
    const auto nearest = std::span(near).first(std::min<std::size_t>(4, near.size()));
    if (std::ranges::none_of(nearest, [&](const auto& n) { return hidden(n.second); })) return kNoFigure;
    std::vector<std::size_t> blocked;
    for (const auto& [distance, j] : near)
      if (hidden(j)) blocked.push_back(j);
    if (blocked.size() == near.size()) return kNoFigure;
    const auto weights = bench_.WeightsAt(ray.eye, ray.p, s_, bench_.Facing(ray.eye, ray.p));
    if (!(SumOf(weights) > 0)) return kNoFigure;
    double sum = 0;
    for (const std::size_t j : blocked) sum += weights[j];
    return sum;
  }

  // 1 if the photo counts at one of six rays beside its own camera, 0 if not; none if it shows nothing of the proxy.
  double Used(std::size_t j) const {
    const RenderView& v = bench_.sources().views[j];
    std::mt19937 random(static_cast<unsigned>(31 + j));
    std::uniform_real_distribution<double> inside(0.15, 0.85), both(-1, 1);
    int met = 0;
    // The proxy may fill little of the picture.
    for (int tries = 0; tries < 300 && met < 6; ++tries) {
      const auto p = SurfaceAt(bench_, v, {inside(random) * v.size_px.x(), inside(random) * v.size_px.y()});
      if (!p) continue;
      ++met;
      const Eigen::Vector3d eye =
          v.centre + 0.1 * bench_.Spacing() * Eigen::Vector3d(both(random), both(random), both(random));
      if (bench_.WeightsAt(eye, *p, s_, bench_.Facing(eye, *p))[j] > kIsUsed) return 1;
    }
    return met > 0 ? 0 : kNoFigure;
  }

  // At kInside of the photo's size inside its border, seen from a place beside its camera.
  double BorderWeight(std::size_t j, std::size_t side) const {
    const RenderView& v = bench_.sources().views[j];
    std::mt19937 random(static_cast<unsigned>(77 + 4 * j + side));
    std::uniform_real_distribution<double> along(0.1, 0.9), both(-1, 1);
    const double w = v.size_px.x(), h = v.size_px.y(), a = along(random);
    const Eigen::Vector2d x = side == 0   ? Eigen::Vector2d(kInside * w, a * h)
                              : side == 1 ? Eigen::Vector2d((1 - kInside) * w, a * h)
                              : side == 2 ? Eigen::Vector2d(a * w, kInside * h)
                                          : Eigen::Vector2d(a * w, (1 - kInside) * h);
    const auto p = SurfaceAt(bench_, v, x);
    if (!p) return kNoFigure;
    const Eigen::Vector3d eye =
        v.centre + 0.3 * bench_.Spacing() * Eigen::Vector3d(both(random), both(random), both(random));
    // Only for points that another photo shows well inside its own border: otherwise no photo could take over.
    bool other = false;
    for (std::size_t i = 0; i < bench_.sources().views.size() && !other; ++i)
      other = i != j && Contains(i, *p, kWellInside);
    if (!other) return kNoFigure;
    return bench_.WeightsAt(eye, *p, s_, bench_.Facing(eye, *p))[j];
  }

  // The view moves along a straight line of a tenth of a scene size in kParts steps, looking at one point. The
  // kFollowed steps over which a weight changes most are halved until only a jump remains, or nothing. Parts near
  // epipoles are left out, because slopes grow without bound there.
  double Jump(const RayBench::Ray& one, const RayBench::Ray& other) const {
    const Eigen::Vector3d p = one.p;
    if (!((other.eye - one.eye).norm() > 0)) return kNoFigure;
    const Eigen::Vector3d way = 0.1 * (other.eye - one.eye).normalized();
    const double clear = std::min(0.02, 0.3 * bench_.Spacing());
    const auto eye = [&](double s) { return Eigen::Vector3d(one.eye + s * way); };
    // One matrix for all positions: a camera that turns towards p would also change the weights.
    const Eigen::Matrix3d facing = bench_.Facing(eye(0.5), p);
    const auto at = [&](double s) { return bench_.WeightsAt(eye(s), p, s_, facing); };
    constexpr int kParts = 50, kHalvings = 14, kFollowed = 3;
    struct Step {
      double from, change;
    };
    std::vector<Step> steps;
    std::vector<double> before = at(0);
    for (int n = 1; n <= kParts; ++n) {
      std::vector<double> now = at(static_cast<double>(n) / kParts);
      const Eigen::Vector3d e = eye((n - 0.5) / kParts), d = (p - e).normalized();
      const bool near = std::ranges::any_of(
          bench_.sources().views, [&](const RenderView& v) { return (v.centre - e).cross(d).norm() < clear; });
      if (!near && (e - p).norm() > 0.2)
        steps.push_back({static_cast<double>(n - 1) / kParts, RayBench::LargestDifference(before, now)});
      before = std::move(now);
    }
    if (steps.empty()) return kNoFigure;
    std::ranges::sort(steps, std::greater(), &Step::change);
    double largest = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(kFollowed, steps.size()); ++i) {
      double from = steps[i].from, length = 1.0 / kParts;
      std::vector<double> first = at(from), last = at(from + length);
      for (int halving = 0; halving < kHalvings; ++halving) {
        length /= 2;
        std::vector<double> middle = at(from + length);
        if (RayBench::LargestDifference(first, middle) >= RayBench::LargestDifference(middle, last)) {
          last = std::move(middle);
        } else {
          first = std::move(middle);
          from += length;
        }
      }
      largest = std::max(largest, RayBench::LargestDifference(first, last));
    }
    return largest;
  }

  // inside: distance from the border, at least, as a share of the photo's smaller side.
  bool Contains(std::size_t j, const Eigen::Vector3d& p, double inside = 0) const {
    const RenderView& v = bench_.sources().views[j];
    const double edge_px = inside * v.size_px.minCoeff();
    const auto x = Project(v.P, p);
    return x && x->x() >= edge_px && x->y() >= edge_px && x->x() <= v.size_px.x() - edge_px &&
           x->y() <= v.size_px.y() - edge_px;
  }

  const RayBench& bench_;
  const RadianceSettings& s_;
  RadianceSettings plain_;
};

}  // namespace

RayFigures MeasureRays(const RayBench& bench, const RadianceSettings& settings) {
  return RayProperties(bench, settings).Measure();
}

}  // namespace lumi
