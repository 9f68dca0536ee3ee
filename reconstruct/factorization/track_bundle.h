// The metric bundle adjustment's points on spheres, of tracks that may be cut, and how Ceres is told to go about them.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include <deque>
#include <memory>

#include "reconstruct/factorization/projective_bundle.h"
#include "scene/program/stopwatch.h"

namespace lumi {

class TrackBundle {
 public:
  TrackBundle(const ImagePoints& points, const ProjectiveModel& used, const BundleOptions& options)
      : points_(points), used_(used), options_(options), problem_(NothingOwned()) {
    if (options.loss == BundleOptions::Loss::kHuber) loss_ = std::make_unique<ceres::HuberLoss>(options.scale_px);
    if (options.loss == BundleOptions::Loss::kCauchy) loss_ = std::make_unique<ceres::CauchyLoss>(options.scale_px);
  }

  static ceres::Problem::Options NothingOwned() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  // Numbers that are not a point's; the manifold outlives this.
  void AddCamera(double* numbers, int count, ceres::Manifold* manifold, bool held) {
    problem_.AddParameterBlock(numbers, count, manifold);
    if (held) problem_.SetParameterBlockConstant(numbers);
    ordering_->AddElementToGroup(numbers, 1);
  }

  // add(problem, loss, sight, frame, point) adds the residual of each sight that is in use; points start at `start`,
  // and X has what becomes of them.
  template <typename Add>
  void AddPoints(const std::vector<Eigen::Vector4d>& start, std::vector<Eigen::Vector4d>& X, const Add& add) {
    for (std::size_t t = 0; t < X.size(); ++t) {
      if (!used_.solved[t]) continue;
      Eigen::Vector4d* point = nullptr;
      EachPiece(
          points_, used_, t, options_,
          [&](bool middle) {
            point = middle ? &X[t] : &more_.emplace_back(start[t]);
            point->normalize();
            problem_.AddParameterBlock(point->data(), 4, &point_sphere_);
            ordering_->AddElementToGroup(point->data(), 0);
          },
          [&](const Sight& sight) {
            add(problem_, loss_.get(), sight, static_cast<std::size_t>(sight.frame), point->data());
          });
    }
  }

  // False: there is nothing to adjust, or what came of it cannot be used.
  bool Solve(bool sparse, BundleSummary& result) {
    if (problem_.NumResidualBlocks() == 0) return false;
    ceres::Solver::Options solver;
    solver.linear_solver_ordering = ordering_;
    solver.linear_solver_type = sparse ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
    solver.max_num_iterations = options_.max_iterations;
    solver.function_tolerance = options_.tolerance;
    solver.gradient_tolerance = 1e-14;
    solver.parameter_tolerance = 1e-14;
    // Damping never falls below this part of the normal matrix's diagonal: it is all that holds the free frame.
    solver.max_trust_region_radius = 1e7;
    solver.num_threads = 1;  // sums in one order: the same bytes each time. Windows run side by side.
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    result.iterations = static_cast<int>(summary.iterations.size());
    result.seconds = watch_.Seconds();
    converged_ = summary.termination_type == ceres::CONVERGENCE;
    return summary.IsSolutionUsable();
  }
  bool converged() const { return converged_; }

 private:
  const Stopwatch watch_;
  const ImagePoints& points_;
  const ProjectiveModel& used_;
  const BundleOptions& options_;
  std::unique_ptr<ceres::LossFunction> loss_;
  ceres::SphereManifold<4> point_sphere_;
  std::deque<Eigen::Vector4d> more_;  // points of tracks that are cut; the middle piece's is X[t]
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
  ceres::Problem problem_;
  bool converged_ = false;
};

}  // namespace lumi
