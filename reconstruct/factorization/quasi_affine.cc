#include "reconstruct/factorization/quasi_affine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruct/factorization/linear_program.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;

constexpr double kMaxConflictShare = 0.02;
constexpr double kMinMargin = 1e-9;
constexpr double kFewPoints = 0.005;  // of all: as many may be left out ...
constexpr double kClearGain = 1.5;    // ... where that lets the plane be so many times as far from all others

// c . Y = det [P; Y] for all Y: its sign follows P's, its last entry is det of P's left block.
Vector4d SignedCentre(const Matrix34d& P) {
  Vector4d c;
  for (int k = 0; k < 4; ++k) {
    Eigen::Matrix3d minor;
    for (int j = 0, col = 0; j < 4; ++j)
      if (j != k) minor.col(col++) = P.col(j);
    c[k] = (k % 2 == 0 ? -1.0 : 1.0) * minor.determinant();
  }
  const double n = c.norm();
  return n > 0 ? Vector4d(c / n) : c;
}

// Signs of cameras and points by majority, spread from the camera that sees most.
void FixSigns(const ImagePoints& points, ProjectiveModel& model, QuasiAffine& result) {
  const std::size_t frames = points.FrameCount(), tracks = points.tracks.size();
  struct Vote {
    std::size_t frame, track, sight;
    double w;
  };
  std::vector<Vote> votes;
  std::vector<std::vector<std::size_t>> of_frame(frames);
  std::vector<std::vector<std::size_t>> of_track(tracks);
  for (std::size_t t = 0; t < tracks; ++t) {
    if (!model.solved[t]) continue;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const auto f = static_cast<std::size_t>(points.tracks[t][k].frame);
      if (!model.placed[f] || !model.inlier[t][k]) continue;
      of_frame[f].push_back(votes.size());
      of_track[t].push_back(votes.size());
      votes.push_back({f, t, k, model.P[f].row(2).dot(model.X[t])});
    }
  }
  std::vector<int> frame_sign(frames, 0), track_sign(tracks, 0);
  const auto vote_track = [&](std::size_t t) {
    double sum = 0;
    for (const std::size_t v : of_track[t]) sum += frame_sign[votes[v].frame] * (votes[v].w > 0 ? 1 : -1);
    return sum;
  };
  const auto vote_frame = [&](std::size_t f) {
    double sum = 0;
    for (const std::size_t v : of_frame[f]) sum += track_sign[votes[v].track] * (votes[v].w > 0 ? 1 : -1);
    return sum;
  };
  while (true) {
    std::size_t next = frames;
    double best = 0;
    for (std::size_t f = 0; f < frames; ++f) {
      if (!model.placed[f] || frame_sign[f] != 0 || of_frame[f].empty()) continue;
      const double weight = 1e6 * std::abs(vote_frame(f)) + static_cast<double>(of_frame[f].size());
      if (weight > best) best = weight, next = f;
    }
    if (next == frames) break;
    frame_sign[next] = vote_frame(next) < 0 ? -1 : 1;
    for (const std::size_t v : of_frame[next]) {
      const std::size_t t = votes[v].track;
      const double sum = vote_track(t);
      track_sign[t] = sum > 0 ? 1 : sum < 0 ? -1 : track_sign[t];
    }
  }
  for (int round = 0; round < 5; ++round) {
    for (std::size_t t = 0; t < tracks; ++t)
      if (const double sum = vote_track(t); sum != 0) track_sign[t] = sum > 0 ? 1 : -1;
    for (std::size_t f = 0; f < frames; ++f)
      if (const double sum = vote_frame(f); sum != 0) frame_sign[f] = sum > 0 ? 1 : -1;
  }
  for (std::size_t f = 0; f < frames; ++f)
    if (frame_sign[f] < 0) model.P[f] = -model.P[f];
  for (std::size_t t = 0; t < tracks; ++t)
    if (track_sign[t] < 0) model.X[t] = -model.X[t];
  result.sights = static_cast<int>(votes.size());
  for (const Vote& v : votes)
    if (!(v.w * frame_sign[v.frame] * track_sign[v.track] > 0)) {
      model.inlier[v.track][v.sight] = 0;
      ++result.sign_conflicts;
    }
}

struct Plane4 {
  Vector4d plane;
  double margin;
};

std::optional<Plane4> FarthestPlane(const ProjectiveModel& model, double delta) {
  std::vector<Vector4d> rows;
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) rows.push_back(model.X[t].normalized());
  for (std::size_t f = 0; f < model.P.size(); ++f)
    if (model.placed[f]) rows.push_back(delta * SignedCentre(model.P[f]));
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd A(n, 5);
  for (Eigen::Index i = 0; i < n; ++i) A.row(i) << -rows[static_cast<std::size_t>(i)].transpose(), 1;
  Eigen::VectorXd goal = Eigen::VectorXd::Zero(5);
  goal[4] = 1;
  const auto x = SolveLinearProgram(A, Eigen::VectorXd::Zero(n), goal, 1.0);
  if (!x || !((*x)[4] > kMinMargin)) return std::nullopt;
  return Plane4{x->head<4>(), (*x)[4]};
}

// X <- H X, P <- P H^-1, signs and all.
void Apply(ProjectiveModel& model, const Matrix4d& H) {
  const Matrix4d back = H.inverse();
  for (std::size_t f = 0; f < model.P.size(); ++f)
    if (model.placed[f]) model.P[f] = (model.P[f] * back).eval().normalized();
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) model.X[t] = (H * model.X[t]).normalized();
}

// The plane goes to (0, 0, 0, 1); the points' centre to the origin, their covariance to one.
Matrix4d ToInfinity(const ProjectiveModel& model, const Vector4d& plane, double delta) {
  Matrix4d H;
  H << PerpendicularColumns(plane).transpose(), plane.transpose() / plane.norm();
  if (H.determinant() * delta < 0) H.row(0) = -H.row(0).eval();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> moved;
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) {
      const Vector4d X = H * model.X[t];
      if (X.w() > 0) moved.push_back(X.hnormalized());
    }
  if (moved.empty()) return H;
  for (const auto& x : moved) mean += x / static_cast<double>(moved.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& x : moved) covariance += (x - mean) * (x - mean).transpose() / static_cast<double>(moved.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const Eigen::Vector3d sigma = eigen.eigenvalues().cwiseMax(1e-12 * eigen.eigenvalues()[2]).cwiseSqrt();
  // Symmetric, so that it has a positive determinant and does not turn the frame.
  Matrix4d whiten = Matrix4d::Identity();
  whiten.topLeftCorner<3, 3>() =
      eigen.eigenvectors() * sigma.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  whiten.topRightCorner<3, 1>() = -whiten.topLeftCorner<3, 3>() * mean;
  return whiten * H;
}

// The frame that was found, and the plane in it again, until the margin no longer grows.
void GrowMargin(ProjectiveModel& model, double& margin) {
  for (int round = 0; round < 5; ++round) {
    const auto next = FarthestPlane(model, 1);
    if (!next || !(next->margin > 1.01 * margin)) return;
    ProjectiveModel trial = model;
    Apply(trial, ToInfinity(trial, next->plane, 1));
    model = std::move(trial);
    margin = next->margin;
  }
}

// Without the few points that stand the farthest from the others' centre, in a frame that has it at the origin.
ProjectiveModel WithoutFarthest(ProjectiveModel model) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) order.emplace_back(-model.X[t].head<3>().norm() / model.X[t].w(), t);
  const auto few = static_cast<std::size_t>(kFewPoints * static_cast<double>(order.size()));
  std::ranges::sort(order);
  for (std::size_t i = 0; i < few; ++i) model.solved[order[i].second] = 0;
  return model;
}

}  // namespace

QuasiAffine SolveQuasiAffine(const ImagePoints& points, ProjectiveModel& model) {
  QuasiAffine result;
  BalanceFrame(model);
  FixSigns(points, model, result);
  if (result.sights == 0 || result.sign_conflicts > kMaxConflictShare * result.sights) return result;
  const auto plus = FarthestPlane(model, 1), minus = FarthestPlane(model, -1);
  if (!plus && !minus) return result;
  result.mirrored = !plus || (minus && minus->margin > plus->margin);
  const Plane4 first = result.mirrored ? *minus : *plus;
  result.margin = first.margin;
  Apply(model, ToInfinity(model, first.plane, result.mirrored ? -1 : 1));
  GrowMargin(model, result.margin);
  // Points whose sights hardly determine their depth may lie anywhere along their rays, and two of a thousand can then
  // hold the plane close to all others. If only the few farthest points keep it there, they are left out of the model.
  ProjectiveModel without = WithoutFarthest(model);
  const auto with = FarthestPlane(model, 1), next = FarthestPlane(without, 1);  // in one frame: they compare
  if (with && next && next->margin > kClearGain * with->margin) {
    double margin = next->margin;
    Apply(without, ToInfinity(without, next->plane, 1));
    GrowMargin(without, margin);
    for (std::size_t t = 0; t < model.X.size(); ++t) result.left_out += model.solved[t] && !without.solved[t];
    model = std::move(without);
    result.margin = margin;
  }
  result.solved = true;
  return result;
}

}  // namespace lumi
