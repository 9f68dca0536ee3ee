#include "reconstruct/factorization/projective_model.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"

namespace lumi {

ProjectiveModel::ProjectiveModel(const ImagePoints& points)
    : P(points.FrameCount(), Matrix34d::Zero()),
      placed(points.FrameCount(), 0),
      X(points.tracks.size(), Eigen::Vector4d::Zero()),
      solved(points.tracks.size(), 0) {
  for (const auto& track : points.tracks) inlier.emplace_back(track.size(), 1);
}

int ProjectiveModel::PlacedCount() const {
  int n = 0;
  for (const char p : placed) n += p != 0;
  return n;
}

int ProjectiveModel::SolvedCount() const {
  int n = 0;
  for (const char s : solved) n += s != 0;
  return n;
}

double ReprojectionErrorPx(const ImagePoints& points, const ProjectiveModel& model, const Sight& sight,
                           std::size_t track) {
  const auto f = static_cast<std::size_t>(sight.frame);
  const Eigen::Vector3d x = model.P[f] * model.X[track];
  const double error = (x.head<2>() / x.z() - sight.x).norm() * points.px_per_unit[f];
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

std::vector<double> InlierErrorsPx(const ImagePoints& points, const ProjectiveModel& model) {
  std::vector<double> errors;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (!model.solved[t]) continue;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& sight = points.tracks[t][k];
      if (model.inlier[t][k] && model.placed[static_cast<std::size_t>(sight.frame)])
        errors.push_back(ReprojectionErrorPx(points, model, sight, t));
    }
  }
  return errors;
}

double RmsPx(const ImagePoints& points, const ProjectiveModel& model) {
  double sum = 0;
  const std::vector<double> errors = InlierErrorsPx(points, model);
  for (const double e : errors) sum += e * e;
  return errors.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(errors.size()));
}

void ChangeFrame(ProjectiveModel& model, const Eigen::Matrix4d& H) {
  const auto inverse = InverseOf(H);
  if (!inverse) return;
  const Eigen::Matrix4d back = *inverse;
  for (std::size_t f = 0; f < model.P.size(); ++f)
    if (model.placed[f]) model.P[f] = (model.P[f] * H).eval().normalized();
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) model.X[t] = (back * model.X[t]).normalized();
}

void BalanceFrame(ProjectiveModel& model) {
  // Two rounds: the norms of the cameras change with the frame.
  for (int round = 0; round < 2; ++round) {
    Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
    for (std::size_t f = 0; f < model.P.size(); ++f)
      if (model.placed[f]) gram += model.P[f].transpose() * model.P[f] / model.P[f].squaredNorm();
    const SymmetricEigen eigen = EigenOfSymmetric(gram);
    const Eigen::Vector4d values = eigen.values;
    // A frame in which all cameras share a centre has no fourth direction to balance.
    if (!(values[0] > 1e-14 * values[3])) return;
    ChangeFrame(model, eigen.vectors * values.cwiseSqrt().cwiseInverse().asDiagonal());
  }
}

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace lumi
