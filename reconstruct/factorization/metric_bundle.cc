#include "reconstruct/factorization/metric_bundle.h"

#include <ceres/manifold.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Geometry>
#include <array>

#include "reconstruct/factorization/track_bundle.h"

namespace lumi {
namespace {

using PoseNumbers = std::array<double, 7>;  // quaternion x y z w, translation

// R <- exp(turn) R, t <- t + step. The cost functions give derivatives by (turn, step) in the first six columns, so the
// derivative of Plus is told to be the identity.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Map<const Eigen::Vector3d> turn(delta);
    const double half = 0.5 * turn.norm();
    const double factor = half > 1e-8 ? std::sin(half) / (2 * half) : 0.5 - half * half / 12;
    const Eigen::Quaterniond step(std::cos(half), factor * turn.x(), factor * turn.y(), factor * turn.z());
    Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
    result = (step * q).normalized();
    for (int i = 0; i < 3; ++i) x_plus_delta[4 + i] = x[4 + i] + delta[3 + i];
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
    J.setIdentity();
    return true;
  }
  // Not asked for by the solver.
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

// Pose, point, intrinsics relative to the frame's centre: fx, fy, cx, cy.
class MetricSightCost final : public ceres::SizedCostFunction<2, 7, 4, 4> {
 public:
  // x_px: relative to centre_px, so that a far origin costs no digits.
  MetricSightCost(const Eigen::Vector2d& x_px, const Eigen::Vector2d& centre_px) : x_(x_px), centre_(centre_px) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Matrix3d R = Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
    const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4);
    const Eigen::Map<const Eigen::Vector4d> X(parameters[1]), k(parameters[2]);
    const Eigen::Vector3d turned = R * X.head<3>();
    const Eigen::Vector3d q = turned + t * X.w();
    const double inverse = 1 / q.z();
    if (!std::isfinite(inverse)) return false;
    const Eigen::Vector2d y = q.head<2>() * inverse;
    for (int i = 0; i < 2; ++i) residuals[i] = k[i] * y[i] + (k[2 + i] - centre_[i]) - x_[i];
    if (!jacobians) return true;
    Eigen::Matrix<double, 2, 3> by_q;
    by_q << k[0] * inverse, 0, -k[0] * y.x() * inverse, 0, k[1] * inverse, -k[1] * y.y() * inverse;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> J(jacobians[0]);
      // d (exp(turn) v) = turn x v
      Eigen::Matrix3d cross;
      cross << 0, turned.z(), -turned.y(), -turned.z(), 0, turned.x(), turned.y(), -turned.x(), 0;
      J.leftCols<3>() = by_q * cross;
      J.middleCols<3>(3) = by_q * X.w();
      J.col(6).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> J(jacobians[1]);
      J.leftCols<3>() = by_q * R;
      J.col(3) = by_q * t;
    }
    if (jacobians[2]) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> J(jacobians[2]);
      J << y.x(), 0, 1, 0, 0, y.y(), 0, 1;
    }
    return true;
  }

 private:
  Eigen::Vector2d x_, centre_;
};

// fx and fy in their ratio, the principal point held or free.
class FocalManifold final : public ceres::Manifold {
 public:
  explicit FocalManifold(bool centre) : centre_(centre) {}
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return centre_ ? 3 : 1; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    for (int i = 0; i < 2; ++i) out[i] = x[i] * (1 + delta[0]);
    for (int i = 0; i < 2; ++i) out[2 + i] = x[2 + i] + (centre_ ? x[0] * delta[1 + i] : 0.0);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 4, Eigen::Dynamic, Eigen::RowMajor>> J(jacobian, 4, TangentSize());
    J.setZero();
    J(0, 0) = x[0];
    J(1, 0) = x[1];
    if (centre_) J(2, 1) = J(3, 2) = x[0];
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  bool centre_;
};

constexpr std::size_t kDenseMetricCameras = 60;

}  // namespace

BundleSummary AdjustMetric(const ImagePoints& points, const ProjectiveModel& used, MetricModel& model,
                           FreeIntrinsics free, const BundleOptions& options) {
  BundleSummary result;
  const auto rms = [&] {
    ProjectiveModel p = used;
    ToProjective(points, model, p);
    return RmsPx(points, p);
  };
  result.start_rms_px = result.rms_px = rms();
  std::vector<PoseNumbers> pose(model.cam_from_world.size());
  for (std::size_t f = 0; f < pose.size(); ++f) {
    const Rigid3& m = model.cam_from_world[f];
    const Eigen::Quaterniond q = m.rotation.normalized();
    pose[f] = {q.x(), q.y(), q.z(), q.w(), m.translation.x(), m.translation.y(), m.translation.z()};
  }
  std::vector<Eigen::Vector4d> X = model.X;
  Eigen::Vector4d k = model.intrinsics_px;

  PoseManifold pose_manifold;
  FocalManifold focal(free == FreeIntrinsics::kFocalAndCentre);
  TrackBundle bundle(points, used, options);
  std::size_t cameras = 0;
  for (std::size_t f = 0; f < pose.size(); ++f)
    if (used.placed[f]) bundle.AddCamera(pose[f].data(), 7, &pose_manifold, cameras++ == 0);
  bundle.AddCamera(k.data(), 4, &focal, free == FreeIntrinsics::kNone);
  bundle.AddPoints(model.X, X, [&](auto& problem, auto* loss, const Sight& sight, std::size_t f, double* point) {
    problem.AddResidualBlock(new MetricSightCost(sight.x * points.px_per_unit[f], points.centre_px[f]), loss,
                             pose[f].data(), point, k.data());
  });
  if (!bundle.Solve(cameras > kDenseMetricCameras, result) || !k.allFinite()) return result;
  for (std::size_t f = 0; f < pose.size(); ++f) {
    if (!used.placed[f]) continue;
    model.cam_from_world[f] = {Eigen::Quaterniond(pose[f][3], pose[f][0], pose[f][1], pose[f][2]).normalized(),
                               Eigen::Vector3d(pose[f][4], pose[f][5], pose[f][6])};
  }
  for (std::size_t t = 0; t < X.size(); ++t)
    if (used.solved[t]) model.X[t] = X[t].normalized();
  model.intrinsics_px = k;
  result.usable = true;
  result.converged = bundle.converged();
  result.rms_px = rms();
  return result;
}

void ToProjective(const ImagePoints& points, const MetricModel& metric, ProjectiveModel& model) {
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    if (!model.placed[f]) continue;
    const double s = 1 / points.px_per_unit[f];
    Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
    for (int i = 0; i < 2; ++i) {
      K(i, i) = metric.intrinsics_px[i] * s;
      K(i, 2) = (metric.intrinsics_px[2 + i] - points.centre_px[f][i]) * s;
    }
    model.P[f] = ProjectionMatrix(K, metric.cam_from_world[f]).normalized();
  }
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    if (!model.solved[t]) continue;
    model.X[t] = metric.X[t].normalized();
    int front = 0;
    for (std::size_t i = 0; i < points.tracks[t].size(); ++i) {
      const auto f = static_cast<std::size_t>(points.tracks[t][i].frame);
      if (model.placed[f] && model.inlier[t][i]) front += model.P[f].row(2).dot(model.X[t]) > 0 ? 1 : -1;
    }
    if (front < 0) model.X[t] = -model.X[t];
  }
}

}  // namespace lumi
