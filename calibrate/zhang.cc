#include "calibrate/zhang.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

// Singular values below this share of the largest count as zero: far above rounding, far below the weakest usable
// geometry.
constexpr double kRankTolerance = 1e-9;

// Moves points to mean 0 and mean distance sqrt 2 (Hartley).
std::optional<Eigen::Matrix3d> Normalisation(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double distance = 0;
  for (const auto& p : points) distance += (p - mean).norm();
  distance /= static_cast<double>(points.size());
  if (!(distance > 0) || !std::isfinite(distance)) return std::nullopt;
  const double s = std::sqrt(2.0) / distance;
  Eigen::Matrix3d T;
  T << s, 0, -s * mean.x(), 0, s, -s * mean.y(), 0, 0, 1;
  return T;
}

// h_i^T B h_j as a row over (B11, B12, B22, B13, B23, B33).
Eigen::Matrix<double, 1, 6> Row(const Eigen::Matrix3d& H, int i, int j) {
  Eigen::Matrix<double, 1, 6> v;
  v << H(0, i) * H(0, j), H(0, i) * H(1, j) + H(1, i) * H(0, j), H(1, i) * H(1, j),
      H(2, i) * H(0, j) + H(0, i) * H(2, j), H(2, i) * H(1, j) + H(1, i) * H(2, j), H(2, i) * H(2, j);
  return v;
}

}  // namespace

std::optional<Eigen::Matrix3d> PlaneHomography(const std::vector<Eigen::Vector2d>& on_plane,
                                               const std::vector<Eigen::Vector2d>& pixels) {
  if (on_plane.size() != pixels.size() || on_plane.size() < 4) return std::nullopt;
  const auto A = Normalisation(on_plane), B = Normalisation(pixels);
  if (!A || !B) return std::nullopt;
  Eigen::MatrixXd M(2 * static_cast<Eigen::Index>(on_plane.size()), 9);
  for (std::size_t i = 0; i < on_plane.size(); ++i) {
    const Eigen::Vector3d X = *A * on_plane[i].homogeneous(), x = *B * pixels[i].homogeneous();
    const auto r = 2 * static_cast<Eigen::Index>(i);
    M.row(r) << X.transpose(), 0, 0, 0, -x.x() * X.transpose();
    M.row(r + 1) << 0, 0, 0, X.transpose(), -x.y() * X.transpose();
  }
  const SingularValueDecomposition svd = DecomposeSingular(M);
  if (!(svd.values[7] > kRankTolerance * svd.values[0])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = svd.V.col(8);
  Eigen::Matrix3d H;
  H << h.head<3>().transpose(), h.segment<3>(3).transpose(), h.tail<3>().transpose();
  if (!(std::abs(H.determinant()) > kRankTolerance)) return std::nullopt;  // onto a line
  H = B->inverse() * H * *A;
  H /= H.norm();
  double w = 0;
  for (const auto& p : on_plane) w += H.row(2).dot(p.homogeneous());
  if (w < 0) H = -H;
  return H.allFinite() ? std::optional(H) : std::nullopt;
}

std::optional<Eigen::Matrix3d> ClosedFormCalibration(const std::vector<Eigen::Matrix3d>& homographies, bool with_skew,
                                                     int width_px, int height_px) {
  if (homographies.size() < (with_skew ? 3U : 2U)) return std::nullopt;
  // Pixels moved to about [-1, 1]: B's entries come to one size.
  const double s = 2.0 / (width_px + height_px);
  Eigen::Matrix3d N;
  N << s, 0, -s * width_px / 2, 0, s, -s * height_px / 2, 0, 0, 1;
  const auto extra = with_skew ? 0 : 1;
  Eigen::MatrixXd V(2 * static_cast<Eigen::Index>(homographies.size()) + extra, 6);
  for (std::size_t i = 0; i < homographies.size(); ++i) {
    Eigen::Matrix3d H = N * homographies[i];
    H /= std::sqrt(H.col(0).norm() * H.col(1).norm());
    V.row(2 * static_cast<Eigen::Index>(i)) = Row(H, 0, 1);
    V.row(2 * static_cast<Eigen::Index>(i) + 1) = Row(H, 0, 0) - Row(H, 1, 1);
  }
  if (!with_skew) V.bottomRows<1>() << 0, static_cast<double>(homographies.size()), 0, 0, 0, 0;
  const SingularValueDecomposition svd = DecomposeSingular(V);
  if (!(svd.values[4] > kRankTolerance * svd.values[0])) return std::nullopt;
  Eigen::Matrix<double, 6, 1> b = svd.V.col(5);
  if (b[0] < 0) b = -b;
  // B = lambda K^-T K^-1 (Zhang, appendix B).
  const double B11 = b[0], B12 = b[1], B22 = b[2], B13 = b[3], B23 = b[4], B33 = b[5];
  const double d = B11 * B22 - B12 * B12;
  if (!(B11 > 0) || !(d > 0)) return std::nullopt;
  const double v0 = (B12 * B13 - B11 * B23) / d;
  const double lambda = B33 - (B13 * B13 + v0 * (B12 * B13 - B11 * B23)) / B11;
  if (!(lambda > 0)) return std::nullopt;
  const double alpha = std::sqrt(lambda / B11), beta = std::sqrt(lambda * B11 / d);
  const double gamma = -B12 * alpha * alpha * beta / lambda;
  const double u0 = gamma * v0 / beta - B13 * alpha * alpha / lambda;
  Eigen::Matrix3d K;
  K << alpha, gamma, u0, 0, beta, v0, 0, 0, 1;
  K = N.inverse() * K;
  return K.allFinite() ? std::optional(K) : std::nullopt;
}

std::optional<Rigid3> PoseFromHomography(const Eigen::Matrix3d& K, const Eigen::Matrix3d& H) {
  const Eigen::Matrix3d M = K.inverse() * H;
  const double scale = std::sqrt(M.col(0).norm() * M.col(1).norm());
  if (!(scale > 0) || !std::isfinite(scale)) return std::nullopt;
  const Eigen::Vector3d a = M.col(0) / scale, b = M.col(1) / scale;
  Eigen::Vector3d t = M.col(2) / scale;
  Eigen::Matrix3d R;
  R << a, b, a.cross(b);
  const SingularValueDecomposition svd = DecomposeSingular(R);
  R = svd.U * svd.V.transpose();
  if (!R.allFinite() || R.determinant() <= 0) return std::nullopt;
  return Rigid3{Eigen::Quaterniond(R).normalized(), t};
}

}  // namespace lumi
