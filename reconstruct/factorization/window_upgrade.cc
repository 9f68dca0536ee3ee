#include "reconstruct/factorization/window_upgrade.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/upgrade.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/geometry/similarity3.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kLeastPieceSights = 3;     // of a track within a window
constexpr std::size_t kLeastShared = 8;  // points from which the scale between neighbours is read

// A window on its own, in a metric frame of its own.
struct MetricPiece {
  bool usable = false;
  FrameWindow window;  // placed frames only
  MetricModel metric;  // numbers are positions in `window`
  std::vector<char> solved;
  double plane_sigma = 0;
};

MetricPiece UpgradePiece(const ImagePoints& all, const ProjectiveModel& projective, const std::vector<int>& frames,
                         const Eigen::Vector4d& intrinsics_px, const WindowUpgradeOptions& options) {
  MetricPiece piece;
  std::vector<int> placed;
  for (const int f : frames)
    if (projective.placed[static_cast<std::size_t>(f)]) placed.push_back(f);
  if (placed.size() < 2) return piece;
  piece.window = MakeWindow(all, placed);
  const ImagePoints points = Extract(all, piece.window);
  ProjectiveModel model(points);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    model.P[i] = projective.P[static_cast<std::size_t>(placed[i])];
    model.placed[i] = 1;
  }
  const int least = std::min(kLeastPieceSights, static_cast<int>(placed.size()));
  for (std::size_t i = 0; i < piece.window.tracks.size(); ++i) {
    const auto t = static_cast<std::size_t>(piece.window.tracks[i]);
    int agree = 0;
    std::size_t in_window = 0;
    for (std::size_t k = 0; k < all.tracks[t].size(); ++k) {
      if (!std::ranges::binary_search(placed, all.tracks[t][k].frame)) continue;
      model.inlier[i][in_window++] = projective.inlier[t][k];
      agree += projective.inlier[t][k] != 0;
    }
    model.solved[i] = projective.solved[t] && agree >= least;
    model.X[i] = projective.X[t];
  }
  BalanceFrame(model);
  const double projective_rms = RmsPx(points, model);

  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = intrinsics_px[0];
  K(1, 1) = intrinsics_px[1];
  K.topRightCorner<2, 1>() = intrinsics_px.tail<2>();
  std::vector<Eigen::Matrix3d> K_normalised;
  for (std::size_t f = 0; f < points.FrameCount(); ++f) K_normalised.push_back(NormalisedFromPixels(points, f) * K);
  const Upgrade upgrade = UpgradeToEuclidean(points, model, K_normalised);
  const auto back = InverseOf(upgrade.H);
  if (!upgrade.found || !back) return piece;
  piece.plane_sigma = upgrade.plane_sigma;
  piece.metric.intrinsics_px = intrinsics_px;
  piece.metric.cam_from_world = upgrade.cam_from_world;
  piece.metric.X.assign(model.X.size(), Eigen::Vector4d::Zero());
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    if (!model.solved[t]) continue;
    piece.metric.X[t] = (*back * model.X[t]).normalized();
    if (!piece.metric.X[t].allFinite()) return piece;
  }
  BundleOptions bundle;
  bundle.loss = options.loss;
  bundle.tolerance = 1e-4;
  for (const double scale_px : {std::max(4 * options.sigma_px, 1.0), std::max(2 * options.sigma_px, 0.1)}) {
    bundle.scale_px = scale_px;
    if (!AdjustMetric(points, model, piece.metric, FreeIntrinsics::kNone, bundle).usable) return piece;
  }
  ToProjective(points, piece.metric, model);
  piece.solved = model.solved;
  piece.usable = RmsPx(points, model) <= options.max_rms_factor * projective_rms + options.max_rms_more_px;
  return piece;
}

// The piece in the whole's frame, from the cameras both have and the points these see; none where they share too
// little.
std::optional<Similarity3> WholeFromPiece(const ImagePoints& points, const WindowUpgrade& whole,
                                          const std::vector<char>& joined, const MetricPiece& piece) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  std::vector<std::size_t> shared;  // positions in the piece
  for (std::size_t i = 0; i < piece.window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(piece.window.frames[i]);
    if (!joined[f]) continue;
    shared.push_back(i);
    turns += whole.cam_from_world[f].R().transpose() * piece.metric.cam_from_world[i].R();
  }
  if (shared.empty()) return std::nullopt;
  // Distances from a shared camera to the points that it sees in both.
  std::vector<double> ratios;
  for (std::size_t k = 0; k < piece.window.tracks.size(); ++k) {
    const auto t = static_cast<std::size_t>(piece.window.tracks[k]);
    if (!whole.solved[t] || !piece.solved[k]) continue;
    for (const std::size_t i : shared) {
      const int f = piece.window.frames[i];
      const auto& sights = points.tracks[t];
      if (std::ranges::none_of(sights, [&](const Sight& s) { return s.frame == f; })) continue;
      const Rigid3 &in_whole = whole.cam_from_world[static_cast<std::size_t>(f)],
                   &in_piece = piece.metric.cam_from_world[i];
      const Eigen::Vector4d &X = whole.X[t], &Y = piece.metric.X[k];
      const double far = (in_whole.rotation * X.head<3>() + in_whole.translation * X.w()).norm() * std::abs(Y.w());
      const double near = (in_piece.rotation * Y.head<3>() + in_piece.translation * Y.w()).norm() * std::abs(X.w());
      const double ratio = far / near;
      if (std::isfinite(ratio) && ratio > 0) ratios.push_back(ratio);
      break;
    }
  }
  if (ratios.size() < kLeastShared) return std::nullopt;
  Similarity3 s;
  s.scale = Median(std::move(ratios));
  s.rotation = Eigen::Quaterniond(NearestRotation(turns)).normalized();
  for (const std::size_t i : shared) {
    const auto f = static_cast<std::size_t>(piece.window.frames[i]);
    s.translation += whole.cam_from_world[f].OriginInSource() -
                     s.scale * (s.rotation * piece.metric.cam_from_world[i].OriginInSource());
  }
  s.translation /= static_cast<double>(shared.size());
  return s;
}

void Join(const MetricPiece& piece, const Similarity3& whole_from_piece, WindowUpgrade& whole,
          std::vector<char>& joined) {
  for (std::size_t i = 0; i < piece.window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(piece.window.frames[i]);
    if (joined[f]) continue;
    whole.cam_from_world[f] = TransformPose(piece.metric.cam_from_world[i], whole_from_piece);
    joined[f] = 1;
  }
  Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
  H.topLeftCorner<3, 3>() = whole_from_piece.scale * whole_from_piece.rotation.toRotationMatrix();
  H.topRightCorner<3, 1>() = whole_from_piece.translation;
  for (std::size_t k = 0; k < piece.window.tracks.size(); ++k) {
    const auto t = static_cast<std::size_t>(piece.window.tracks[k]);
    if (!piece.solved[k] || whole.solved[t]) continue;
    whole.X[t] = (H * piece.metric.X[k]).normalized();
    whole.solved[t] = 1;
  }
}

}  // namespace

WindowUpgrade UpgradeByWindows(const ImagePoints& points, const ProjectiveModel& projective,
                               const std::vector<FrameWindow>& windows, const Eigen::Vector4d& intrinsics_px,
                               const WindowUpgradeOptions& options) {
  WindowUpgrade whole;
  whole.cam_from_world.resize(points.FrameCount());
  whole.X.assign(points.tracks.size(), Eigen::Vector4d::Zero());
  whole.solved.assign(points.tracks.size(), 0);
  std::vector<MetricPiece> pieces(windows.size());
  ParallelEach(windows.size(), 1, [&](std::size_t i) {
    pieces[i] = UpgradePiece(points, projective, windows[i].frames, intrinsics_px, options);
  });
  std::vector<char> joined(points.FrameCount(), 0), done(pieces.size(), 0);
  std::vector<double> sigmas;
  while (true) {
    // The surest one first, then whoever shares most frames with those joined.
    std::size_t next = pieces.size();
    double best = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (done[i] || !pieces[i].usable) continue;
      double score = 0;
      if (sigmas.empty())
        score = static_cast<double>(pieces[i].window.frames.size()) / std::max(pieces[i].plane_sigma, 1e-6);
      else
        for (const int f : pieces[i].window.frames) score += joined[static_cast<std::size_t>(f)];
      if (score > best) best = score, next = i;
    }
    if (next == pieces.size()) break;
    done[next] = 1;
    std::optional<Similarity3> whole_from_piece = Similarity3();
    if (!sigmas.empty()) whole_from_piece = WholeFromPiece(points, whole, joined, pieces[next]);
    if (!whole_from_piece) continue;
    Join(pieces[next], *whole_from_piece, whole, joined);
    sigmas.push_back(pieces[next].plane_sigma);
  }
  whole.windows = static_cast<int>(sigmas.size());
  whole.plane_sigma = Median(sigmas);
  whole.found = !sigmas.empty();
  for (std::size_t f = 0; f < joined.size(); ++f) whole.found = whole.found && (joined[f] || !projective.placed[f]);
  return whole;
}

}  // namespace lumi
