#include "reconstruct/factorization/projective_bundle.h"

#include "reconstruct/factorization/reprojection_cost.h"
#include "reconstruct/factorization/track_bundle.h"

namespace lumi {
namespace {

using RowMajor34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

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
  BundleSummary result;
  result.start_rms_px = result.rms_px = RmsPx(points, model);
  std::vector<RowMajor34d> P(model.P.begin(), model.P.end());
  std::vector<Eigen::Vector4d> X = model.X;
  for (auto& p : P) p.normalize();

  ceres::SphereManifold<12> camera_sphere;
  TrackBundle bundle(points, model, options);
  std::size_t cameras = 0;
  for (std::size_t f = 0; f < P.size(); ++f) {
    if (!model.placed[f]) continue;
    bundle.AddCamera(P[f].data(), 12, &camera_sphere, f < held.size() && held[f]);
    ++cameras;
  }
  bundle.AddPoints(model.X, X, [&](auto& problem, auto* loss, const Sight& sight, std::size_t f, double* point) {
    problem.AddResidualBlock(new ReprojectionCost<4>(sight.x, points.px_per_unit[f]), loss, P[f].data(), point);
  });
  if (!bundle.Solve(cameras > kDenseCameras, result)) return result;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (model.placed[f] && !P[f].allFinite()) return result;
  for (std::size_t f = 0; f < P.size(); ++f)
    if (model.placed[f]) model.P[f] = P[f].normalized();
  for (std::size_t t = 0; t < X.size(); ++t)
    if (model.solved[t]) model.X[t] = X[t].normalized();
  result.usable = true;
  result.converged = bundle.converged();
  result.rms_px = RmsPx(points, model);
  return result;
}

}  // namespace lumi
