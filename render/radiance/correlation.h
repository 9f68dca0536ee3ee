// The correlation of two rays' radiance in the falling-leaves model (thesis sec. 4.1.2, Eqs. 4.3 to 4.5): the
// probability that two directions an angle apart lie on the same leaf, leaves being discs whose radii follow a 1/r^3
// law between r_min and r_max. Everything here is in radians.
//
// With x = angle / radius, two discs of one radius overlap by g(x) = (2/pi) (acos(x/2) - (x/2) sqrt(1 - x^2/4)), and
//   B = integral of g(theta/r) dr/r over [r_min, r_max] = G(theta/r_max) - G(theta/r_min),
//   P_same = B / (2 ln(r_max/r_min) - B).
// The thesis puts a cubic for g (errata: a2 = -0.051, not 0.051). It dips below 0 near x = 2, so the exact g is
// integrated here, which has a closed form with psi = asin(x/2):
//   G(x) = -ln x - 1/2 + (2/pi) F(psi),   F(psi) = integral of t cot t + cos^2 t over [0, psi],
// F an odd power series that converges at least as fast as 4^-n on the whole of [0, pi/2].
#pragma once

namespace lumi {

// g(x), x >= 0: 1 at 0, 0 from 2 on.
double DiscOverlap(double x);
// G(x) = integral of g(s)/s over [x, 2], x > 0; 0 from 2 on. Absolute error below 1e-15 (1 + |ln x|).
double DiscOverlapIntegral(double x);
// F(psi), psi in [0, pi/2].
double DiscOverlapSeries(double psi);

class FallingLeaves {
 public:
  // 0 <= r_min <= r_max, r_max > 0; throws std::invalid_argument otherwise.
  FallingLeaves(double r_min_rad, double r_max_rad);

  // theta >= 0. Exactly 1 at 0 and exactly 0 from 2 r_max on, never rising. Absolute error below 1e-14.
  // r_min = r_max is the limit g / (2 - g) (Eq. 4.4 is 0/0); r_min = 0 the other: 0 for every theta > 0.
  double PSame(double theta_rad) const;

  // Eq. 4.5 as the thesis computes it, a2 corrected and clamped at 0: within 0.02 of PSame. For comparison with its
  // figures. Needs 0 < r_min < r_max.
  double PSameCubic(double theta_rad) const;

  double r_min_rad() const { return r_min_; }
  double r_max_rad() const { return r_max_; }
  double log_ratio() const { return log_ratio_; }  // ln(r_max / r_min); infinite for r_min = 0

 private:
  double r_min_, r_max_, log_ratio_;
};

}  // namespace lumi
