#include "reconstruct/factorization/projective_bundle.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "reconstruct/factorization/schur_system.h"
#include "scene/geometry/levenberg_marquardt.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using RowMajor34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Basis = Eigen::Matrix<double, 4, 3>;  // of the sphere's tangents at a point

// Damping as Ceres does it (Madsen, Nielsen, Tingleff 2004, section 3.2), never below one part in 1e7 of the normal
// matrix' diagonal: it is all that holds the free frame.
constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-7, kMostDamping = 1e16;
constexpr double kLeastGain = 1e-3;  // of what the equations promise; less, and the step is not taken
constexpr std::size_t kPiecesAtOnce = 64;

// A track, or a part of one that is cut.
struct Piece {
  std::size_t track = 0;
  bool kept = false;  // its point is the track's
  Eigen::Vector4d X = Eigen::Vector4d::Zero();
};

// A sight's prediction q = P X: its residual, and what its derivatives are made of.
struct Prediction {
  Eigen::Vector2d y, r;  // q.xy / q.z, and its distance to the sight in pixels
  double scale = 0;      // pixels per unit of q.xy
  double weight = 0;     // of the robust loss
};

Basis TangentsAt(const Eigen::Vector4d& X) {
  // Householder's reflection that takes X to an axis has them in its other columns.
  Eigen::Vector4d v = X;
  const double sign = X[3] < 0 ? -1 : 1;
  v[3] += sign;
  return Eigen::Matrix4d::Identity().leftCols<3>() - (2 / v.squaredNorm()) * v * v.head<3>().transpose();
}

class ProjectiveAdjustment {
 public:
  ProjectiveAdjustment(const ImagePoints& points, const ProjectiveModel& model, const BundleOptions& options,
                       const std::vector<char>& held)
      : points_(points), options_(options), P_(model.P.begin(), model.P.end()), camera_of_(P_.size(), -1) {
    for (std::size_t f = 0; f < P_.size(); ++f) {
      if (!model.placed[f]) continue;
      P_[f].normalize();
      if (f < held.size() && held[f]) continue;
      camera_of_[f] = static_cast<int>(frame_of_.size());
      frame_of_.push_back(f);
    }
    std::vector<SchurSystem::Link> links;
    for (std::size_t t = 0; t < model.X.size(); ++t) {
      if (!model.solved[t]) continue;
      EachPiece(
          points, model, t, options,
          [&](bool middle) {
            pieces_.push_back({t, middle, model.X[t].normalized()});
          },
          [&](const Sight& sight) {
            links.push_back({camera_of_[static_cast<std::size_t>(sight.frame)], static_cast<int>(pieces_.size()) - 1});
            sights_.push_back(&sight);
          });
    }
    system_ = std::make_unique<SchurSystem>(static_cast<int>(frame_of_.size()), static_cast<int>(pieces_.size()),
                                            std::move(links));
    predictions_.resize(sights_.size());
  }

  // False: there is nothing to adjust, or a point lies on a camera's principal plane.
  bool Minimise(BundleSummary& summary) {
    if (sights_.empty()) return false;
    double cost = Cost(P_, pieces_);
    if (!std::isfinite(cost)) return false;
    double damping = kFirstDamping, rise = 2;
    bool linearised = false;
    SchurSystem::Step step;
    while (summary.iterations < options_.max_iterations && damping < kMostDamping) {
      CheckInterrupted();
      if (cost == 0) {
        summary.converged = true;
        break;
      }
      ++summary.iterations;
      if (!linearised) Linearise();
      linearised = true;
      const bool solved = system_->Solve(damping, step);
      if (solved && step.model_decrease <= kRounding * cost) {
        summary.converged = true;
        break;
      }
      if (solved) Take(step);
      const double then = solved ? Cost(next_P_, next_pieces_) : std::numeric_limits<double>::infinity();
      const double gain = solved ? (cost - then) / step.model_decrease : 0;
      if (!std::isfinite(then) || gain < kLeastGain) {
        damping *= rise;
        rise *= 2;
        continue;
      }
      const double fall = std::pow(2 * gain - 1, 3);
      damping = std::max(kLeastDamping, damping * std::max(1.0 / 3, 1 - fall));
      rise = 2;
      P_.swap(next_P_);
      pieces_.swap(next_pieces_);
      linearised = false;
      summary.converged = cost - then <= options_.tolerance * cost;
      cost = then;
      if (summary.converged) break;
    }
    return true;
  }

  void Give(ProjectiveModel& model) const {
    for (std::size_t f = 0; f < P_.size(); ++f)
      if (model.placed[f]) model.P[f] = P_[f];
    for (const Piece& piece : pieces_)
      if (piece.kept) model.X[piece.track] = piece.X;
  }

 private:
  static constexpr double kRounding = 1e-15;  // of the cost: less cannot be told

  // Of a squared residual.
  RobustLoss LossOf(double squared) const {
    const double scale2 = options_.scale_px * options_.scale_px;
    switch (options_.loss) {
      case BundleOptions::Loss::kNone: break;
      case BundleOptions::Loss::kHuber:
        if (squared > scale2) {
          const double r = std::sqrt(squared);
          return {2 * options_.scale_px * r - scale2, options_.scale_px / r};
        }
        break;
      case BundleOptions::Loss::kCauchy: return Cauchy(squared, scale2);
    }
    return {squared, 1};
  }

  // Predictions of all sights too. Sums go piece by piece: the same for any number of threads.
  double Cost(const std::vector<RowMajor34d>& P, const std::vector<Piece>& pieces) {
    piece_cost_.resize(pieces.size());
    ParallelFor(pieces.size(), kPiecesAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        double sum = 0;
        for (std::size_t k = system_->FirstLink(p); k < system_->FirstLink(p + 1); ++k) {
          const auto f = static_cast<std::size_t>(sights_[k]->frame);
          const Eigen::Vector3d q = P[f] * pieces[p].X;
          Prediction& to = predictions_[k];
          to.scale = points_.px_per_unit[f] / q.z();
          to.y = q.head<2>() / q.z();
          to.r = (to.y - sights_[k]->x) * points_.px_per_unit[f];
          const RobustLoss loss = LossOf(to.r.squaredNorm());
          to.weight = loss.weight;
          sum += loss.cost;
        }
        piece_cost_[p] = sum;
      }
    });
    double sum = 0;
    for (const double c : piece_cost_) sum += c;
    return sum / 2;
  }

  // The equations at P_ and pieces_, whose predictions are there where their cost was the last one asked for.
  void Linearise() {
    SchurSystem& s = *system_;
    basis_.resize(pieces_.size());
    ParallelFor(pieces_.size(), kPiecesAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const Eigen::Vector4d& X = pieces_[p].X;
        basis_[p] = TangentsAt(X);
        s.V[p].setZero();
        s.point_gradient[p].setZero();
        for (std::size_t k = s.FirstLink(p); k < s.FirstLink(p + 1); ++k) {
          const RowMajor34d& P = P_[static_cast<std::size_t>(sights_[k]->frame)];
          const Prediction& at = predictions_[k];
          Eigen::Matrix<double, 2, 3> J;
          for (int r = 0; r < 2; ++r) J.row(r) = at.scale * (P.row(r) - at.y[r] * P.row(2)) * basis_[p];
          s.V[p].noalias() += at.weight * J.transpose() * J;
          s.point_gradient[p].noalias() += at.weight * J.transpose() * at.r;
          // A camera's derivatives are s [X 0 -y0 X; 0 X -y1 X].
          const Eigen::Vector4d x = at.weight * at.scale * X;
          s.E[k].topRows<4>().noalias() = x * J.row(0);
          s.E[k].middleRows<4>(4).noalias() = x * J.row(1);
          s.E[k].bottomRows<4>().noalias() = -x * (at.y[0] * J.row(0) + at.y[1] * J.row(1));
        }
      }
    });
    ParallelFor(frame_of_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        s.U[c].setZero();
        s.camera_gradient[c].setZero();
        for (const int link : s.LinksOf(c)) {
          const auto k = static_cast<std::size_t>(link);
          const Prediction& at = predictions_[k];
          const Eigen::Vector4d& X = pieces_[static_cast<std::size_t>(s.links()[k].point)].X;
          const Eigen::Vector3d d(at.r[0], at.r[1], -at.y.dot(at.r)), y(at.y[0], at.y[1], at.y.squaredNorm());
          const Eigen::Matrix4d XX = at.weight * at.scale * at.scale * X * X.transpose();
          for (int r = 0; r < 3; ++r) s.camera_gradient[c].segment<4>(4 * r) += at.weight * at.scale * d[r] * X;
          s.U[c].block<4, 4>(0, 0) += XX;
          s.U[c].block<4, 4>(8, 0) -= y[0] * XX;
          s.U[c].block<4, 4>(8, 4) -= y[1] * XX;
          s.U[c].block<4, 4>(8, 8) += y[2] * XX;
        }
        s.U[c].block<4, 4>(4, 4) = s.U[c].block<4, 4>(0, 0);
        s.U[c].block<4, 8>(0, 4) = Eigen::Matrix<double, 4, 8>::Zero();
        s.U[c].block<8, 4>(0, 8) = s.U[c].block<4, 8>(8, 0).transpose();
        // No residual knows the matrix' scale: no step is spent along it.
        const Eigen::Map<const SchurSystem::CameraVector> p(P_[frame_of_[c]].data());
        const double size = s.U[c].trace() / SchurSystem::kCameraNumbers;
        s.U[c].noalias() += size * p * p.transpose();
      }
    });
  }

  void Take(const SchurSystem::Step& step) {
    next_P_ = P_;
    next_pieces_ = pieces_;
    for (std::size_t c = 0; c < frame_of_.size(); ++c) {
      RowMajor34d& P = next_P_[frame_of_[c]];
      P += Eigen::Map<const RowMajor34d>(step.cameras[c].data());
      P.normalize();
    }
    for (std::size_t p = 0; p < pieces_.size(); ++p) {
      next_pieces_[p].X += basis_[p] * step.points[p];
      next_pieces_[p].X.normalize();
    }
  }

  const ImagePoints& points_;
  const BundleOptions& options_;
  std::vector<RowMajor34d> P_, next_P_;
  std::vector<Piece> pieces_, next_pieces_;
  std::vector<int> camera_of_;         // a frame's, -1: it does not move
  std::vector<std::size_t> frame_of_;  // a camera's
  std::vector<const Sight*> sights_;   // one a link
  std::vector<Prediction> predictions_;
  std::vector<double> piece_cost_;
  std::vector<Basis> basis_;
  std::unique_ptr<SchurSystem> system_;
};

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
  ProjectiveAdjustment adjustment(points, model, options, held);
  result.usable = adjustment.Minimise(result);
  result.seconds = watch.Seconds();
  if (!result.usable) return result;
  adjustment.Give(model);
  result.rms_px = RmsPx(points, model);
  return result;
}

}  // namespace lumi
