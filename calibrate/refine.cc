#include "calibrate/refine.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <limits>

#include "scene/geometry/dense_solvers.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Free terms whose information, each scaled to 1, has an eigenvalue below this are not determined: 1e-8 in standard
// deviation, a loss of half of double precision's digits.
constexpr double kDeterminedTolerance = 1e-13;
using PoseNumbers = std::array<double, 6>;  // rotation vector, translation

// x_px - projection of a corner.
struct CornerResidual {
  Eigen::Vector2d on_board, pixel;

  template <typename T>
  bool operator()(const T* intrinsics, const T* pose, T* residual) const {
    const T on[3] = {T(on_board.x()), T(on_board.y()), T(0)};
    T x[3];
    ceres::AngleAxisRotatePoint(pose, on, x);
    const T z = x[2] + pose[5];
    if (!(z > 1e-9)) return false;
    T p[2];
    ProjectNormalized(intrinsics, T((x[0] + pose[3]) / z), T((x[1] + pose[4]) / z), p);
    residual[0] = p[0] - pixel.x();
    residual[1] = p[1] - pixel.y();
    return true;
  }
};
using CornerCost = ceres::AutoDiffCostFunction<CornerResidual, 2, kTermCount, 6>;

PoseNumbers ToNumbers(const Rigid3& pose) {
  PoseNumbers n{};
  const Eigen::Quaterniond& q = pose.rotation;
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  ceres::QuaternionToAngleAxis(wxyz, n.data());
  Eigen::Map<Eigen::Vector3d>(n.data() + 3) = pose.translation;
  return n;
}

Rigid3 FromNumbers(const PoseNumbers& n) {
  double wxyz[4];
  ceres::AngleAxisToQuaternion(n.data(), wxyz);
  return {Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized(),
          Eigen::Map<const Eigen::Vector3d>(n.data() + 3)};
}

ceres::LossFunction* Loss(double scale_px) { return scale_px > 0 ? new ceres::CauchyLoss(scale_px) : nullptr; }

ceres::Solver::Options SolverOptions(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-11;
  options.num_threads = 1;  // callers fit several at once
  options.logging_type = ceres::SILENT;
  return options;
}

// Information of the free terms about noise of 1 px, poses eliminated (Schur complement); nullopt behind a camera.
std::optional<Eigen::MatrixXd> Information(const Board& board, const std::vector<BoardView>& views,
                                           const std::vector<int>& free, const Intrinsics& intrinsics,
                                           const std::vector<PoseNumbers>& poses) {
  const auto on_board = board.Corners();
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t v = 0; v < views.size(); ++v) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n), B = Eigen::MatrixXd::Zero(n, 6);
    Eigen::Matrix<double, 6, 6> C = Eigen::Matrix<double, 6, 6>::Zero();
    for (std::size_t i = 0; i < on_board.size(); ++i) {
      if (!views[v].Used(i)) continue;
      const CornerCost cost(new CornerResidual{on_board[i], views[v].corners_px[i]});
      Eigen::Vector2d residual;
      Eigen::Matrix<double, 2, kTermCount, Eigen::RowMajor> by_term;
      Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_pose;
      const double* parameters[2] = {intrinsics.data(), poses[v].data()};
      double* jacobians[2] = {by_term.data(), by_pose.data()};
      if (!cost.Evaluate(parameters, residual.data(), jacobians)) return std::nullopt;
      Eigen::MatrixXd J(2, n);
      for (Eigen::Index k = 0; k < n; ++k) J.col(k) = by_term.col(free[static_cast<std::size_t>(k)]);
      A.noalias() += J.transpose() * J;
      B.noalias() += J.transpose() * by_pose;
      C.noalias() += by_pose.transpose() * by_pose;
    }
    information += A - B * SolveSymmetric(C, B.transpose());
  }
  return information;
}

// false where a free term is not determined.
bool SetCovariance(const std::vector<int>& free, const Eigen::MatrixXd& information, TermMatrix& covariance) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(0).cwiseSqrt();
  if (!information.allFinite() || !(scale.minCoeff() > 0)) return false;
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
  const SymmetricEigen eigen = EigenOfSymmetric(scaled);
  if (!(eigen.values.minCoeff() > kDeterminedTolerance)) return false;
  const Eigen::MatrixXd inverse = eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  for (std::size_t i = 0; i < free.size(); ++i)
    for (std::size_t j = 0; j < free.size(); ++j) {
      const auto r = static_cast<Eigen::Index>(i), c = static_cast<Eigen::Index>(j);
      covariance(free[i], free[j]) = inverse(r, c) / (scale[r] * scale[c]);
    }
  return true;
}

}  // namespace

double Calibration::SigmaFy(double noise) const {
  // d fy = aspect d fx + fx d aspect
  const double a = intrinsics[kAspect], f = intrinsics[kFx];
  const double variance = a * a * unit_covariance(kFx, kFx) + 2 * a * f * unit_covariance(kFx, kAspect) +
                          f * f * unit_covariance(kAspect, kAspect);
  return noise * std::sqrt(std::max(0.0, variance));
}

std::vector<double> CornerErrors(const Board& board, const BoardView& view, const Intrinsics& intrinsics,
                                 const Rigid3& cam_from_board) {
  std::vector<double> errors;
  const auto on_board = board.Corners();
  for (std::size_t i = 0; i < on_board.size(); ++i) {
    const Eigen::Vector3d x = cam_from_board * Eigen::Vector3d(on_board[i].x(), on_board[i].y(), 0);
    errors.push_back(x.z() > 0 ? (ProjectNormalized(intrinsics, x.hnormalized()) - view.corners_px[i]).norm()
                               : std::numeric_limits<double>::infinity());
  }
  return errors;
}

Calibration Refine(const Board& board, const std::vector<BoardView>& views, const RefineOptions& options,
                   const CalibrationStart& start) {
  const Stopwatch watch;
  Calibration result;
  result.model = options.model;
  result.intrinsics = start.intrinsics;
  std::vector<PoseNumbers> poses;
  for (const Rigid3& pose : start.cam_from_board) poses.push_back(ToNumbers(pose));
  const auto on_board = board.Corners();
  const auto finish = [&]() -> Calibration& {
    result.seconds = watch.Seconds();
    return result;
  };

  std::vector<int> free, held;
  for (int term = 0; term < kTermCount; ++term)
    (options.model.free[static_cast<std::size_t>(term)] ? free : held).push_back(term);
  ceres::Problem problem;
  ceres::LossFunction* loss = Loss(options.robust_scale_px);
  long residuals = 0;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < on_board.size(); ++i) {
      if (!views[v].Used(i)) continue;
      problem.AddResidualBlock(new CornerCost(new CornerResidual{on_board[i], views[v].corners_px[i]}), loss,
                               result.intrinsics.data(), poses[v].data());
      residuals += 2;
    }
  const long freedom = residuals - static_cast<long>(free.size() + 6 * views.size());
  if (views.empty() || freedom <= 0) {
    result.why = "fewer corners than unknowns";
    if (residuals == 0 && loss != nullptr) delete loss;
    return finish();
  }
  if (!held.empty()) problem.SetManifold(result.intrinsics.data(), new ceres::SubsetManifold(kTermCount, held));
  ceres::Solver::Options solver = SolverOptions(options.max_iterations);
  solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseNumbers& pose : poses) solver.linear_solver_ordering->AddElementToGroup(pose.data(), 0);
  solver.linear_solver_ordering->AddElementToGroup(result.intrinsics.data(), 1);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);

  double sum = 0;
  long count = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    result.cam_from_board.push_back(FromNumbers(poses[v]));
    const auto errors = CornerErrors(board, views[v], result.intrinsics, result.cam_from_board[v]);
    double view_sum = 0;
    long view_count = 0;
    for (std::size_t i = 0; i < errors.size(); ++i)
      if (views[v].Used(i)) view_sum += errors[i] * errors[i], ++view_count;
    result.view_rms_px.push_back(view_count > 0 ? std::sqrt(view_sum / static_cast<double>(view_count)) : 0);
    sum += view_sum;
    count += view_count;
  }
  result.rms_px = std::sqrt(sum / static_cast<double>(count));
  result.noise_px = std::sqrt(sum / static_cast<double>(freedom));
  const auto information = Information(board, views, free, result.intrinsics, poses);
  if (!summary.IsSolutionUsable() || !result.intrinsics.allFinite() || !std::isfinite(result.rms_px) || !information)
    result.why = "the refinement failed";
  else if (!(result.intrinsics[kFx] > 0) || !(result.intrinsics[kAspect] > 0))
    result.why = "the focal length came out negative";
  else if (!SetCovariance(free, *information, result.unit_covariance))
    result.why = "the views do not determine all terms";
  else if (summary.termination_type != ceres::CONVERGENCE)
    result.why = "the refinement did not converge";
  else
    result.usable = true;
  return finish();
}

Rigid3 RefinePose(const Board& board, const BoardView& view, const Intrinsics& intrinsics, const Rigid3& start,
                  double robust_scale_px) {
  PoseNumbers pose = ToNumbers(start);
  Intrinsics held = intrinsics;
  const auto on_board = board.Corners();
  ceres::Problem problem;
  ceres::LossFunction* loss = Loss(robust_scale_px);
  problem.AddParameterBlock(held.data(), kTermCount);
  problem.AddParameterBlock(pose.data(), 6);
  problem.SetParameterBlockConstant(held.data());
  bool any = false;
  for (std::size_t i = 0; i < on_board.size(); ++i)
    if (view.Used(i)) {
      problem.AddResidualBlock(new CornerCost(new CornerResidual{on_board[i], view.corners_px[i]}), loss, held.data(),
                               pose.data());
      any = true;
    }
  if (!any) {
    delete loss;
    return start;
  }
  ceres::Solver::Options solver = SolverOptions(60);
  solver.linear_solver_type = ceres::DENSE_QR;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.IsSolutionUsable() ? FromNumbers(pose) : start;
}

}  // namespace lumi
