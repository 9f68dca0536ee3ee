#include "reconstruct/factorization/two_view.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "reconstruct/factorization/projective_model.h"
#include "reconstruct/factorization/ransac.h"
#include "scene/geometry/constants.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMinShared = 16;
constexpr int kMinAgreeing = 12;
constexpr int kFewestInPlane = 8;         // points that a homography is fitted to: twice those that fix it
constexpr int kMostParallaxTrials = 300;  // pairs of points off the plane
// Distances to a homography below this are a tracker's own error, however small the noise of the rest; or below so many
// standard deviations of the distance to epipolar lines (it has one dimension and is shared by both frames, this one
// has two and is not).
constexpr double kPlaneFloorPx = 0.5;
constexpr double kPlaneSigmas = 6;
// How many points chance puts onto an epipolar line and off the plane: less than these.
constexpr int kMinOffPlane = 12;
constexpr double kMinOffPlaneShare = 0.08;

struct PairPoints {
  const std::vector<Vector2d>& a;
  const std::vector<Vector2d>& b;
  double unit_a, unit_b;
  std::size_t size() const { return a.size(); }
};

// Squared Sampson distance in pixels.
double SampsonPx2(const PairPoints& p, std::size_t i, const Matrix3d& F) {
  const Vector2d &a = p.a[i], &b = p.b[i];
  const Vector3d la = F * a.homogeneous();
  const double lbx = F(0, 0) * b.x() + F(1, 0) * b.y() + F(2, 0), lby = F(0, 1) * b.x() + F(1, 1) * b.y() + F(2, 1);
  const double r = b.x() * la.x() + b.y() * la.y() + la.z();
  const double g =
      (la.x() * la.x() + la.y() * la.y()) / (p.unit_b * p.unit_b) + (lbx * lbx + lby * lby) / (p.unit_a * p.unit_a);
  return g > 0 ? r * r / g : std::numeric_limits<double>::infinity();
}

double TransferPx2(const PairPoints& p, std::size_t i, const Matrix3d& H) {
  const Vector3d q = H * p.a[i].homogeneous();
  const double error = (q.head<2>() / q.z() - p.b[i]).squaredNorm() * p.unit_b * p.unit_b;
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

Eigen::Matrix<double, 1, 9> EpipolarRow(const Vector2d& a, const Vector2d& b) {
  Eigen::Matrix<double, 1, 9> r;
  r << b.x() * a.x(), b.x() * a.y(), b.x(), b.y() * a.x(), b.y() * a.y(), b.y(), a.x(), a.y(), 1;
  return r;
}

Matrix3d MatrixFromRows(const Eigen::Matrix<double, 9, 1>& f) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(f.data());
}

// Real roots of c0 + c1 x + c2 x^2 + c3 x^3.
int RealRoots(double c0, double c1, double c2, double c3, double* roots) {
  const double largest = std::max({std::abs(c0), std::abs(c1), std::abs(c2), std::abs(c3)});
  if (!(largest > 0)) return 0;
  if (std::abs(c3) < 1e-12 * largest) {
    const double d = c1 * c1 - 4 * c2 * c0;
    if (std::abs(c2) < 1e-12 * largest || d < 0) return 0;
    const double q = -0.5 * (c1 + std::copysign(std::sqrt(d), c1));
    roots[0] = q / c2;
    if (q == 0) return 1;
    roots[1] = c0 / q;
    return 2;
  }
  const double a = c2 / c3, b = c1 / c3, c = c0 / c3;
  const double Q = (a * a - 3 * b) / 9, R = (2 * a * a * a - 9 * a * b + 27 * c) / 54;
  if (R * R < Q * Q * Q) {
    const double theta = std::acos(std::clamp(R / std::sqrt(Q * Q * Q), -1.0, 1.0));
    for (int k = 0; k < 3; ++k) roots[k] = -2 * std::sqrt(Q) * std::cos((theta + 2 * (k - 1) * M_PI) / 3) - a / 3;
    return 3;
  }
  const double A = -std::copysign(std::cbrt(std::abs(R) + std::sqrt(R * R - Q * Q * Q)), R);
  roots[0] = A + (A != 0 ? Q / A : 0.0) - a / 3;
  return 1;
}

int SevenPoint(const PairPoints& p, const std::array<std::size_t, 7>& s, Matrix3d* F) {
  Eigen::Matrix<double, 9, 7> At;
  for (int i = 0; i < 7; ++i) {
    const std::size_t k = s[static_cast<std::size_t>(i)];
    At.col(i) = EpipolarRow(p.a[k], p.b[k]).transpose();
  }
  const Eigen::Matrix<double, 9, 2> null = PerpendicularColumns(At);
  const Matrix3d F0 = MatrixFromRows(null.col(0)), F1 = MatrixFromRows(null.col(1));
  const double at0 = F0.determinant(), at1 = (F0 + F1).determinant(), at_minus1 = (F0 - F1).determinant(),
               c3 = F1.determinant();
  const double c2 = (at1 + at_minus1) / 2 - at0, c1 = (at1 - at_minus1) / 2 - c3;
  double roots[3];
  const int n = RealRoots(at0, c1, c2, c3, roots);
  for (int i = 0; i < n; ++i) F[i] = (F0 + roots[i] * F1).normalized();
  return n;
}

Matrix3d FitHomography(const PairPoints& p, const std::vector<char>& use) {
  Eigen::Matrix<double, 9, 9> gram = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (!use[i]) continue;
    const Vector3d a = p.a[i].homogeneous();
    const Vector2d& b = p.b[i];
    Eigen::Matrix<double, 2, 9> r;
    r << a.transpose(), 0, 0, 0, -b.x() * a.transpose(), 0, 0, 0, a.transpose(), -b.y() * a.transpose();
    gram.noalias() += r.transpose() * r;
  }
  return MatrixFromRows(LeastDirection(gram));
}

Matrix3d FourPoint(const PairPoints& p, const std::array<std::size_t, 4>& s) {
  Eigen::Matrix<double, 9, 8> At;
  for (int i = 0; i < 4; ++i) {
    const std::size_t k = s[static_cast<std::size_t>(i)];
    const Vector3d a = p.a[k].homogeneous();
    const Vector2d& b = p.b[k];
    At.col(2 * i) << a, Vector3d::Zero(), -b.x() * a;
    At.col(2 * i + 1) << Vector3d::Zero(), a, -b.y() * a;
  }
  return MatrixFromRows(PerpendicularColumns(At));
}

// Least squares over Sampson distances by reweighting, rank 2 restored each time.
Matrix3d RefineFundamental(const PairPoints& p, Matrix3d F, double limit2) {
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix<double, 9, 9> gram = Eigen::Matrix<double, 9, 9>::Zero();
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (SampsonPx2(p, i, F) >= limit2) continue;
      const Vector3d la = F * p.a[i].homogeneous(), lb = F.transpose() * p.b[i].homogeneous();
      const double w =
          1 / (la.head<2>().squaredNorm() / (p.unit_b * p.unit_b) + lb.head<2>().squaredNorm() / (p.unit_a * p.unit_a));
      const auto r = EpipolarRow(p.a[i], p.b[i]);
      gram.noalias() += w * r.transpose() * r;
    }
    SingularValueDecomposition svd = DecomposeSingular(MatrixFromRows(LeastDirection(gram / gram.trace())));
    svd.values[2] = 0;
    const Matrix3d next = (svd.U * svd.values.asDiagonal() * svd.V.transpose()).normalized();
    if (!next.allFinite()) break;
    F = next;
  }
  return F;
}

}  // namespace

TwoView EstimateTwoView(const std::vector<Vector2d>& a, const std::vector<Vector2d>& b, double px_per_unit_a,
                        double px_per_unit_b, const TwoViewOptions& options) {
  TwoView result;
  const PairPoints p{a, b, px_per_unit_a, px_per_unit_b};
  const std::size_t n = p.size();
  result.inlier.assign(n, 0);
  if (n < kMinShared) return result;
  std::mt19937_64 random(options.seed);
  const double limit2 = options.inlier_px * options.inlier_px;

  // The homography of most points.
  const auto transfer = [&](const Matrix3d& H, std::size_t i) { return TransferPx2(p, i, H); };
  Consensus<Matrix3d, decltype(transfer)> plane(n, limit2, transfer);
  DrawModels<4>({.min_trials = 30, .max_trials = options.max_iterations / 4}, n, random, plane,
                [&](const std::array<std::size_t, 4>& sample) { return plane.Offer(FourPoint(p, sample)); });
  for (int round = 0; round < 3 && plane.InlierCount() >= kFewestInPlane; ++round)
    if (!plane.Offer(FitHomography(p, plane.Inliers()))) break;
  result.H = plane.best();

  const auto sampson = [&](const Matrix3d& F, std::size_t i) { return SampsonPx2(p, i, F); };
  Consensus<Matrix3d, decltype(sampson)> epipolar(n, limit2, sampson);
  const RansacOptions seven{.min_trials = 60, .max_trials = options.max_iterations, .sample_size = 7};
  // Plane plus parallax: two points off the plane give the epipole.
  std::vector<std::size_t> off;
  for (std::size_t i = 0; i < n; ++i)
    if (TransferPx2(p, i, result.H) >= limit2) off.push_back(i);
  if (off.size() < n - 4) {
    RansacOptions two = seven;
    two.max_trials = std::min(kMostParallaxTrials, options.max_iterations);
    DrawModels<2>(two, off.size(), random, epipolar, [&](const std::array<std::size_t, 2>& sample) {
      Vector3d line[2];
      for (std::size_t k = 0; k < 2; ++k)
        line[k] = b[off[sample[k]]].homogeneous().cross(result.H * a[off[sample[k]]].homogeneous());
      return epipolar.Offer((CrossMatrix(line[0].cross(line[1])) * result.H).normalized());
    });
  }
  DrawModels<7>(seven, n, random, epipolar, [&](const std::array<std::size_t, 7>& sample) {
    Matrix3d F[3];
    bool better = false;
    for (int k = 0, solutions = SevenPoint(p, sample, F); k < solutions; ++k) better = epipolar.Offer(F[k]) || better;
    return better;
  });
  if (!epipolar.found()) return result;
  for (const double widen : {4.0, 1.0}) epipolar.Offer(RefineFundamental(p, epipolar.best(), widen * limit2));
  result.F = epipolar.best();

  std::vector<double> to_line, to_plane;
  int count_h = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double e = SampsonPx2(p, i, result.F), h = TransferPx2(p, i, result.H);
    count_h += h < limit2;
    if (e >= limit2) continue;
    result.inlier[i] = 1;
    ++result.inlier_count;
    to_line.push_back(std::sqrt(e));
    to_plane.push_back(std::min(std::sqrt(h), 1e6));
  }
  result.noise_px = kSigmaPerMad * Quantile(to_line, 0.5);
  result.parallax_px = Quantile(to_plane, 0.8);
  const double plane_px = std::max(kPlaneFloorPx, kPlaneSigmas * result.noise_px);
  result.off_plane_count = static_cast<int>(std::ranges::count_if(to_plane, [&](double h) { return h > plane_px; }));
  if (std::max(result.inlier_count, count_h) < kMinAgreeing) return result;
  const bool parallax =
      result.off_plane_count >= kMinOffPlane && result.off_plane_count >= kMinOffPlaneShare * result.inlier_count;
  result.kind = parallax ? TwoViewKind::kGeneral : TwoViewKind::kHomography;
  if (!parallax) {
    result.inlier_count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      result.inlier[i] = TransferPx2(p, i, result.H) < limit2;
      result.inlier_count += result.inlier[i];
    }
  }
  return result;
}

Eigen::Matrix<double, 3, 4> CanonicalCamera(const Matrix3d& F) {
  const Vector3d e = DecomposeSingular(F).U.col(2);
  const Matrix3d G = CrossMatrix(e) * F;
  const Matrix3d onto = Matrix3d::Identity() - e * e.transpose();
  double s = (G.transpose() * onto).trace() / G.squaredNorm();
  // A turn of a right angle or so has no scale nearest to the identity: any will do.
  const double size = std::sqrt(2.0) / G.norm();
  if (std::abs(s) < 0.1 * size) s = std::copysign(size, s);
  Eigen::Matrix<double, 3, 4> P;
  P << s * G + e * e.transpose(), e;
  return P;
}

}  // namespace lumi
