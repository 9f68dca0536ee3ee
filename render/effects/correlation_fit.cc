#include "render/effects/correlation_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <random>

#include "render/cpu/blend.h"
#include "render/radiance/correlation.h"
#include "render/world/visibility_maps.h"
#include "scene/geometry/constants.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kPoints = 6000;  // of the proxy that are looked at
constexpr int kNearest = 24;   // photos of a point, nearest in angle to the one it was found by
constexpr int kBins = 24;      // of angles, evenly in their logarithms
constexpr double kSmallest = 0.05 * kRadPerDeg, kLargest = 60 * kRadPerDeg;
constexpr long kLeastPairs = 200;     // of a bin that counts
constexpr double kLeastShared = 0.1;  // of the variance: less, and photos have nothing in common
constexpr double kFarShare = 0.2;     // of all pairs, those farthest apart say what no correlation is

int BinOf(double angle_rad) {
  const double x = std::log(std::max(angle_rad, kSmallest) / kSmallest) / std::log(kLargest / kSmallest) * kBins;
  return std::clamp(static_cast<int>(x), 0, kBins - 1);
}

struct Variogram {
  std::array<double, kBins> square = {}, angle = {};  // sums over pairs
  std::array<long, kBins> pairs = {};
  long points = 0;

  Variogram& operator+=(const Variogram& o) {
    for (std::size_t i = 0; i < kBins; ++i) {
      square[i] += o.square[i];
      angle[i] += o.angle[i];
      pairs[i] += o.pairs[i];
    }
    points += o.points;
    return *this;
  }
};

class Looking {
 public:
  Looking(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos, const std::vector<bool>& use)
      : traced_(scene, proxy), photos_(photos) {
    for (std::size_t j = 0; j < traced_.sources.views.size(); ++j)
      if ((use.empty() || use[j]) && !photos[j].levels.empty()) used_.push_back(j);
  }

  bool any() const { return used_.size() > 1; }

  // The pairs of one point, found by a random pixel of a random photo.
  void Add(unsigned seed, Variogram& sum) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> inside(0.05, 0.95);
    const std::size_t by = used_[random() % used_.size()];
    const RenderView& v = traced_.sources.views[by];
    const auto direction = RayDirection(v.P, {inside(random) * v.size_px.x(), inside(random) * v.size_px.y()});
    if (!direction) return;
    const Eigen::Vector3d d = direction->normalized();
    const Eigen::Vector3f d_float = d.cast<float>();
    float t = 0;
    traced_.tracer.Trace(v.centre.cast<float>(), {&d_float, 1}, {&t, 1});
    if (!(t > 0) || !std::isfinite(t)) return;
    const Eigen::Vector3d p = v.centre + static_cast<double>(t) * d;
    struct Sight {
      double angle = 0;
      Eigen::Vector3d direction = Eigen::Vector3d::Zero();
      Eigen::Array3f color = Eigen::Array3f::Zero();
      std::size_t photo = 0;
      float u = 0, v = 0;
    };
    std::vector<Sight> sights;
    for (const std::size_t j : used_) {
      const RenderView& view = traced_.sources.views[j];
      const Eigen::Vector3d q = view.P * p.homogeneous();
      if (!(q.z() > 0)) continue;
      const auto x = static_cast<float>(q.x() / q.z()), y = static_cast<float>(q.y() / q.z());
      const auto w = static_cast<float>(view.size_px.x()), h = static_cast<float>(view.size_px.y());
      if (!(x >= 0 && y >= 0 && x <= w && y <= h)) continue;
      const auto depth = static_cast<float>(q.z() / view.P.row(2).head<3>().norm());
      if (!traced_.maps.empty() && traced_.maps.Visibility(static_cast<int>(j), x, y, w, h, depth) < kHalfVisible)
        continue;
      const Eigen::Vector3d to = (view.centre - p).normalized();
      sights.push_back({2 * std::atan2((to + d).norm(), (to - d).norm()), to, Eigen::Array3f::Zero(), j, x / w, y / h});
    }
    if (sights.size() < 2) return;
    if (sights.size() > kNearest) {
      // Some of the nearest, and others from anywhere, so that all angles have their pairs.
      std::ranges::nth_element(sights, sights.begin() + kNearest / 2, {}, &Sight::angle);
      std::shuffle(sights.begin() + kNearest / 2, sights.end(), random);
      sights.resize(kNearest);
    }
    for (Sight& s : sights)
      s.color = SamplePhoto(photos_[s.photo], s.u, s.v, 0) / static_cast<float>(traced_.sources.views[s.photo].gain);
    for (std::size_t a = 0; a < sights.size(); ++a)
      for (std::size_t b = a + 1; b < sights.size(); ++b) {
        const double angle = 2 * std::atan2((sights[a].direction - sights[b].direction).norm(),
                                            (sights[a].direction + sights[b].direction).norm());
        const auto bin = static_cast<std::size_t>(BinOf(angle));
        sum.square[bin] += static_cast<double>((sights[a].color - sights[b].color).square().mean());
        sum.angle[bin] += angle;
        ++sum.pairs[bin];
      }
    ++sum.points;
  }

 private:
  TracedProxy traced_;
  const std::vector<Photo>& photos_;
  std::vector<std::size_t> used_;
};

// Of the leaves times the factor that fits best, which is set: 1 / (1 + noise).
double ErrorOf(const std::vector<CorrelationBin>& bins, double r_min, double r_max, double& factor) {
  const FallingLeaves leaves(r_min, r_max);
  // A bin's weight grows with its pairs, and not without bound: neighbouring pairs of a point are no news.
  const auto weight = [](const CorrelationBin& b) { return std::sqrt(static_cast<double>(b.pairs)); };
  double pp = 0, pc = 0;
  for (const CorrelationBin& b : bins) {
    const double p = leaves.PSame(b.angle_rad);
    pp += weight(b) * p * p;
    pc += weight(b) * p * b.correlation;
  }
  factor = std::clamp(pp > 0 ? pc / pp : 1.0, kLeastShared, 1.0);
  double error = 0, sum = 0;
  for (const CorrelationBin& b : bins) {
    const double e = b.correlation - factor * leaves.PSame(b.angle_rad);
    error += weight(b) * e * e;
    sum += weight(b);
  }
  return error / sum;
}

}  // namespace

std::optional<MeasuredCorrelation> FitLeaves(const std::vector<CorrelationBin>& bins) {
  if (bins.size() < 3) return std::nullopt;
  MeasuredCorrelation best;
  double least = std::numeric_limits<double>::infinity();
  // The two radii, each to a quarter of an octave: finer than what they are told to. The lanes want them 1.2 apart.
  for (double r_max = 0.25 * kRadPerDeg; r_max < 45 * kRadPerDeg; r_max *= std::exp2(0.25))
    for (double share = 1 / 1.2; share > 1e-4; share /= std::exp2(0.25)) {
      double factor = 1;
      const double error = ErrorOf(bins, share * r_max, r_max, factor);
      if (!(error < least)) continue;
      least = error;
      best.r_min_rad = share * r_max;
      best.r_max_rad = r_max;
      best.noise = 1 / factor - 1;
    }
  best.rms = std::sqrt(least);
  best.bins = bins;
  return best;
}

std::optional<MeasuredCorrelation> MeasureCorrelation(const Scene& scene, const Mesh& proxy,
                                                      const std::vector<Photo>& photos, const std::vector<bool>& use) {
  const Looking looking(scene, proxy, photos, use);
  if (!looking.any()) return std::nullopt;
  // Sums in the order of the blocks: the same on any number of threads.
  constexpr std::size_t kBlock = 100;
  std::vector<Variogram> blocks((kPoints + kBlock - 1) / kBlock);
  ParallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end && !InterruptRequested(); ++b)
      for (std::size_t i = b * kBlock; i < std::min<std::size_t>((b + 1) * kBlock, kPoints); ++i)
        looking.Add(static_cast<unsigned>(i), blocks[b]);
  });
  CheckInterrupted();
  Variogram sum;
  for (const Variogram& b : blocks) sum += b;
  // What no correlation is: the pairs farthest apart.
  long all = 0;
  for (const long n : sum.pairs) all += n;
  double far = 0;
  long far_pairs = 0;
  for (std::size_t i = kBins; i-- > 0 && far_pairs < kFarShare * static_cast<double>(all);) {
    far += sum.square[i];
    far_pairs += sum.pairs[i];
  }
  if (far_pairs == 0 || !(far > 0)) return std::nullopt;
  far /= static_cast<double>(far_pairs);
  std::vector<CorrelationBin> bins;
  for (std::size_t i = 0; i < kBins; ++i)
    if (sum.pairs[i] >= kLeastPairs) {
      const auto n = static_cast<double>(sum.pairs[i]);
      bins.push_back({sum.angle[i] / n, 1 - sum.square[i] / n / far, sum.pairs[i]});
    }
  auto fit = FitLeaves(bins);
  if (fit) fit->points = sum.points;
  return fit;
}

}  // namespace lumi
