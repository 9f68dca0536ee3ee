#include "reconstruct/factorization/projective_bundle.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>

#include <deque>
#include <memory>

#include "reconstruct/factorization/reprojection_cost.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using RowMajor34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

// Damping never falls below this part of the normal matrix's diagonal: it is all that holds the free frame.
constexpr double kMostTrust = 1e7;
// More cameras than this and their blocks are sparse enough to gain from it.
constexpr std::size_t kDenseCameras = 30;

}  // namespace

TrackPieces CutTrack(const ImagePoints& points, const ProjectiveModel& used, std::size_t track,
                     const BundleOptions& options) {
  TrackPieces pieces;
  if (options.max_span <= 0 || (track < options.whole.size() && options.whole[track])) return pieces;
  int last = -1;
  for (std::size_t k = 0; k < points.tracks[track].size(); ++k) {
    const int f = points.tracks[track][k].frame;
    if (!used.inlier[track][k] || !used.placed[static_cast<std::size_t>(f)]) continue;
    if (last < 0) pieces.first = f;
    last = f;
  }
  if (last < 0) return pieces;
  pieces.frames = last - pieces.first + 1;
  pieces.count = (pieces.frames + options.max_span - 1) / options.max_span;
  return pieces;
}

BundleSummary AdjustProjective(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& options,
                               const std::vector<char>& held) {
  const Stopwatch watch;
  BundleSummary result;
  result.start_rms_px = result.rms_px = RmsPx(points, model);
  std::vector<RowMajor34d> P(model.P.begin(), model.P.end());
  std::vector<Eigen::Vector4d> X = model.X;
  for (auto& p : P) p.normalize();

  std::unique_ptr<ceres::LossFunction> loss;
  if (options.loss == BundleOptions::Loss::kHuber) loss = std::make_unique<ceres::HuberLoss>(options.scale_px);
  if (options.loss == BundleOptions::Loss::kCauchy) loss = std::make_unique<ceres::CauchyLoss>(options.scale_px);
  ceres::SphereManifold<12> camera_sphere;
  ceres::SphereManifold<4> point_sphere;
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  ceres::Solver::Options solver;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::size_t cameras = 0;
  for (std::size_t f = 0; f < P.size(); ++f) {
    if (!model.placed[f]) continue;
    problem.AddParameterBlock(P[f].data(), 12, &camera_sphere);
    if (f < held.size() && held[f]) problem.SetParameterBlockConstant(P[f].data());
    ordering->AddElementToGroup(P[f].data(), 1);
    ++cameras;
  }
  std::deque<Eigen::Vector4d> more;  // points of tracks that are cut; the middle piece's is X[t]
  for (std::size_t t = 0; t < X.size(); ++t) {
    if (!model.solved[t]) continue;
    const TrackPieces pieces = CutTrack(points, model, t, options);
    int piece = -1;
    Eigen::Vector4d* point = nullptr;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& sight = points.tracks[t][k];
      const auto f = static_cast<std::size_t>(sight.frame);
      if (!model.inlier[t][k] || !model.placed[f]) continue;
      if (const int now = pieces.Of(sight.frame); now != piece) {
        piece = now;
        point = now == pieces.count / 2 ? &X[t] : &more.emplace_back(model.X[t]);
        point->normalize();
        problem.AddParameterBlock(point->data(), 4, &point_sphere);
        ordering->AddElementToGroup(point->data(), 0);
      }
      problem.AddResidualBlock(new ReprojectionCost<4>(sight.x, points.px_per_unit[f]), loss.get(), P[f].data(),
                               point->data());
    }
  }
  if (problem.NumResidualBlocks() == 0) return result;
  solver.linear_solver_ordering = ordering;
  solver.linear_solver_type = cameras > kDenseCameras ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.gradient_tolerance = 1e-14;
  solver.parameter_tolerance = 1e-14;
  solver.max_trust_region_radius = kMostTrust;
  solver.num_threads = 1;  // sums in one order: the same bytes each time. Windows run side by side.
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.iterations = static_cast<int>(summary.iterations.size());
  result.seconds = watch.Seconds();
  if (!summary.IsSolutionUsable()) return result;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (model.placed[f] && !P[f].allFinite()) return result;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (model.placed[f]) model.P[f] = P[f].normalized();
  for (std::size_t t = 0; t < X.size(); ++t)
    if (model.solved[t]) model.X[t] = X[t].normalized();
  result.usable = true;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.rms_px = RmsPx(points, model);
  return result;
}

}  // namespace lumi
