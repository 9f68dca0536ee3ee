#include "render/effects/vignetting.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

constexpr double kFalloffHuber = 0.1;  // log units: highlights and occlusions lie beyond
constexpr int kFalloffRounds = 8;      // rounds of reweighting
constexpr double kPriorSigma = 0.5;    // of a and b: a lens that loses half of the code value is a strong one
constexpr double kGainSigma = 1;       // log units, prior of a gain: for photos that share no points with others
constexpr std::size_t kMostPhotos = 500;
constexpr double kSure = 2.6;     // standard deviations: 99 % of a normal error
constexpr double kUseless = 0.1;  // log units: a corner with a larger error counts as unknown
// Photos: with fewer, surfaces that reflect to one side are taken for vignetting. The eleven photos of the fountain
// seem to have corners of 68 %, and correcting for that lowers the PSNR of held-out photos by 0.2 dB.
constexpr int kFewestPhotos = 16;
constexpr int kMostLenses = 8;

// A sight of a point in one of the photos that are compared.
struct RadialSight {
  std::size_t point = 0, photo = 0;
  int lens = -1;
  double r2 = 0, log_value = 0;
};

double HuberWeight(double residual) {
  return std::abs(residual) <= kFalloffHuber ? 1 : kFalloffHuber / std::abs(residual);
}

// The sights of every n-th photo: enough for two unknowns per lens, and few enough for a dense matrix.
std::vector<RadialSight> SightsOfSome(const std::vector<ColorSample>& samples, const std::vector<int>& lens_of_view,
                                      std::size_t& photos) {
  const std::size_t step = (lens_of_view.size() + kMostPhotos - 1) / kMostPhotos;
  photos = (lens_of_view.size() + step - 1) / step;
  std::vector<RadialSight> sights;
  for (const ColorSample& s : samples)
    if (s.photo % step == 0)
      sights.push_back({s.point, s.photo / step, lens_of_view[s.photo], s.r2,
                        std::log(static_cast<double>(s.rgb[0] + s.rgb[1] + s.rgb[2]))});
  // All sights of a point are consecutive.
  std::stable_sort(sights.begin(), sights.end(),
                   [](const RadialSight& a, const RadialSight& b) { return a.point < b.point; });
  return sights;
}

// Weighted least squares for the photos' gains and each lens's a and b, the points' levels eliminated (the Schur
// complement). Unknowns: one a photo, then a and b of each lens.
class LensProblem {
 public:
  LensProblem(const std::vector<RadialSight>& sights, std::size_t photos, int lenses)
      : sights_(sights),
        photos_(static_cast<Eigen::Index>(photos)),
        size_(photos_ + 2 * lenses),
        weight_(sights.size(), 1.0),
        residual_(sights.size(), 0.0) {}

  void Solve() {
    for (int round = 0; round < kFalloffRounds; ++round) {
      BuildAndSolve();
      double sum = 0, count = 0;
      ForPoints([&](std::size_t begin, std::size_t end) {
        const double level =
            MeanOf(begin, end, [&](std::size_t i) { return sights_[i].log_value - Fitted(i, theta_); });
        for (std::size_t i = begin; i < end; ++i) {
          residual_[i] = sights_[i].log_value - Fitted(i, theta_) - level;
          sum += weight_[i] * residual_[i] * residual_[i];
          count += weight_[i];
        }
      });
      variance_ = std::max(1e-8, sum / std::max(1.0, count));
      if (round + 1 == kFalloffRounds) return;
      for (std::size_t i = 0; i < weight_.size(); ++i) weight_[i] = HuberWeight(residual_[i]);
    }
  }

  Eigen::Vector2d Lens(int k) const { return theta_.segment<2>(photos_ + 2 * k); }
  // The normal matrix of a lens's two unknowns, with all other unknowns eliminated.
  Eigen::Matrix2d LensNormal(int k) const {
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(size_, 2);
    unit.block<2, 2>(photos_ + 2 * k, 0).setIdentity();
    return Eigen::Matrix2d(solver_.solve(unit).block<2, 2>(photos_ + 2 * k, 0)).inverse();
  }
  // One standard deviation of a lens's log corner: the larger of two estimates, from the residuals' variance and from
  // each photo's sum of residuals, which does not cancel on glossy surfaces.
  double CornerError(int k) const {
    Eigen::VectorXd corner = Eigen::VectorXd::Zero(size_);
    corner.segment<2>(photos_ + 2 * k).setOnes();
    const Eigen::VectorXd influence = solver_.solve(corner);
    Eigen::VectorXd of_photo = Eigen::VectorXd::Zero(photos_);
    ForPoints([&](std::size_t begin, std::size_t end) {
      const double mean = MeanOf(begin, end, [&](std::size_t i) { return Fitted(i, influence); });
      for (std::size_t i = begin; i < end; ++i)
        of_photo[static_cast<Eigen::Index>(sights_[i].photo)] +=
            weight_[i] * residual_[i] * (Fitted(i, influence) - mean);
    });
    // Correction for few photos: two numbers were fitted to their sums.
    const double few = static_cast<double>(photos_) / std::max(1.0, static_cast<double>(photos_ - 2));
    return std::sqrt(std::max(variance_ * influence.dot(corner), few * of_photo.squaredNorm()));
  }

 private:
  template <typename F>
  void ForPoints(const F& f) const {
    for (std::size_t begin = 0, end = 0; begin < sights_.size(); begin = end) {
      while (end < sights_.size() && sights_[end].point == sights_[begin].point) ++end;
      f(begin, end);
    }
  }
  template <typename F>
  double MeanOf(std::size_t begin, std::size_t end, const F& value) const {
    double sum = 0, count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      sum += weight_[i] * value(i);
      count += weight_[i];
    }
    return sum / count;
  }
  // The value that the unknowns predict for a sight, without its point's level.
  double Fitted(std::size_t i, const Eigen::VectorXd& unknowns) const {
    const RadialSight& s = sights_[i];
    double value = unknowns[static_cast<Eigen::Index>(s.photo)];
    if (s.lens >= 0) {
      const Eigen::Index k = photos_ + 2 * s.lens;
      value += (unknowns[k] + unknowns[k + 1] * s.r2) * s.r2;
    }
    return value;
  }
  // Calls f(index of unknown, its factor) for all unknowns of a sight.
  template <typename F>
  void ForUnknowns(const RadialSight& s, const F& f) const {
    f(static_cast<Eigen::Index>(s.photo), 1.0);
    if (s.lens < 0) return;
    f(photos_ + 2 * s.lens, s.r2);
    f(photos_ + 2 * s.lens + 1, s.r2 * s.r2);
  }
  void BuildAndSolve() {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size_, size_);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size_), mean = Eigen::VectorXd::Zero(size_);
    std::vector<Eigen::Index> seen;
    ForPoints([&](std::size_t begin, std::size_t end) {
      double sum = 0, level = 0;
      seen.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const double w = weight_[i], y = sights_[i].log_value;
        sum += w;
        level += w * y;
        ForUnknowns(sights_[i], [&](Eigen::Index a, double x) {
          if (x == 0) return;
          if (mean[a] == 0) seen.push_back(a);
          mean[a] += w * x;
          right[a] += w * x * y;
          ForUnknowns(sights_[i], [&](Eigen::Index b, double z) { normal(a, b) += w * x * z; });
        });
      }
      for (const Eigen::Index a : seen) {
        right[a] -= mean[a] * level / sum;
        for (const Eigen::Index b : seen) normal(a, b) -= mean[a] * mean[b] / sum;
      }
      for (const Eigen::Index a : seen) mean[a] = 0;
    });
    normal.diagonal().head(photos_).array() += variance_ / (kGainSigma * kGainSigma);
    normal.diagonal().tail(size_ - photos_).array() += variance_ / (kPriorSigma * kPriorSigma);
    solver_.compute(normal);
    theta_ = solver_.solve(right);
  }

  const std::vector<RadialSight>& sights_;
  const Eigen::Index photos_, size_;
  std::vector<double> weight_, residual_;
  double variance_ = kFalloffHuber * kFalloffHuber;
  Eigen::VectorXd theta_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

// The falloff nearest to (a, b), in the metric of the normal matrix, that never increases towards the corner: a <= 0
// and a + 2 b <= 0. The solution lies inside, on one of the two lines, or where they meet.
RadialFalloff Monotone(const Eigen::Vector2d& theta, const Eigen::Matrix2d& normal) {
  const auto allowed = [](const Eigen::Vector2d& t) { return t[0] <= 1e-12 && t[0] + 2 * t[1] <= 1e-12; };
  if (allowed(theta)) return {theta[0], theta[1]};
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double least = theta.dot(normal * theta);
  for (const Eigen::Vector2d& line : {Eigen::Vector2d(0, -1), Eigen::Vector2d(-2, 1)}) {
    const Eigen::Vector2d t = std::max(0.0, line.dot(normal * theta) / line.dot(normal * line)) * line;
    const double cost = (t - theta).dot(normal * (t - theta));
    if (cost < least && allowed(t)) {
      best = t;
      least = cost;
    }
  }
  return {best[0], best[1]};
}

}  // namespace

Vignetting EstimateVignetting(const std::vector<ColorSample>& samples, const std::vector<int>& lens_of_view) {
  Vignetting out;
  out.of_view.assign(lens_of_view.size(), {});
  out.noise = 0;
  const int lenses = lens_of_view.empty() ? 0 : 1 + *std::max_element(lens_of_view.begin(), lens_of_view.end());
  if (samples.empty() || lenses == 0) return out;
  std::size_t photos = 0;
  const std::vector<RadialSight> sights = SightsOfSome(samples, lens_of_view, photos);
  LensProblem problem(sights, photos, lenses);
  problem.Solve();
  for (int k = 0; k < lenses; ++k) {
    const double error = problem.CornerError(k);
    if (!(error < kUseless)) continue;
    const RadialFalloff falloff = Monotone(problem.Lens(k), problem.LensNormal(k));
    // The larger of the corner after and before Monotone: data whose fit rises again do not determine the corner.
    const double corner = std::max(falloff.Corner(), std::exp(problem.Lens(k).sum())), noise = std::exp(-kSure * error);
    if (out.noise == 0 || corner / noise < out.corner / out.noise) {
      out.corner = corner;
      out.noise = noise;
    }
    if (corner >= noise) continue;
    for (std::size_t v = 0; v < lens_of_view.size(); ++v)
      if (lens_of_view[v] == k) out.of_view[v] = falloff;
  }
  return out;
}

std::vector<int> LensesOfViews(const Scene& scene) {
  struct Lens {
    Eigen::Vector2i size_px;
    double focal_px = 0;
    std::vector<std::size_t> views;
  };
  constexpr double kSameFocal = 1.05;
  std::vector<Lens> lenses;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    const Eigen::Vector2i size = SizePx(scene, view);
    const double focal = scene.frame == Frame::kMetric ? scene.CameraOf(view).FocalPx().mean() : 1;
    const auto same = std::find_if(lenses.begin(), lenses.end(), [&](const Lens& l) {
      return l.size_px == size && focal < kSameFocal * l.focal_px && l.focal_px < kSameFocal * focal;
    });
    if (same != lenses.end())
      same->views.push_back(v);
    else
      lenses.push_back({size, focal, {v}});
  }
  std::stable_sort(lenses.begin(), lenses.end(),
                   [](const Lens& a, const Lens& b) { return a.views.size() > b.views.size(); });
  std::vector<int> of_view(scene.views.size(), -1);
  for (std::size_t k = 0; k < std::min<std::size_t>(lenses.size(), kMostLenses); ++k)
    if (lenses[k].views.size() >= kFewestPhotos)
      for (const std::size_t v : lenses[k].views) of_view[v] = static_cast<int>(k);
  return of_view;
}

}  // namespace lumi
