// The optimum once more, plainly and in any number type (50 digits of Boost.Multiprecision, long double): all photos,
// no cutoff, a full matrix, Cholesky. Reads the same inputs as render/radiance (centres, ray and measures as they are
// stored) and shares no formula's code with it.
#pragma once

#include <array>
#include <boost/math/constants/constants.hpp>
#include <boost/math/special_functions/bernoulli.hpp>
#include <cmath>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/evaluate.h"
#include "scene/geometry/rigid3.h"

namespace lumi::test {

// Eq. 4.4 with the exact overlap of discs: by the series t cot t = sum (-1)^n 2^2n B_2n t^2n / (2n)!.
template <class Real>
class OracleLeaves {
 public:
  OracleLeaves(Real r_min, Real r_max) : r_min_(r_min), r_max_(r_max) {
    Real factor = 1;  // (-4)^n / (2n + 1)!
    for (int n = 1; n < kTerms; ++n) {
      factor *= Real(-4) / (Real(2 * n) * Real(2 * n + 1));
      c_.push_back(factor * boost::math::bernoulli_b2n<Real>(n));
    }
  }
  Real operator()(const Real& theta) const {
    using std::log;
    if (theta >= 2 * r_max_) return 0;
    if (theta == 0) return 1;
    const Real L = log(r_max_ / r_min_);
    Real B = G(theta / r_max_);
    if (theta < 2 * r_min_) B -= G(theta / r_min_);
    return B / (2 * L - B);
  }
  Real G(const Real& x) const {
    using std::asin, std::log, std::sin;
    const Real psi = asin(x / 2), q = psi * psi;
    Real sum = 0;
    for (std::size_t n = c_.size(); n-- > 0;) sum = (sum + c_[n]) * q;
    return -log(x) - Real(1) / 2 +
           (psi * (1 + sum) + psi / 2 + sin(2 * psi) / 4) * 2 / boost::math::constants::pi<Real>();
  }

 private:
  static constexpr int kTerms = std::numeric_limits<Real>::digits10 > 30 ? 90 : 40;
  Real r_min_, r_max_;
  std::vector<Real> c_;
};

// Lower triangle by rows; solves for several right-hand sides.
template <class Real>
std::vector<std::vector<Real>> OracleCholesky(std::vector<std::vector<Real>> S, std::vector<std::vector<Real>> rhs) {
  using std::sqrt;
  const std::size_t n = S.size();
  // Zeros left of a row's first entry stay zeros.
  std::vector<std::size_t> begin(n);
  for (std::size_t i = 0; i < n; ++i) {
    while (begin[i] < i && S[i][begin[i]] == 0) ++begin[i];
    for (std::size_t j = begin[i]; j <= i; ++j) {
      Real sum = S[i][j];
      for (std::size_t k = std::max(begin[i], begin[j]); k < j; ++k) sum -= S[i][k] * S[j][k];
      S[i][j] = i == j ? Real(sqrt(sum)) : Real(sum / S[j][j]);
    }
  }
  for (auto& b : rhs) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = begin[i]; k < i; ++k) b[i] -= S[i][k] * b[k];
      b[i] /= S[i][i];
    }
    for (std::size_t i = n; i-- > 0;) {
      b[i] /= S[i][i];
      for (std::size_t k = begin[i]; k < i; ++k) b[k] -= S[i][k] * b[i];
    }
  }
  return rhs;
}

template <class Real>
struct OracleWeights {
  std::vector<Real> w, y;    // of every photo, before the sum is made 1
  std::vector<Real> weight;  // after it; empty where no photo sees the point
  int correlated = 0;        // photos with y > 0
};

// The geometry before it was rounded to float.
struct ExactRay {
  const std::vector<Eigen::Vector3d>* D = nullptr;  // photos' centres less the view's
  Eigen::Vector3d direction;
  double t = 0;
};

// What photos see of the point, and the real-time weights there, computed by whoever asks instead of by the code under
// test. Photos' terms beside the angle are off.
template <class Real>
struct OwnInputs {
  std::vector<Real> f;     // field of view times visibility; 0: left out
  std::vector<Real> mean;  // Eq. 5.1's weights, sum 1
};

// `own`: nothing of render/radiance is called but what setup holds: centres, matrices, settings.
// `nugget` is added to S's diagonal. `exact`: angles are computed from this instead of the stored centres and ray.
template <class Real>
OracleWeights<Real> OracleOptimum(const ViewSetup& setup, const VisibilityMaps* maps, const Eigen::Vector3f& direction,
                                  float t, const OracleLeaves<Real>& leaves, const Real& nugget = 0,
                                  const ExactRay* exact = nullptr,
                                  const Eigen::Vector3f& normal = Eigen::Vector3f::Zero(),
                                  const OwnInputs<Real>* own = nullptr) {
  using std::abs, std::atan2, std::sqrt;
  const RelativeSources& r = setup.sources;
  const RadianceSettings& s = setup.settings;
  const bool additive = s.combine == Combine::kAdditive;
  Measures m;
  if (!own) {
    EvaluateMeasures(r, s, direction, t, normal, m);
    EvaluateVisibility(r, maps, direction, t, m);
  }
  struct Photo {
    std::size_t j;
    Real u[3], f, fv;
    std::array<Real, MeasureList::kCount> value;  // of the terms of h
  };
  const auto unit = [](const Real(&v)[3], Real(&out)[3]) {
    const Real length = sqrt(Real(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    for (int c = 0; c < 3; ++c) out[c] = v[c] / length;
  };
  const auto angle = [](const Real(&a)[3], const Real(&b)[3]) {
    const Real x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    return Real(atan2(Real(sqrt(Real(x * x + y * y + z * z))), Real(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])));
  };
  Real p[3];
  for (int c = 0; c < 3; ++c) p[c] = exact ? Real(exact->t) * Real(exact->direction[c]) : Real(t) * Real(direction[c]);
  Photo view{};
  const Real back[3] = {-p[0], -p[1], -p[2]};
  unit(back, view.u);
  view.f = view.fv = 1;
  ForEachTerm([&]<typename M> { view.value[MeasureList::IndexOf<M>()] = M::kOwn; });
  std::vector<Photo> photos;
  for (std::size_t j = 0; j < static_cast<std::size_t>(r.count); ++j) {
    Photo photo{};
    photo.j = j;
    if (own) {
      photo.fv = own->f[j];
    } else {
      // On its own ray a photo sees; within 0.0035 rad of it nearly.
      const Real off = m.theta[j] < 0.0035F ? Real(m.theta[j]) / Real(0.0035F) : Real(1);
      photo.fv = Real(m.f[j]) * (1 - (1 - Real(m.v[j])) * off * off * (3 - 2 * off));
    }
    photo.f = additive ? Real(r.enabled[j]) : photo.fv;
    if (photo.f == 0) continue;
    Real to[3] = {Real(r.dx[j]) - p[0], Real(r.dy[j]) - p[1], Real(r.dz[j]) - p[2]};
    if (exact)
      for (int c = 0; c < 3; ++c) to[c] = Real((*exact->D)[j][c]) - p[c];
    unit(to, photo.u);
    ForEachTerm([&]<typename M> {
      if (!own && M::Factor(s) > 0) photo.value[MeasureList::IndexOf<M>()] = Real(m.Of<M>()[j]);
    });
    photos.push_back(photo);
  }
  const Real two_r = 2 * Real(s.r_max_rad);
  const auto correlation = [&](const Photo& a, const Photo& b) -> Real {
    // Far beyond reach the angle's digits do not matter.
    if (s.alpha >= 1 &&
        a.u[0] * b.u[0] + a.u[1] * b.u[1] + a.u[2] * b.u[2] < Real(std::cos(std::min(3.2, 2.001 * s.r_max_rad))))
      return 0;
    Real h = Real(s.alpha) * angle(a.u, b.u);
    ForEachTerm([&]<typename M> {
      constexpr auto i = static_cast<std::size_t>(MeasureList::IndexOf<M>());
      if (!own && M::Factor(s) > 0) h += two_r * Real(M::Factor(s)) * abs(Real(a.value[i] - b.value[i]));
    });
    if (additive) h += two_r * Real(s.gamma) * abs(Real(a.fv - b.fv));
    return leaves(h);
  };
  const std::size_t n = photos.size();
  std::vector<std::vector<Real>> S(n);
  std::vector<Real> y(n), f(n);
  for (std::size_t i = 0; i < n; ++i) {
    S[i].resize(i + 1);
    for (std::size_t j = 0; j < i; ++j) S[i][j] = photos[i].f * photos[j].f * correlation(photos[i], photos[j]);
    S[i][i] = 1 + nugget + Real(s.noise);
    y[i] = photos[i].f * correlation(photos[i], view);
    f[i] = photos[i].f;
  }
  const auto solved = OracleCholesky<Real>(S, {y, f});
  OracleWeights<Real> out;
  out.w.resize(static_cast<std::size_t>(r.count));
  out.y.resize(static_cast<std::size_t>(r.count));
  std::vector<Real> z(static_cast<std::size_t>(r.count));
  Real sum = 0, z_sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    out.w[photos[i].j] = solved[0][i];
    out.y[photos[i].j] = y[i];
    z[photos[i].j] = solved[1][i];
    sum += solved[0][i];
    z_sum += solved[1][i];
    out.correlated += y[i] > 0;
  }
  WeighScratch scratch;
  std::vector<Real> mean(static_cast<std::size_t>(r.count));
  if (own) {
    mean = own->mean;
  } else if (s.k == 0) {
    std::vector<float> all;
    if (!(WeighAll({r, maps, s}, {direction, t, normal}, scratch, all) > 0)) return out;
    for (std::size_t j = 0; j < all.size(); ++j) mean[j] = Real(all[j]);
  } else {
    const RayWeights near = Weigh({r, maps, s}, {direction, t, normal}, scratch);
    if (!(near.alpha > 0)) return out;
    for (std::size_t i = 0; i < static_cast<std::size_t>(near.count); ++i)
      mean[static_cast<std::size_t>(near.camera[i])] = Real(near.weight[i]);
  }
  out.weight = out.w;
  const Real floor = Real(1) / 1000;
  if (s.sum == WeightSum::kRenormalise) {
    const Real divisor = sum > floor ? sum : floor;
    for (std::size_t j = 0; j < out.weight.size(); ++j)
      out.weight[j] = out.w[j] / divisor + (1 - sum / divisor) * mean[j];
  } else if (s.sum == WeightSum::kConstrained) {
    const Real lambda = (1 - sum) / (z_sum > floor ? z_sum : floor);
    for (std::size_t j = 0; j < out.weight.size(); ++j)
      out.weight[j] += lambda * z[j] + (1 - sum - lambda * z_sum) * mean[j];
  } else {
    for (std::size_t j = 0; j < out.weight.size(); ++j) out.weight[j] += (1 - sum) * mean[j];
  }
  return out;
}

// Largest difference of a sample's weights from the oracle's.
template <class Real>
double LargestError(const WeightTable& table, std::size_t sample, const OracleWeights<Real>& oracle) {
  using std::abs;
  std::vector<Real> d(oracle.w.size());
  if (!oracle.weight.empty()) d = oracle.weight;
  for (std::int32_t i = table.first[sample]; i < table.first[sample + 1]; ++i)
    d[static_cast<std::size_t>(table.camera[static_cast<std::size_t>(i)])] -=
        Real(table.weight[static_cast<std::size_t>(i)]);
  double largest = 0;
  for (const Real& x : d) largest = std::max(largest, static_cast<double>(abs(x)));
  return largest;
}

// The thesis's Example #1 in its proportions: 262 photos of 640x480 on short vertical lines at tripod places in a
// sector around the objects, looking at them, and a slanted plane for a proxy.
struct DeskLike {
  Sources sources;
  RenderView view;  // 640x480
  Eigen::Vector3d normal{0.05, 0.12, 1};
  double offset = 0;  // of the plane normal.x = offset

  // Distance along a unit ray of the view to the plane; not positive where it is missed.
  double Distance(const Eigen::Vector3d& direction) const {
    return (offset - normal.dot(view.centre)) / normal.dot(direction);
  }
};

inline DeskLike MakeDeskLike(int photos = 262) {
  DeskLike d;
  auto noise = [state = 0.37]() mutable {
    state = std::fmod(state * 97.131 + 0.618033988749895, 1.0);
    return 2 * state - 1;
  };
  const Camera camera = Camera::Pinhole(640, 480, 700, 700, 320, 240);
  const double deg = kRadPerDeg;
  constexpr int kALine = 5;
  const int places = (photos + kALine - 1) / kALine;
  for (int i = 0; i < photos; ++i) {
    const int place = i / kALine;
    const double azimuth = (-40 + 80 * std::fmod(0.5 + 0.618033988749895 * place, 1.0)) * deg;
    const double elevation = (4 + 18.0 * place / places) * deg;
    const double distance = 1.8 + 0.25 * std::sin(7.7 * place);
    Eigen::Vector3d centre(distance * std::sin(azimuth) * std::cos(elevation), -distance * std::sin(elevation),
                           -distance * std::cos(azimuth) * std::cos(elevation));
    centre += Eigen::Vector3d(0.01 * noise(), -0.07 * (i % kALine - 2) + 0.01 * noise(), 0.01 * noise());
    const Eigen::Vector3d at(0.08 * noise(), 0.08 * noise(), 0.08 * noise());
    d.sources.views.push_back(MakeRenderView(camera, LookAt(centre, at, {0, -1, 0})));
  }
  d.view = MakeRenderView(camera, LookAt({0.17, -0.5, -1.75}, {0, 0, 0}, {0, -1, 0}));
  d.normal.normalize();
  return d;
}

// Rays of the view through these pixels.
inline RaySamples RaysThrough(const DeskLike& desk, const ViewSetup& setup,
                              const std::vector<Eigen::Vector2d>& pixels) {
  RaySamples rays;
  for (const auto& x : pixels) {
    const Eigen::Vector3d d = (setup.ray_from_pixel * x.homogeneous()).normalized();
    rays.direction.push_back(d.cast<float>());
    rays.t.push_back(static_cast<float>(desk.Distance(d)));
  }
  return rays;
}

}  // namespace lumi::test
