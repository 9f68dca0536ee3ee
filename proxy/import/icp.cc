#include "proxy/import/icp.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "proxy/mesh_query.h"
#include "proxy/points.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kPointToPoint =
    0.05;                              // of the weight: holds what the surface lets slide, and the edges of open meshes
constexpr double kMovedLittle = 1e-7;  // of the mesh's diagonal, and radians ...
constexpr double kMovedLessThanOff = 0.01;  // ... or of the rms: noise keeps some points changing sides
constexpr double kExact = 1e-4;             // of the mesh's diagonal: points nearer are on it
constexpr double kSlides = 1e-6;            // least over largest eigenvalue

struct Pair {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    // in world
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();  // on the mesh, in world
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double squared = 0;
};

struct Body {
  Eigen::AlignedBox3d box;
  double diagonal = 0;
  explicit Body(const Mesh& mesh) {
    for (const auto& f : mesh.faces)
      for (const std::int32_t v : f) box.extend(mesh.vertices[static_cast<std::size_t>(v)]);
    diagonal = mesh.faces.empty() ? 0 : box.diagonal().norm();
  }
};

// About the mesh's own middle.
Similarity3 Resized(const Similarity3& s, const Mesh& mesh, double factor) {
  const Eigen::Vector3d middle = s * Body(mesh).box.center();
  return Similarity3{factor, Eigen::Quaterniond::Identity(), (1 - factor) * middle} * s;
}

class Aligner {
 public:
  Aligner(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, const IcpOptions& options)
      : query_(mesh), body_(mesh), points_(points), options_(options) {}

  IcpResult From(const Similarity3& guess) {
    IcpResult r;
    r.scene_from_mesh = guess;
    std::vector<Eigen::Vector3d> near = PointsNear(guess);
    if (near.size() < kFewest) {
      r.why_not = fmt::format("{} points lie where the mesh is", near.size());
      r.rms = r.rms_of_diagonal = std::numeric_limits<double>::infinity();
      return r;
    }
    bool still = false;
    int since_picked = 0;
    for (r.iterations = 0; r.iterations < options_.max_iterations; ++r.iterations) {
      CheckInterrupted();
      // Which points lie near the mesh changes as it moves; not too often, or it would chase them.
      if (since_picked == 20 && r.iterations <= 60) {
        std::vector<Eigen::Vector3d> again = PointsNear(r.scene_from_mesh);
        if (again.size() >= kFewest) near = std::move(again);
        since_picked = 0;
      }
      ++since_picked;
      std::vector<Pair> pairs = Closest(near, r.scene_from_mesh);
      const double least = LeastShare(r.iterations);
      const std::size_t fitted = Trim(pairs, least, r.scene_from_mesh.scale);
      Evaluate(pairs, fitted, near.size(), r);
      const double moved = Step(pairs, fitted, r);
      still = !(moved > std::max(kMovedLittle, kMovedLessThanOff * r.rms_of_diagonal));
      if (still && least <= options_.min_overlap && (since_picked > 1 || r.iterations > 60)) break;
      const double change = r.scene_from_mesh.scale / guess.scale;
      if (!(change < options_.max_scale) || !(change > 1 / options_.max_scale)) {
        r.why_not = fmt::format("the mesh {} to {:.3g} times its guessed size", change > 1 ? "grew" : "shrank", change);
        break;
      }
    }
    std::vector<Pair> pairs = Closest(near, r.scene_from_mesh);
    Evaluate(pairs, Trim(pairs, options_.min_overlap, r.scene_from_mesh.scale), near.size(), r);
    if (!r.why_not.empty()) return r;
    if (!still)
      r.why_not = fmt::format("it still moved after {} iterations", r.iterations);
    else if (!(r.rms_of_diagonal <= options_.max_rms))
      r.why_not = fmt::format("the best fit is off by {:.2g} % of the mesh's diagonal, {:.2g} % are allowed",
                              100 * r.rms_of_diagonal, 100 * options_.max_rms);
    else if (!(r.weakest > kSlides))
      r.why_not = "the surface slides along itself: its shape does not say where it belongs";
    r.converged = r.why_not.empty();
    return r;
  }

  // The guess's turn, with place and size from where mesh and points are.
  Similarity3 Centred(const Similarity3& guess, const Mesh& mesh) const {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
    double area = 0, spread = 0, points_spread = 0;
    const auto each = [&](auto&& use) {
      for (const auto& f : mesh.faces) {
        const auto v = [&](std::size_t k) -> const Eigen::Vector3d& {
          return mesh.vertices[static_cast<std::size_t>(f[k])];
        };
        use(Eigen::Vector3d((v(0) + v(1) + v(2)) / 3), (v(1) - v(0)).cross(v(2) - v(0)).norm());
      }
    };
    each([&](const Eigen::Vector3d& x, double a) {
      centre += a * x;
      area += a;
    });
    centre /= area;
    each([&](const Eigen::Vector3d& x, double a) { spread += a / area * (x - centre).norm(); });
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (const Eigen::Vector3d& p : points_) values.push_back(p[axis]);
      middle[axis] = Quantile(std::move(values), 0.5);
    }
    std::vector<double> distances;
    for (const Eigen::Vector3d& p : points_) distances.push_back((p - middle).norm());
    points_spread = Quantile(std::move(distances), 0.5);
    Similarity3 s = guess;
    if (spread > 0 && points_spread > 0) s.scale = points_spread / spread;
    s.translation = middle - s.scale * (s.rotation * centre);
    return s;
  }

 private:
  static constexpr std::size_t kFewest = 20;

  std::vector<Eigen::Vector3d> PointsNear(const Similarity3& scene_from_mesh) const {
    const Similarity3 mesh_from_scene = scene_from_mesh.Inverse();
    Eigen::AlignedBox3d box = body_.box;
    const Eigen::Vector3d around = Eigen::Vector3d::Constant(options_.reach * body_.diagonal);
    box.min() -= around;
    box.max() += around;
    std::vector<Eigen::Vector3d> near;
    for (const Eigen::Vector3d& p : points_)
      if (p.allFinite() && box.contains(mesh_from_scene * p)) near.push_back(p);
    if (near.size() <= options_.max_points) return near;
    std::vector<Eigen::Vector3d> picked;
    for (std::size_t i = 0; i < options_.max_points; ++i) picked.push_back(near[i * near.size() / options_.max_points]);
    return picked;
  }

  std::vector<Pair> Closest(const std::vector<Eigen::Vector3d>& near, const Similarity3& scene_from_mesh) const {
    const Similarity3 mesh_from_scene = scene_from_mesh.Inverse();
    std::vector<Pair> pairs(near.size());
    ParallelEach(near.size(), 64, [&](std::size_t i) {
      const MeshQuery::Nearest n = query_.NearestTo(mesh_from_scene * near[i]);
      pairs[i] = {near[i], scene_from_mesh * n.point, scene_from_mesh.rotation * n.normal, 0};
      pairs[i].squared = (pairs[i].point - pairs[i].nearest).squaredNorm();
    });
    return pairs;
  }

  // Nearly all at first: far from its place, a mesh would settle on its largest plane and let the rest go.
  double LeastShare(int iteration) const {
    constexpr int kHold = 10, kRelease = 30;
    constexpr double kFirst = 0.9;
    const double released = std::clamp(static_cast<double>(iteration - kHold) / (kRelease - kHold), 0.0, 1.0);
    return std::max(options_.min_overlap, kFirst + released * (options_.min_overlap - kFirst));
  }

  // Sorted by distance; how many of the first are fitted: those of the least rms / share^3. Distances that do
  // not count make no difference: a plane's points would else be preferred for rounding less.
  std::size_t Trim(std::vector<Pair>& pairs, double least_share, double scale) const {
    std::ranges::stable_sort(pairs, [](const Pair& a, const Pair& b) { return a.squared < b.squared; });
    const auto n = static_cast<double>(pairs.size());
    const auto fewest = static_cast<std::size_t>(std::ceil(least_share * n));
    const double none = std::pow(kExact * scale * body_.diagonal, 2);
    double sum = 0, best = std::numeric_limits<double>::infinity();
    std::size_t fitted = pairs.size();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      sum += pairs[i].squared;
      if (i + 1 < fewest) continue;
      const double share = static_cast<double>(i + 1) / n,
                   score = (sum / static_cast<double>(i + 1) + none) / std::pow(share, 6);
      if (score < best) {
        best = score;
        fitted = i + 1;
      }
    }
    return fitted;
  }

  void Evaluate(const std::vector<Pair>& pairs, std::size_t fitted, std::size_t near, IcpResult& r) const {
    double sum = 0;
    for (std::size_t i = 0; i < fitted; ++i) sum += pairs[i].squared;
    r.points = near;
    r.overlap = static_cast<double>(fitted) / static_cast<double>(near);
    r.rms = std::sqrt(sum / static_cast<double>(fitted));
    r.rms_of_diagonal = r.rms / (r.scene_from_mesh.scale * body_.diagonal);
  }

  // One Gauss-Newton step: turn, shift and logarithm of the scale about the fitted points' middle, lengths over the
  // mesh's diagonal. Returns how far it went.
  double Step(const std::vector<Pair>& pairs, std::size_t fitted, IcpResult& r) const {
    using Row = Eigen::Matrix<double, 7, 1>;
    using Square = Eigen::Matrix<double, 7, 7>;
    const double unit = r.scene_from_mesh.scale * body_.diagonal;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < fitted; ++i) centre += pairs[i].nearest / static_cast<double>(fitted);
    Square A = Square::Zero(), surface = Square::Zero();
    Row b = Row::Zero();
    const auto add = [&](const Eigen::Vector3d& along, const Eigen::Vector3d& y, double residual, double weight,
                         Square& to) {
      Row row;
      row << y.cross(along), along, along.dot(y);
      to += weight * row * row.transpose();
      b += weight * residual * row;
    };
    for (std::size_t i = 0; i < fitted; ++i) {
      const Eigen::Vector3d y = (pairs[i].nearest - centre) / unit, d = (pairs[i].point - pairs[i].nearest) / unit;
      add(pairs[i].normal, y, pairs[i].normal.dot(d), 1, surface);
      for (int axis = 0; axis < 3; ++axis) add(Eigen::Vector3d::Unit(axis), y, d[axis], kPointToPoint, A);
    }
    const Eigen::VectorXd values = EigenOfSymmetric(surface).values;
    r.weakest = values[6] > 0 ? std::max(0.0, values[0]) / values[6] : 0;
    A += surface;
    const Eigen::VectorXd x = SolveSymmetric(A, b);
    if (!x.allFinite()) return 0;
    Similarity3 step;
    const Eigen::Vector3d turn = x.head<3>();
    if (turn.norm() > 0) step.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
    step.scale = std::exp(std::clamp(x[6], -0.3, 0.3));
    step.translation = centre + unit * Eigen::Vector3d(x.segment<3>(3)) - step.scale * (step.rotation * centre);
    r.scene_from_mesh = step * r.scene_from_mesh;
    return x.norm();
  }

  MeshQuery query_;
  Body body_;
  const std::vector<Eigen::Vector3d>& points_;
  const IcpOptions& options_;
};

}  // namespace

IcpResult AlignByIcp(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, const Similarity3& guess,
                     const IcpOptions& options) {
  IcpResult none;
  none.scene_from_mesh = guess;
  if (mesh.faces.empty() || points.size() < 20) {
    none.why_not = mesh.faces.empty() ? "the mesh has no faces" : fmt::format("the scene has {} points", points.size());
    return none;
  }
  Aligner aligner(mesh, points, options);
  // A fit of nearly all points is right. With fewer, it may be the fit of one large plane, with the rest let go: other
  // sizes are tried, and place and size from where mesh and points are.
  constexpr double kNearlyAll = 0.85;
  const auto score = [](const IcpResult& r) {
    return r.converged ? (r.rms_of_diagonal * r.rms_of_diagonal + kExact * kExact) / std::pow(r.overlap, 6)
                       : 1 + std::min(r.rms_of_diagonal, 1e6);
  };
  IcpResult best = aligner.From(guess);
  const Similarity3 centred = aligner.Centred(guess, mesh);
  for (const Similarity3& start : {centred, Resized(guess, mesh, 0.8), Resized(centred, mesh, 0.8),
                                   Resized(guess, mesh, 1.25), Resized(centred, mesh, 1.25)}) {
    if (best.converged && best.overlap >= kNearlyAll) break;
    const IcpResult other = aligner.From(start);
    if (score(other) < score(best)) best = other;
  }
  return best;
}

}  // namespace lumi
