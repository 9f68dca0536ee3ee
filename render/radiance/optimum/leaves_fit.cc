#include "render/radiance/optimum/leaves_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace lumi {
namespace {

// The polynomial of z in [-1, 1] through f at Chebyshev's nodes, in powers of z.
template <std::size_t N, class F>
std::array<double, N> Interpolate(const F& f) {
  constexpr int n = static_cast<int>(N);
  std::array<double, N> chebyshev{};
  for (int i = 0; i < n; ++i) {
    const double angle = std::numbers::pi * (i + 0.5) / n, value = f(std::cos(angle));
    for (int k = 0; k < n; ++k)
      chebyshev[static_cast<std::size_t>(k)] += value * std::cos(k * angle) * (k == 0 ? 1.0 : 2.0) / n;
  }
  // T_{k+1} = 2 z T_k - T_{k-1}
  std::array<double, N> power{}, before{}, now{};
  before[0] = 1;
  if (n > 1) now[1] = 1;
  power[0] = chebyshev[0];
  for (std::size_t k = 1; k < N; ++k) {
    for (std::size_t i = 0; i <= k; ++i) power[i] += chebyshev[k] * now[i];
    std::array<double, N> next{};
    for (std::size_t i = 0; i < N; ++i) next[i] = (i > 0 ? 2 * now[i - 1] : 0) - before[i];
    before = now;
    now = next;
  }
  return power;
}

template <std::size_t N>
double Horner(const std::array<double, N>& c, double z) {
  double p = 0;
  for (std::size_t i = N; i-- > 0;) p = p * z + c[i];
  return p;
}

}  // namespace

template <class T>
LeavesFit<T>::LeavesFit(const FallingLeaves& leaves, double alpha) {
  const double two_r = 2 * leaves.r_max_rad(), L = leaves.log_ratio();
  const double reach = alpha > 0 ? std::min(std::numbers::pi, two_r / alpha) : std::numbers::pi;
  const double chord = 2 * std::sin(0.5 * reach), c2 = chord * chord;
  const auto Q = [](double y2) {
    const double y = std::sqrt(std::max(y2, 0.0));
    return y > 1e-9 ? 2 / std::numbers::pi * DiscOverlapSeries(std::asin(std::min(y, 1.0))) / y : 4 / std::numbers::pi;
  };
  const auto A = [](double s) {  // theta^2 / c^2, s = c^2
    const double half = 0.5 * std::sqrt(std::max(s, 0.0));
    const double stretch = half > 1e-9 ? std::asin(std::min(half, 1.0)) / half : 1.0;
    return stretch * stretch;
  };
  const auto q_fit = Interpolate<kQ + 1>([&](double z) { return Q(0.5 * (z + 1)); });
  const auto a_fit = Interpolate<kA + 1>([&](double z) { return A(0.5 * (z + 1) * c2); });
  std::copy(q_fit.begin(), q_fit.end(), q.begin());
  std::copy(a_fit.begin(), a_fit.end(), a.begin());
  c2_max = static_cast<T>(c2);
  c2_scale = static_cast<T>(2 / c2);
  y_from_theta = static_cast<T>(alpha / two_r);
  log_ratio = static_cast<T>(L);
  ratio = static_cast<T>(leaves.r_max_rad() / leaves.r_min_rad());
  y_near = static_cast<T>(leaves.r_min_rad() / leaves.r_max_rad());

  // P's error is dB 2 L / (2 L - B)^2 <= 2 dB / L, with dB from Q, and from the angle's through dB/dy <= 1/y.
  double q_error = 0, a_error = 0;
  // The error alternates some kQ times over the interval, least densely in its middle.
  constexpr int kProbes = 100;
  for (int i = 0; i <= kProbes; ++i) {
    const double z = std::cos(std::numbers::pi * i / kProbes);
    q_error = std::max(q_error, std::abs(Horner(q_fit, z) - Q(0.5 * (z + 1))));
    a_error = std::max(a_error, std::abs(Horner(a_fit, z) / A(0.5 * (z + 1) * c2) - 1));
  }
  // Below y_near two fits stand, and their errors' difference is counted twice.
  error = 2 / L * (2 * q_error + 0.5 * a_error);
  usable = error <= kTolerance && std::isfinite(L) && L > 0.1;
}

template struct LeavesFit<float>;
template struct LeavesFit<double>;

}  // namespace lumi
