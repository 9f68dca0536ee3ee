#include "stabilize/path_problem.h"

#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "scene/program/interrupt.h"

namespace lumi {
namespace {

using RowMajor34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Jacobian = Eigen::Matrix<double, 2, 12, Eigen::RowMajor>;

// y = P X, and by P. False where the point does not lie in front.
bool Image(const double* p, const Eigen::Vector4d& X, Eigen::Vector2d& y, Jacobian* J) {
  const Eigen::Map<const RowMajor34d> P(p);
  const Eigen::Vector3d q = P * X;
  if (!(q.z() > 1e-9)) return false;
  y = q.head<2>() / q.z();
  if (J) {
    J->setZero();
    const Eigen::RowVector4d x = X.transpose() / q.z();
    for (int r = 0; r < 2; ++r) {
      J->block<1, 4>(r, 4 * r) = x;
      J->block<1, 4>(r, 8) = -y[r] * x;
    }
  }
  return true;
}

class TargetCost final : public ceres::SizedCostFunction<2, 12> {
 public:
  TargetCost(const WantedPoint& point, double weight) : point_(point), root_(std::sqrt(weight)) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Vector2d y;
    Jacobian J;
    if (!Image(parameters[0], point_.X, y, jacobians ? &J : nullptr)) return false;
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = root_ * (y - point_.y);
    if (jacobians && jacobians[0]) Eigen::Map<Jacobian>(jacobians[0], 2, 12) = root_ * J;
    return true;
  }

 private:
  WantedPoint point_;
  double root_;
};

class ParallaxCost final : public ceres::SizedCostFunction<2, 12> {
 public:
  ParallaxCost(const Eigen::Vector4d& X, const Eigen::Vector4d& Z, double weight)
      : X_(X), Z_(Z), root_(std::sqrt(weight)) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Vector2d x, z;
    Jacobian of_x, of_z;
    const bool wanted = jacobians && jacobians[0];
    if (!Image(parameters[0], X_, x, wanted ? &of_x : nullptr) ||
        !Image(parameters[0], Z_, z, wanted ? &of_z : nullptr))
      return false;
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = root_ * (x - z);
    if (wanted) Eigen::Map<Jacobian>(jacobians[0], 2, 12) = root_ * (of_x - of_z);
    return true;
  }

 private:
  Eigen::Vector4d X_, Z_;
  double root_;
};

// y - (filmed + (a, -b; b, a) filmed + t), the similarity (a, b, t) free.
class AlikeCost final : public ceres::SizedCostFunction<2, 12, 4> {
 public:
  AlikeCost(const WantedPoint& point, double weight) : point_(point), root_(std::sqrt(weight)) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Vector2d y;
    Jacobian J;
    if (!Image(parameters[0], point_.X, y, jacobians && jacobians[0] ? &J : nullptr)) return false;
    const Eigen::Map<const Eigen::Vector4d> s(parameters[1]);
    const Eigen::Vector2d q = point_.filmed, across(-q.y(), q.x());
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = root_ * (y - q - s[0] * q - s[1] * across - s.tail<2>());
    if (jacobians && jacobians[0]) Eigen::Map<Jacobian>(jacobians[0], 2, 12) = root_ * J;
    if (jacobians && jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> by(jacobians[1]);
      by << -root_ * q, -root_ * across, -root_ * Eigen::Matrix2d::Identity();
    }
    return true;
  }

 private:
  WantedPoint point_;
  double root_;
};

class BendCost final : public ceres::SizedCostFunction<2, 12, 12, 12> {
 public:
  BendCost(const Eigen::Vector4d& X, const std::array<double, 3>& factor, const Eigen::Vector2d& bend, double weight)
      : X_(X), factor_(factor), bend_(bend), root_(std::sqrt(weight)) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Vector2d sum = -bend_;
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector2d y;
      Jacobian J;
      const bool wanted = jacobians && jacobians[i];
      if (!Image(parameters[i], X_, y, wanted ? &J : nullptr)) return false;
      sum += factor_[static_cast<std::size_t>(i)] * y;
      if (wanted) Eigen::Map<Jacobian>(jacobians[i], 2, 12) = root_ * factor_[static_cast<std::size_t>(i)] * J;
    }
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = root_ * sum;
    return true;
  }

 private:
  Eigen::Vector4d X_;
  std::array<double, 3> factor_;
  Eigen::Vector2d bend_;
  double root_;
};

// The largest trust region, which leaves a little damping: nothing else holds the directions of P' that no point
// determines.
constexpr double kMostTrust = 1e10;

}  // namespace

double SmoothnessOf(double cutoff_hz, double fps) {
  const double w = std::min(2 * std::numbers::pi * cutoff_hz / fps, std::numbers::pi);
  const double second = 2 - 2 * std::cos(w);
  return 1 / (second * second);
}

std::array<double, 3> SecondDifference(const std::vector<double>& times, std::size_t t) {
  const double before = times[t] - times[t - 1], after = times[t + 1] - times[t], both = before + after;
  const double root = std::sqrt(0.5 * both);
  return {root * 2 / (before * both), -root * 2 / (before * after), root * 2 / (after * both)};
}

double TimeStoodFor(const std::vector<double>& times, std::size_t t) {
  const std::size_t before = t > 0 ? t - 1 : 0, after = std::min(t + 1, times.size() - 1);
  return after > before ? (times[after] - times[before]) / static_cast<double>(after - before) : 1;
}

PathProblemSummary SolvePathProblem(const std::vector<WantedFrame>& wanted, const PathProblemOptions& options,
                                    std::vector<Matrix34d>& P) {
  if (wanted.size() != P.size()) throw std::invalid_argument("SolvePathProblem: as many targets as matrices");
  std::vector<double> times = options.times;
  if (times.empty())
    for (std::size_t t = 0; t < P.size(); ++t) times.push_back(static_cast<double>(t));
  if (times.size() != P.size()) throw std::invalid_argument("SolvePathProblem: as many times as matrices");
  for (std::size_t t = 1; t < times.size(); ++t)
    if (!(times[t] > times[t - 1])) throw std::invalid_argument("SolvePathProblem: times ascend");
  CheckInterrupted();
  PathProblemSummary result;
  std::vector<RowMajor34d> unknown(P.begin(), P.end());
  for (RowMajor34d& p : unknown) p.normalize();

  ceres::SphereManifold<12> sphere;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  for (std::size_t t = 0; t < P.size(); ++t) {
    problem.AddParameterBlock(unknown[t].data(), 12, &sphere);
    if (wanted[t].held) problem.SetParameterBlockConstant(unknown[t].data());
  }
  std::vector<Eigen::Vector4d> similarity(P.size(), Eigen::Vector4d::Zero());
  const auto in_front = [&](std::size_t t, const Eigen::Vector4d& X) { return unknown[t].row(2).dot(X) > 1e-9; };
  for (std::size_t t = 0; t < P.size(); ++t) {
    const WantedFrame& frame = wanted[t];
    double shares = 0;
    for (const WantedPoint& point : frame.points) shares += point.share;
    if (!(shares > 0)) continue;
    for (std::size_t j = 0; j < frame.points.size(); ++j) {
      const WantedPoint& point = frame.points[j];
      const double share = point.share / shares;
      if (!(share > 0) || !in_front(t, point.X)) continue;
      if (frame.weight > 0 && !frame.held)
        problem.AddResidualBlock(new TargetCost(point, share * frame.weight), nullptr, unknown[t].data());
      if (frame.parallax > 0 && !frame.held && !point.Z.isZero() && in_front(t, point.Z))
        problem.AddResidualBlock(new ParallaxCost(point.X, point.Z, share * frame.parallax), nullptr,
                                 unknown[t].data());
      if (frame.alike > 0 && !frame.held)
        problem.AddResidualBlock(new AlikeCost(point, share * frame.alike), nullptr, unknown[t].data(),
                                 similarity[t].data());
      if (!(options.smoothness > 0) || t == 0 || t + 1 == P.size() || !in_front(t - 1, point.X) ||
          !in_front(t + 1, point.X))
        continue;
      if (wanted[t - 1].held && frame.held && wanted[t + 1].held) continue;
      const Eigen::Vector2d bend = frame.bend.empty() ? Eigen::Vector2d(0, 0) : frame.bend[j];
      problem.AddResidualBlock(new BendCost(point.X, SecondDifference(times, t), bend, share * options.smoothness),
                               nullptr, unknown[t - 1].data(), unknown[t].data(), unknown[t + 1].data());
    }
  }
  if (problem.NumResidualBlocks() == 0) return result;
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.gradient_tolerance = 1e-16;
  solver.parameter_tolerance = 1e-12;
  solver.initial_trust_region_radius = 1e6;  // nearly linear: the first step may be the whole way
  solver.max_trust_region_radius = kMostTrust;
  solver.num_threads = 1;  // sums in one order: the same bytes each time
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.iterations = static_cast<int>(summary.iterations.size());
  result.start_cost = summary.initial_cost;
  result.cost = summary.final_cost;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.usable = summary.IsSolutionUsable();
  for (const RowMajor34d& p : unknown) result.usable = result.usable && p.allFinite();
  if (result.usable)
    for (std::size_t t = 0; t < P.size(); ++t) P[t] = unknown[t].normalized();
  return result;
}

}  // namespace lumi
