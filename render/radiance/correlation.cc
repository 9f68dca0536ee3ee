#include "render/radiance/correlation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace lumi {
namespace {

constexpr double kPi = std::numbers::pi;
// Terms of F: the last is below (1/4)^28 of the first.
constexpr int kTerms = 28;
// Below this, G(theta/r_max) - G(theta/r_min) loses digits to cancellation and the mean of g is taken instead.
constexpr double kShortInterval = 0.5;

// 2 zeta(2n) / (pi^2n (2n + 1)): t cot t = 1 - 2 sum zeta(2n) (t/pi)^2n, integrated.
std::array<double, kTerms> SeriesCoefficients() {
  std::array<double, kTerms> c{};
  for (int n = 1; n <= kTerms; ++n) {
    long double zeta = n == 1 ? std::numbers::pi_v<long double> * std::numbers::pi_v<long double> / 6 : 0;
    if (n > 1) {
      // Euler and Maclaurin behind the first terms.
      constexpr int kLast = 30;
      const long double s = 2 * n;
      for (int k = kLast - 1; k >= 1; --k) zeta += std::pow(static_cast<long double>(k), -s);
      const long double N = kLast, p = std::pow(N, -s);
      zeta += p * (N / (s - 1) + 0.5L + s / (12 * N) - s * (s + 1) * (s + 2) / (720 * N * N * N));
    }
    c[static_cast<std::size_t>(n - 1)] =
        static_cast<double>(2 * zeta * std::pow(std::numbers::pi_v<long double>, -2 * n) / (2 * n + 1));
  }
  return c;
}

// Nodes and weights of Gauss and Legendre on [0, 1], by Newton's method.
template <int N>
struct GaussLegendre {
  std::array<double, N> node, weight;
  GaussLegendre() {
    for (int i = 0; i < N; ++i) {
      double x = std::cos(kPi * (i + 0.75) / (N + 0.5)), derivative = 1;
      for (int step = 0; step < 8; ++step) {
        double p0 = 1, p1 = x;
        for (int k = 2; k <= N; ++k) {
          const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
          p0 = p1;
          p1 = p2;
        }
        derivative = N * (x * p1 - p0) / (x * x - 1);
        x -= p1 / derivative;
      }
      node[static_cast<std::size_t>(i)] = 0.5 * (1 - x);
      weight[static_cast<std::size_t>(i)] = 1 / ((1 - x * x) * derivative * derivative);
    }
  }
};

}  // namespace

double DiscOverlap(double x) {
  if (!(x < 2)) return 0;
  // sqrt(1 - x^2/4) as a product, acos as atan2: no digits are lost near 2.
  const double half = 0.5 * x, s = std::sqrt((1 - half) * (1 + half));
  return 2 / kPi * (std::atan2(s, half) - half * s);
}

double DiscOverlapSeries(double psi) {
  static const std::array<double, kTerms> c = SeriesCoefficients();
  const double q = psi * psi;
  double sum = 0;
  for (int n = kTerms; n-- > 0;) sum = (sum + c[static_cast<std::size_t>(n)]) * q;
  return psi * (1.5 - sum) + 0.25 * std::sin(2 * psi);
}

double DiscOverlapIntegral(double x) {
  if (!(x < 2)) return 0;
  return std::max(0.0, -std::log(x) - 0.5 + 2 / kPi * DiscOverlapSeries(std::asin(0.5 * x)));
}

FallingLeaves::FallingLeaves(double r_min_rad, double r_max_rad) : r_min_(r_min_rad), r_max_(r_max_rad) {
  if (!(r_min_rad >= 0 && r_min_rad <= r_max_rad && r_max_rad > 0 && std::isfinite(r_max_rad)))
    throw std::invalid_argument("FallingLeaves: 0 <= r_min <= r_max and r_max > 0 are wanted");
  log_ratio_ =
      r_min_rad > 0 ? std::log1p((r_max_rad - r_min_rad) / r_min_rad) : std::numeric_limits<double>::infinity();
}

double FallingLeaves::PSame(double theta) const {
  if (!(theta > 0)) return 1;
  if (theta >= 2 * r_max_ || r_min_ == 0) return 0;
  const double u = theta / r_max_, s = theta / r_min_, L = log_ratio_;
  if (s >= 2) {
    // The largest leaves alone reach: no cancellation.
    const double B = DiscOverlapIntegral(u);
    return B / (2 * L - B);
  }
  if (L < kShortInterval) {
    static const GaussLegendre<20> rule;
    double mean = 0;
    for (std::size_t i = 0; i < rule.node.size(); ++i)
      mean += rule.weight[i] * DiscOverlap(u * std::exp(L * rule.node[i]));
    return std::min(1.0, mean / (2 - mean));
  }
  // G(u) - G(s) with the logarithms taken off: they are L together.
  const double B = L - 2 / kPi * (DiscOverlapSeries(std::asin(0.5 * s)) - DiscOverlapSeries(std::asin(0.5 * u)));
  return std::clamp(B / (2 * L - B), 0.0, 1.0);
}

double FallingLeaves::PSameCubic(double theta) const {
  constexpr double a0 = 1.0, a1 = -0.61, a2 = -0.051, a3 = 0.052;  // errata: the thesis prints a2 = 0.051
  if (theta > 2 * r_max_) return 0;
  const double u = theta / r_max_, s = theta / r_min_, L = log_ratio_;
  const double top = std::min(s, 2.0);
  const double log_term = s < 2 ? L : std::log(2 / u);
  const double B =
      a3 / 3 * (top * top * top - u * u * u) + a2 / 2 * (top * top - u * u) + a1 * (top - u) + a0 * log_term;
  return std::clamp(B / (2 * L - B), 0.0, 1.0);
}

}  // namespace lumi
