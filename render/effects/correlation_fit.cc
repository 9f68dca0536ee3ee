#include "render/effects/correlation_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "render/cpu/blend.h"
#include "render/radiance/correlation.h"
#include "render/world/visibility_maps.h"
#include "scene/geometry/constants.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr std::size_t kPoints = 6000;   // points of the proxy that are sampled ...
constexpr std::size_t kPlaces = 18000;  // ... if correlation is measured by place
constexpr int kNearest = 24;            // photos compared at a point, at most
constexpr int kBins = 24;               // of angles, evenly in their logarithms
constexpr double kSmallest = 0.05 * kRadPerDeg, kLargest = 60 * kRadPerDeg;
constexpr long kLeastPairs = 200;     // least pairs of a bin that counts
constexpr double kLeastShared = 0.1;  // of the variance: less, and photos have nothing in common
constexpr double kFarShare = 0.2;  // share of all pairs, those farthest apart in angle, that stand for no correlation
// Prior for a node: the pairs of this many points of the whole scene are added to its own, so that nodes with few
// points follow the scene.
constexpr double kPriorPoints = 30;
constexpr int kRounds = 20;  // of k-means

int BinOf(double angle_rad) {
  const double x = std::log(std::max(angle_rad, kSmallest) / kSmallest) / std::log(kLargest / kSmallest) * kBins;
  return std::clamp(static_cast<int>(x), 0, kBins - 1);
}

struct Variogram {
  std::array<double, kBins> square = {}, angle = {}, pairs = {};  // sums over pairs
  double points = 0;

  void Add(const Variogram& o, double share) {
    for (std::size_t i = 0; i < kBins; ++i) {
      square[i] += share * o.square[i];
      angle[i] += share * o.angle[i];
      pairs[i] += share * o.pairs[i];
    }
    points += share * o.points;
  }
  Variogram& operator+=(const Variogram& o) {
    Add(o, 1);
    return *this;
  }
};

// A point of the proxy (normalised frame) and the pairs of photos that see it.
struct Look {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Variogram pairs;
};

class Looking {
 public:
  Looking(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos, const std::vector<bool>& use)
      : traced_(scene, proxy), photos_(photos) {
    for (std::size_t j = 0; j < traced_.sources.views.size(); ++j)
      if ((use.empty() || use[j]) && !photos[j].levels.empty()) used_.push_back(j);
  }

  bool any() const { return used_.size() > 1; }

  // The pairs of one point, chosen by a random pixel of a random photo; pairs.points is 0 if there are none.
  Look At(unsigned seed) const {
    Look look;
    Variogram& sum = look.pairs;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> inside(0.05, 0.95);
    const std::size_t by = used_[random() % used_.size()];
    const RenderView& v = traced_.sources.views[by];
    const auto direction = RayDirection(v.P, {inside(random) * v.size_px.x(), inside(random) * v.size_px.y()});
    if (!direction) return look;
    const Eigen::Vector3d d = direction->normalized();
    const Eigen::Vector3f d_float = d.cast<float>();
    float t = 0;
    traced_.tracer.Trace(v.centre.cast<float>(), {&d_float, 1}, {&t, 1});
    if (!(t > 0) || !std::isfinite(t)) return look;
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
    if (sights.size() < 2) return look;
    if (sights.size() > kNearest) {
      // Half of them are the nearest in angle, the others random, so that all angles have pairs.
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
    look.point = p;
    sum.points = 1;
    return look;
  }

 private:
  TracedProxy traced_;
  const std::vector<Photo>& photos_;
  std::vector<std::size_t> used_;
};

// Squared error of the leaves' P_same times the factor that fits best; sets `factor`, which is 1 / (1 + noise).
double ErrorOf(const std::vector<CorrelationBin>& bins, double r_min, double r_max, double& factor) {
  const FallingLeaves leaves(r_min, r_max);
  // A bin's weight grows slower than its pairs, because pairs of one point are not independent.
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

// The mean squared difference of uncorrelated photos, from the pairs farthest apart in angle. 0: there are no pairs, or
// none differ.
double FarSquare(const Variogram& v) {
  double all = 0, far = 0, far_pairs = 0;
  for (const double n : v.pairs) all += n;
  for (std::size_t i = kBins; i-- > 0 && far_pairs < kFarShare * all;) {
    far += v.square[i];
    far_pairs += v.pairs[i];
  }
  return far_pairs > 0 ? far / far_pairs : 0;
}

// 1 - gamma(h) / gamma(far) of the bins with enough pairs; empty: no pairs differ.
std::vector<CorrelationBin> Correlogram(const Variogram& v) {
  std::vector<CorrelationBin> bins;
  const double far = FarSquare(v);
  if (!(far > 0)) return bins;
  for (std::size_t i = 0; i < kBins; ++i)
    if (v.pairs[i] >= kLeastPairs)
      bins.push_back({v.angle[i] / v.pairs[i], 1 - v.square[i] / v.pairs[i] / far, std::lround(v.pairs[i])});
  return bins;
}

// Clusters correlograms into kinds by k-means: each row belongs to a node, `weight` is its number of points. The first
// centre is the mean, each further one the row farthest from all centres before, so that the result is deterministic.
std::vector<std::uint8_t> Kinds(const std::vector<Eigen::ArrayXd>& row, const std::vector<double>& weight,
                                std::size_t most) {
  std::vector<std::uint8_t> kind(row.size(), 0);
  Eigen::ArrayXd mean = Eigen::ArrayXd::Zero(row.front().size());
  double sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    mean += weight[i] * row[i];
    sum += weight[i];
  }
  std::vector<Eigen::ArrayXd> centre = {Eigen::ArrayXd(mean / sum)};
  const auto nearest = [&](const Eigen::ArrayXd& r) {
    std::pair<double, std::size_t> best(std::numeric_limits<double>::infinity(), 0);
    for (std::size_t k = 0; k < centre.size(); ++k) best = std::min(best, {(r - centre[k]).square().sum(), k});
    return best;
  };
  while (centre.size() < most) {
    std::pair<double, std::size_t> farthest(0, 0);
    for (std::size_t i = 0; i < row.size(); ++i) farthest = std::max(farthest, {weight[i] * nearest(row[i]).first, i});
    if (!(farthest.first > 0)) break;
    centre.push_back(row[farthest.second]);
  }
  for (int round = 0; round < kRounds; ++round) {
    bool same = true;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto k = static_cast<std::uint8_t>(nearest(row[i]).second);
      same = same && k == kind[i];
      kind[i] = k;
    }
    if (same && round > 0) break;
    std::vector<double> total(centre.size(), 0);
    std::vector<Eigen::ArrayXd> next(centre.size(), Eigen::ArrayXd::Zero(mean.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      next[kind[i]] += weight[i] * row[i];
      total[kind[i]] += weight[i];
    }
    for (std::size_t k = 0; k < centre.size(); ++k)
      if (total[k] > 0) centre[k] = next[k] / total[k];
  }
  return kind;
}

// The box that holds nine tenths of the points along each axis, so that a few far points do not spread the nodes out.
NodeGrid GridOver(const std::vector<Look>& looks, int regions) {
  NodeGrid grid;
  Eigen::Vector3d low, high;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> x;
    for (const Look& l : looks)
      if (l.pairs.points > 0) x.push_back(l.point[c]);
    std::ranges::sort(x);
    low[c] = x[x.size() / 20];
    high[c] = x[x.size() - 1 - x.size() / 20];
  }
  grid.box = Eigen::AlignedBox3d(low, high);
  const Eigen::Vector3d size = high - low;
  const double spacing = size.maxCoeff() / std::max(regions - 1, 1);
  for (int c = 0; c < 3; ++c)
    grid.count[c] = spacing > 0 ? std::max(1, static_cast<int>(std::lround(size[c] / spacing)) + 1) : 1;
  return grid;
}

// Sets found.kinds and by_place. `whole`: the variogram of the whole scene. A kind whose leaves cannot be fitted takes
// those of the whole scene.
void FindPlaces(const std::vector<Look>& looks, const Variogram& whole, int regions, MeasuredCorrelation& found) {
  auto places = std::make_shared<LeavesByPlace>();
  places->grid = GridOver(looks, regions);
  const auto nodes = static_cast<std::size_t>(places->grid.size());
  std::vector<Variogram> node(nodes);
  for (const Look& l : looks) {
    if (!(l.pairs.points > 0)) continue;
    const NodeGrid::Around around = places->grid.At(l.point);
    for (int i = 0; i < 8; ++i)
      if (around.share[i] > 0) node[static_cast<std::size_t>(around.node[i])].Add(l.pairs, around.share[i]);
  }
  // Rows over the bins that count in the whole scene, weighted by their pairs there.
  std::vector<Eigen::ArrayXd> row(nodes);
  std::vector<double> weight(nodes);
  std::vector<std::size_t> bin;
  for (std::size_t b = 0; b < kBins; ++b)
    if (whole.pairs[b] >= kLeastPairs) bin.push_back(b);
  for (std::size_t n = 0; n < nodes; ++n) {
    Variogram v = node[n];
    v.Add(whole, kPriorPoints / whole.points);
    weight[n] = node[n].points;
    const double far = FarSquare(v);
    row[n].resize(static_cast<Eigen::Index>(bin.size()));
    for (std::size_t i = 0; i < bin.size(); ++i) {
      const std::size_t b = bin[i];
      row[n][static_cast<Eigen::Index>(i)] =
          far > 0 ? std::pow(whole.pairs[b], 0.25) * (1 - v.square[b] / v.pairs[b] / far) : 0.0;
    }
  }
  places->kind = Kinds(row, weight, LeavesByPlace::kMostKinds);
  const std::size_t kinds = static_cast<std::size_t>(std::ranges::max(places->kind)) + 1;
  for (std::size_t k = 0; k < kinds; ++k) {
    Variogram v;
    for (std::size_t n = 0; n < nodes; ++n)
      if (places->kind[n] == k) v += node[n];
    const double points = v.points;
    v.Add(whole, kPriorPoints / whole.points);
    auto fit = FitLeaves(Correlogram(v));
    if (!fit) {
      fit.emplace(found);
      fit->bins = Correlogram(v);
    }
    places->kinds.push_back({fit->r_min_rad, fit->r_max_rad, fit->noise});
    found.kinds.push_back({places->kinds.back(), points / whole.points, std::move(fit->bins)});
  }
  found.by_place = std::move(places);
}

}  // namespace

std::optional<MeasuredCorrelation> FitLeaves(const std::vector<CorrelationBin>& bins) {
  if (bins.size() < 3) return std::nullopt;
  MeasuredCorrelation best;
  double least = std::numeric_limits<double>::infinity();
  // A grid search over the two radii in steps of a quarter octave, finer than the data determine them. The optimum's
  // lanes need a ratio of at least 1.2.
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
                                                      const std::vector<Photo>& photos, const std::vector<bool>& use,
                                                      int regions) {
  const Looking looking(scene, proxy, photos, use);
  if (!looking.any()) return std::nullopt;
  std::vector<Look> looks(regions > 1 ? kPlaces : kPoints);
  ParallelFor(looks.size(), 100, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end && !InterruptRequested(); ++i) looks[i] = looking.At(static_cast<unsigned>(i));
  });
  CheckInterrupted();
  // Summed in the points' order, so that the result does not depend on the number of threads.
  Variogram sum;
  for (const Look& l : looks) sum += l.pairs;
  auto fit = FitLeaves(Correlogram(sum));
  if (!fit) return fit;
  fit->points = std::lround(sum.points);
  if (regions > 1) FindPlaces(looks, sum, regions, *fit);
  return fit;
}

}  // namespace lumi
