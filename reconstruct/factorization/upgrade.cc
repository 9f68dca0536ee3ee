#include "reconstruct/factorization/upgrade.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "reconstruct/factorization/normalise.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/levenberg_marquardt.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

struct Canonical {
  Matrix4d G;  // P^ G = [A | a]; the reference is [I | 0]
  std::vector<Matrix3d> A;
  std::vector<Vector3d> a;
  std::vector<std::size_t> frame;
};

// Cameras beside a reference in the middle of the placed ones; the free scale of a such that its median size is 1.
std::optional<Canonical> MakeCanonical(const std::vector<Matrix34d>& P, const std::vector<char>& placed) {
  std::vector<std::size_t> frames;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (placed[f]) frames.push_back(f);
  if (frames.size() < 2) return std::nullopt;
  const std::size_t reference = frames[frames.size() / 2];
  const Matrix34d& R = P[reference];
  Matrix4d augmented;
  augmented << R / R.norm(), CentreOfProjection(R).transpose();
  const auto inverse = InverseOf(augmented);
  if (!inverse) return std::nullopt;
  Canonical c;
  c.G = *inverse;
  std::vector<double> size;
  for (const std::size_t f : frames) {
    Matrix34d Q = P[f] * c.G;
    const double n = Q.leftCols<3>().norm();
    if (!(n > 0)) return std::nullopt;
    Q *= std::sqrt(3.0) / n;
    c.A.push_back(Q.leftCols<3>());
    c.a.push_back(Q.col(3));
    c.frame.push_back(f);
    if (f != reference) size.push_back(Q.col(3).norm());
  }
  const double unit = Median(std::move(size));
  if (!(unit > 1e-14)) return std::nullopt;
  for (auto& a : c.a) a /= unit;
  c.G.col(3) /= unit;
  return c;
}

using Vector6d = Eigen::Matrix<double, 6, 1>;

// PlaneDeviation of M M^T from a multiple of the identity, a vector of the same norm (over sqrt 3).
Vector6d PlaneDeviation(const Matrix3d& A, const Vector3d& a, const Vector3d& p) {
  const Matrix3d M = A - a * p.transpose();
  Matrix3d S = M * M.transpose();
  const double mean = S.trace() / 3;
  S = mean > 0 ? Matrix3d(S / mean - Matrix3d::Identity()) : Matrix3d(Matrix3d::Constant(1e3));
  const double r = std::sqrt(2.0);
  return Vector6d(S(0, 0), S(1, 1), S(2, 2), r * S(0, 1), r * S(0, 2), r * S(1, 2)) / std::sqrt(3.0);
}

double PlaneCost(const Canonical& c, const Vector3d& p) {
  double sum = 0;
  for (std::size_t i = 0; i < c.A.size(); ++i) {
    const double e = PlaneDeviation(c.A[i], c.a[i], p).squaredNorm();
    sum += e / (1 + e);  // a camera that is off altogether counts no more than 1
  }
  return sum / static_cast<double>(c.A.size());
}

// Shape (6 cameras, 3): the deviations' derivatives.
Eigen::MatrixXd PlaneDerivative(const Canonical& c, const Vector3d& p, Eigen::VectorXd* residual) {
  const auto n = static_cast<Eigen::Index>(c.A.size());
  Eigen::MatrixXd J(6 * n, 3);
  if (residual) residual->resize(6 * n);
  const double h = 1e-6 * (1 + p.norm());
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    for (int d = 0; d < 3; ++d) {
      const Vector3d step = h * Vector3d::Unit(d);
      J.block<6, 1>(6 * i, d) =
          (PlaneDeviation(c.A[k], c.a[k], p + step) - PlaneDeviation(c.A[k], c.a[k], p - step)) / (2 * h);
    }
    if (residual) residual->segment<6>(6 * i) = PlaneDeviation(c.A[k], c.a[k], p);
  }
  return J;
}

// Moves p to the least cost, and returns that cost.
double RefinePlane(const Canonical& c, Vector3d& p) {
  const auto cost = [&](const Vector3d& q, NormalEquations<3>* normal) {
    if (normal) {
      Eigen::VectorXd r;
      const Eigen::MatrixXd J = PlaneDerivative(c, q, &r);
      for (Eigen::Index i = 0; i < r.size(); i += 6) {
        const Vector6d rest = r.segment<6>(i);
        normal->Add(J.middleRows<6>(i), rest, std::pow(1 + rest.squaredNorm(), -2));  // the slope of e / (1 + e)
      }
    }
    return PlaneCost(c, q);
  };
  return MinimiseSquares<3>(
             {.max_iterations = 40, .max_attempts = 6, .tolerance = 1e-12, .damping = 1e-4, .damping_rise = 10}, cost,
             p)
      .cost;
}

// The dual absolute quadric of [I | 0]'s frame is [I q; q^T rho], q = -p; each camera's image of it is a multiple of
// the identity: five linear equations in q and rho.
Vector3d FromQuadric(const Canonical& c) {
  Vector4d x = Vector4d::Zero();
  for (int round = 0; round < 3; ++round) {
    Matrix4d normal = Matrix4d::Zero();
    Vector4d rhs = Vector4d::Zero();
    for (std::size_t i = 0; i < c.A.size(); ++i) {
      const Matrix3d &A = c.A[i], constant = A * A.transpose();
      const Vector3d& a = c.a[i];
      Matrix3d by[4];
      for (int k = 0; k < 3; ++k) by[k] = a * A.col(k).transpose() + A.col(k) * a.transpose();
      by[3] = a * a.transpose();
      Matrix3d now = constant;
      for (int k = 0; k < 4; ++k) now += x[k] * by[k];
      const double weight = 1 / std::max(1e-12, std::abs(now.trace()));
      const auto add = [&](auto&& pick) {
        const Vector4d row = weight * Vector4d(pick(by[0]), pick(by[1]), pick(by[2]), pick(by[3]));
        normal += row * row.transpose();
        rhs -= row * (weight * pick(constant));
      };
      add([](const Matrix3d& m) { return m(0, 0) - m(1, 1); });
      add([](const Matrix3d& m) { return m(0, 0) - m(2, 2); });
      add([](const Matrix3d& m) { return 2 * m(0, 1); });
      add([](const Matrix3d& m) { return 2 * m(0, 2); });
      add([](const Matrix3d& m) { return 2 * m(1, 2); });
    }
    const Vector4d next = SolveLeastNorm(normal, rhs);
    if (!next.allFinite()) break;
    x = next;
  }
  return -x.head<3>();
}

// The two rotations of the essential matrix [a] A, and for each the p nearest to A - a p^T = s R.
void FromEssential(const Matrix3d& A, const Vector3d& a, std::vector<Vector3d>& starts) {
  const SingularValueDecomposition svd = DecomposeSingular(CrossMatrix(a) * A);
  Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  for (const Matrix3d& turn : {W, Matrix3d(W.transpose())}) {
    Matrix3d R = svd.U * turn * svd.V.transpose();
    if (R.determinant() < 0) R = -R;
    // Across a: s R' = A'; along a: p = (A - s R)^T a / a.a.
    const Matrix3d across = Matrix3d::Identity() - a * a.transpose() / a.squaredNorm();
    const double s = (across * A).cwiseProduct(across * R).sum() / (across * R).squaredNorm();
    const Vector3d p = (A - s * R).transpose() * a / a.squaredNorm();
    if (p.allFinite()) starts.push_back(p);
  }
}

}  // namespace

Upgrade UpgradeToEuclidean(const ImagePoints& points, const ProjectiveModel& model,
                           const std::vector<Matrix3d>& K_normalised) {
  Upgrade result;
  std::vector<Matrix34d> P = model.P;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (model.placed[f]) P[f] = (K_normalised[f].inverse() * P[f]).eval().normalized();
  const auto canonical = MakeCanonical(P, model.placed);
  if (!canonical) return result;
  const Canonical& c = *canonical;
  for (std::size_t i = 0; i < c.A.size(); ++i)
    if (!c.A[i].allFinite() || !c.a[i].allFinite()) return result;

  std::vector<Vector3d> starts{FromQuadric(c), Vector3d::Zero()};
  std::vector<std::size_t> by_baseline(c.a.size());
  for (std::size_t i = 0; i < by_baseline.size(); ++i) by_baseline[i] = i;
  std::ranges::sort(by_baseline, [&](std::size_t i, std::size_t j) { return c.a[i].norm() > c.a[j].norm(); });
  for (std::size_t k = 0; k < 6; ++k) {
    const std::size_t i = by_baseline[k * (by_baseline.size() - 1) / 6];
    if (c.a[i].norm() > 1e-6) FromEssential(c.A[i], c.a[i], starts);
  }

  struct Found {
    Vector3d p;
    double cost;
  };
  std::vector<Found> found;
  for (Vector3d& p : starts) {
    const double cost = RefinePlane(c, p);
    if (!std::isfinite(cost)) continue;
    const bool known =
        std::ranges::any_of(found, [&](const Found& f) { return (f.p - p).norm() < 1e-6 * (1 + p.norm()); });
    if (!known) found.push_back({p, cost});
  }
  if (found.empty()) return result;
  double least = std::numeric_limits<double>::infinity();
  for (const Found& f : found) least = std::min(least, f.cost);

  double median_depth = 0;
  Vector3d best_p = Vector3d::Zero();
  for (const Found& f : found) {
    if (f.cost > 2 * least + 1e-10) continue;
    std::vector<Rigid3> pose(P.size());
    for (std::size_t i = 0; i < c.A.size(); ++i) {
      Matrix3d M = c.A[i] - c.a[i] * f.p.transpose();
      const double s = std::cbrt(M.determinant());
      if (!(std::abs(s) > 1e-12)) continue;
      M /= s;
      pose[c.frame[i]] = {Eigen::Quaterniond(NearestRotation(M)).normalized(), c.a[i] / s};
    }
    Matrix4d to = Matrix4d::Identity();
    to.bottomLeftCorner<1, 3>() = -f.p.transpose();
    const Matrix4d H = c.G * to;
    const auto inverse = InverseOf(H);
    if (!inverse) continue;
    const Matrix4d back = *inverse;
    long front = 0, behind = 0;
    std::vector<double> depths;
    for (std::size_t t = 0; t < model.X.size(); ++t) {
      if (!model.solved[t]) continue;
      const Vector4d X = back * model.X[t];
      for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
        const auto frame = static_cast<std::size_t>(points.tracks[t][k].frame);
        if (!model.placed[frame] || !model.inlier[t][k]) continue;
        const double z = (pose[frame].R().row(2) * X.head<3>() + pose[frame].translation.row(2) * X.w())(0) / X.w();
        ++(z > 0 ? front : behind);
        depths.push_back(std::abs(z));
      }
    }
    // The fourth coordinate's sign is free: baselines reverse, and with them front and back.
    const bool reverse = behind > front;
    const double share =
        front + behind > 0 ? static_cast<double>(std::max(front, behind)) / static_cast<double>(front + behind) : 0.0;
    if (result.found && share <= result.front_share) continue;
    result.found = true;
    result.front_share = share;
    result.H = H;
    if (reverse) {
      result.H.col(3) = -result.H.col(3).eval();
      for (Rigid3& t : pose) t.translation = -t.translation;
    }
    result.cam_from_world = pose;
    best_p = f.p;
    if (!depths.empty()) median_depth = Median(std::move(depths));
  }
  Eigen::VectorXd r;
  const Eigen::MatrixXd J = PlaneDerivative(c, best_p, &r);
  const Eigen::VectorXd singular = SingularValues(J);
  const double largest = singular[0], smallest = singular[2];
  const double n = static_cast<double>(c.A.size());
  result.residual = std::sqrt(r.squaredNorm() / n);
  result.condition = smallest > 0 ? largest / smallest : std::numeric_limits<double>::infinity();
  // Five independent deviations a camera, three unknowns.
  const double noise = std::sqrt(r.squaredNorm() / std::max(1.0, 5 * (n - 1) - 3));
  result.plane_sigma = smallest > 0 ? noise / smallest * median_depth : std::numeric_limits<double>::infinity();
  return result;
}

double DeviationFromConstantOrientation(const ImagePoints& points, const ProjectiveModel& model) {
  std::vector<Matrix34d> P = model.P;
  std::size_t first = P.size();
  for (std::size_t f = 0; f < P.size(); ++f) {
    if (!model.placed[f]) continue;
    if (first == P.size()) first = f;
    // The first frame's normalisation for all.
    P[f] = (NormalisedFromPixels(points, first) * NormalisedFromPixels(points, f).inverse() * P[f]).eval().normalized();
  }
  const auto canonical = MakeCanonical(P, model.placed);
  if (!canonical) return 0;
  // A_i = s_i I + a_i p^T, linear in s_i and p: s_i is eliminated, then p found, then the residual.
  const Canonical& c = *canonical;
  Matrix3d normal = Matrix3d::Zero();
  Vector3d rhs = Vector3d::Zero();
  for (std::size_t i = 0; i < c.A.size(); ++i)
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 3; ++k) {
        // Row (r, k) of A - a p^T, the mean of its diagonal taken away.
        Vector3d by = c.a[i][r] * Vector3d::Unit(k);
        double value = c.A[i](r, k);
        if (r == k) {
          by -= c.a[i] / 3;
          value -= c.A[i].trace() / 3;
        }
        normal += by * by.transpose();
        rhs += by * value;
      }
  const Vector3d p = SolveLeastNorm(normal, rhs);
  double sum = 0;
  for (std::size_t i = 0; i < c.A.size(); ++i) {
    const Matrix3d M = c.A[i] - c.a[i] * p.transpose();
    const double size = M.squaredNorm();
    sum += (M - M.trace() / 3 * Matrix3d::Identity()).squaredNorm() / std::max(size, 1e-300);
  }
  return std::sqrt(sum / static_cast<double>(c.A.size()));
}

}  // namespace lumi
