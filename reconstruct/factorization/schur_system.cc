#include "reconstruct/factorization/schur_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <utility>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kNumbers = SchurSystem::kCameraNumbers;
constexpr std::size_t kPointsAtOnce = 64;

// A number that no residual depends on has a zero there, and must not end in a division by it.
template <typename Matrix>
auto Damping(const Matrix& m, double damping) {
  const double size = m.trace() / static_cast<double>(m.rows());
  return (damping * m.diagonal().cwiseMax(size > 0 ? 1e-12 * size : 1.0)).eval();
}

// The first row of each camera's row of the complement.
std::vector<int> FirstOf(int cameras, const std::vector<SchurSystem::Link>& links) {
  std::vector<int> first(static_cast<std::size_t>(cameras));
  std::iota(first.begin(), first.end(), 0);
  int lowest = -1, point = -1;
  for (const auto& link : links) {
    if (link.camera < 0) continue;
    if (link.point != point) {
      point = link.point;
      lowest = link.camera;
    }
    int& f = first[static_cast<std::size_t>(link.camera)];
    f = std::min(f, lowest);
  }
  std::vector<int> rows(first.size() * kNumbers);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = first[i / kNumbers] * kNumbers;
  return rows;
}

}  // namespace

SchurSystem::SchurSystem(int cameras, int points, std::vector<Link> links)
    : U(static_cast<std::size_t>(cameras)),
      camera_gradient(U.size()),
      V(static_cast<std::size_t>(points)),
      point_gradient(V.size()),
      E(links.size()),
      links_(std::move(links)),
      first_link_(V.size() + 1, 0),
      first_seen_(U.size() + 1, 0),
      root_(V.size()),
      divided_gradient_(V.size()),
      divided_(links_.size()),
      complement_(FirstOf(cameras, links_)) {
  for (const Link& link : links_) {
    ++first_link_[static_cast<std::size_t>(link.point) + 1];
    if (link.camera >= 0) ++first_seen_[static_cast<std::size_t>(link.camera) + 1];
  }
  std::partial_sum(first_link_.begin(), first_link_.end(), first_link_.begin());
  std::partial_sum(first_seen_.begin(), first_seen_.end(), first_seen_.begin());
  seen_by_.resize(first_seen_.back());
  std::vector<std::size_t> next = first_seen_;
  for (std::size_t k = 0; k < links_.size(); ++k)
    if (links_[k].camera >= 0) seen_by_[next[static_cast<std::size_t>(links_[k].camera)]++] = static_cast<int>(k);
}

void SchurSystem::EliminatePoints(double damping) {
  ParallelFor(V.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Eigen::Matrix3d damped = V[p];
      damped.diagonal() += Damping(V[p], damping);
      root_[p] = damped.llt().matrixL();
      const Eigen::Matrix3d& L = root_[p];
      divided_gradient_[p] = L.triangularView<Eigen::Lower>().solve(point_gradient[p]);
      for (std::size_t k = first_link_[p]; k < first_link_[p + 1]; ++k)
        divided_[k] = L.triangularView<Eigen::Lower>().solve(E[k].transpose()).transpose();
    }
  });
}

// The camera's row of U + d diag U - sum of F F^T, and of the right side, with F = E L^-T.
void SchurSystem::FillRow(std::size_t camera, double damping, Eigen::VectorXd& rhs) {
  const int i = static_cast<int>(camera);
  CameraVector right = -camera_gradient[camera];
  std::size_t count = 0;
  for (const int k : LinksOf(camera)) {
    const auto link = static_cast<std::size_t>(k);
    const auto p = static_cast<std::size_t>(links_[link].point);
    right.noalias() += divided_[link] * divided_gradient_[p];
    for (std::size_t other = first_link_[p]; other <= link; ++other) count += links_[other].camera >= 0;
  }
  rhs.segment<kNumbers>(i * kNumbers) = right;

  // The pairs, sorted by the other camera; of one camera in the order of points.
  std::vector<std::size_t> begin(camera + 2, 0);
  const auto each_pair = [&](const auto& take) {
    for (const int k : LinksOf(camera)) {
      const auto link = static_cast<std::size_t>(k);
      for (std::size_t other = first_link_[static_cast<std::size_t>(links_[link].point)]; other <= link; ++other)
        if (links_[other].camera >= 0) take(static_cast<std::size_t>(links_[other].camera), link, other);
    }
  };
  each_pair([&](std::size_t other, std::size_t, std::size_t) { ++begin[other + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<BlockPair> pairs(count);
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  each_pair([&](std::size_t other, std::size_t mine, std::size_t theirs) {
    pairs[next[other]++] = {divided_[mine].data(), divided_[theirs].data()};
  });

  CameraMatrix damped = U[camera];
  damped.diagonal() += Damping(U[camera], damping);
  double* diagonal = complement_.At(i * kNumbers, i * kNumbers);
  for (int c = 0; c < kNumbers; ++c)
    std::copy_n(damped.data() + c * kNumbers, kNumbers, diagonal + c * TileCholesky::kTile);
  for (std::size_t other = 0; other <= camera; ++other)
    if (begin[other] < begin[other + 1])
      SubtractProducts({pairs.data() + begin[other], begin[other + 1] - begin[other]},
                       complement_.At(i * kNumbers, static_cast<int>(other) * kNumbers), TileCholesky::kTile);
}

bool SchurSystem::Solve(double damping, Step& step) {
  EliminatePoints(damping);
  complement_.SetZero();
  Eigen::VectorXd x(complement_.size());
  ParallelFor(U.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) FillRow(c, damping, x);
  });
  if (!x.allFinite() || !complement_.Factorise()) return false;
  complement_.Solve(x);
  if (!x.allFinite()) return false;

  step.cameras.resize(U.size());
  for (std::size_t c = 0; c < U.size(); ++c)
    step.cameras[c] = x.segment<kNumbers>(static_cast<Eigen::Index>(c) * kNumbers);
  step.points.resize(V.size());
  ParallelFor(V.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Eigen::Vector3d right = divided_gradient_[p];
      for (std::size_t k = first_link_[p]; k < first_link_[p + 1]; ++k)
        if (links_[k].camera >= 0)
          right.noalias() += divided_[k].transpose() * step.cameras[static_cast<std::size_t>(links_[k].camera)];
      const Eigen::Matrix3d& L = root_[p];
      step.points[p] = -L.transpose().triangularView<Eigen::Upper>().solve(right);
    }
  });
  // (H + D) x = -g, so that -g^T x - x^T H x / 2 = (x^T D x - g^T x) / 2.
  double sum = 0;
  for (std::size_t c = 0; c < U.size(); ++c)
    sum += step.cameras[c].cwiseAbs2().dot(Damping(U[c], damping)) - camera_gradient[c].dot(step.cameras[c]);
  for (std::size_t p = 0; p < V.size(); ++p)
    sum += step.points[p].cwiseAbs2().dot(Damping(V[p], damping)) - point_gradient[p].dot(step.points[p]);
  step.model_decrease = sum / 2;
  return std::isfinite(sum);
}

}  // namespace lumi
