#include "scene/view_triangulation/view_triangulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/view_triangulation/lattice_delaunay.h"

namespace lumi {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kFinestLattice = 256;  // units a pixel: vertices move by at most 1/512 px

// A point in front of the camera that falls into what is triangulated.
struct Projected {
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();
  double kappa = 0;
  std::int32_t point = -1;
};

// The rectangle around the image, and its lattice.
struct Domain {
  Eigen::Vector2d low_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d extent_px = Eigen::Vector2d::Zero();
  double units = kFinestLattice;  // a pixel
  LatticePoint size;

  Domain(const Eigen::Vector2i& size_px, double margin) {
    const double around = margin * size_px.maxCoeff();
    low_px.setConstant(-around);
    extent_px = size_px.cast<double>().array() + 2 * around;
    while (extent_px.maxCoeff() * units > kMaxLattice) units /= 2;
    size = {static_cast<std::int32_t>(std::ceil(extent_px.x() * units)),
            static_cast<std::int32_t>(std::ceil(extent_px.y() * units))};
  }
  bool Holds(const Eigen::Vector2d& x_px) const {
    const Eigen::Vector2d at = (x_px - low_px) * units;
    return at.x() >= 0 && at.y() >= 0 && at.x() <= size.x && at.y() <= size.y;
  }
  LatticePoint At(const Eigen::Vector2d& x_px) const {
    const Eigen::Vector2d at = (x_px - low_px) * units;
    return {static_cast<std::int32_t>(std::lround(at.x())), static_cast<std::int32_t>(std::lround(at.y()))};
  }
  Eigen::Vector2d Pixel(const LatticePoint& p) const { return low_px + Eigen::Vector2d(p.x, p.y) / units; }
};

// From a pixel and its kappa to the point of P^3.
class InverseView {
 public:
  InverseView(const Matrix34d& P, const std::optional<Plane>& plane_at_infinity)
      : P_(P), centre_(CentreOfProjection(P)) {
    if (!P.allFinite() || !(centre_.norm() > 0.5)) throw std::invalid_argument("TriangulateView: P has no rank 3");
    // Where the plane at infinity holds the centre, or nothing is known of it: the plane that is farthest from the
    // centre. The nullspace of P is found by its minors, so that the test is one of rounding.
    const double floor = 1e6 * kEpsilon;
    plane_ = centre_;
    if (plane_at_infinity && std::abs(plane_at_infinity->dot(centre_)) > floor * plane_at_infinity->norm()) {
      plane_ = *plane_at_infinity;
      known_ = true;
    }
    at_centre_ = plane_.dot(centre_);
    finite_ = InverseOf(P.leftCols<3>(), floor);
    if (!finite_) gram_ = P * P.transpose();
  }
  bool Known() const { return known_; }
  double Kappa(const Eigen::Vector4d& X, double w) const { return plane_.dot(X) / w; }
  void TurnPlane() {
    plane_ = -plane_;
    at_centre_ = -at_centre_;
  }

  Eigen::Vector4d Point(const Eigen::Vector2d& x_px, double kappa) const {
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    if (finite_)
      b.head<3>() = *finite_ * x_px.homogeneous();  // the ray's own point at infinity: exact wherever the origin is
    else
      b = P_.transpose() * SolveSymmetric(gram_, Eigen::Vector3d(x_px.homogeneous()));
    return b + (kappa - plane_.dot(b)) / at_centre_ * centre_;
  }

 private:
  Matrix34d P_;
  Eigen::Vector4d centre_;
  Plane plane_;
  bool known_ = false;
  double at_centre_ = 1;
  std::optional<Eigen::MatrixXd> finite_;
  Eigen::Matrix3d gram_ = Eigen::Matrix3d::Zero();
};

// One point a cell of a grid: the first, or the nearest where depth has a sign.
std::vector<Projected> MergeNear(std::vector<Projected> points, const Domain& domain, double merge_px, bool nearest,
                                 std::size_t& merged) {
  const double cell = std::max(merge_px, 1 / domain.units);
  struct Cell {
    std::int64_t key;
    std::int32_t order;
  };
  std::vector<Cell> cells;
  cells.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d at = (points[i].x_px - domain.low_px) / cell;
    cells.push_back(
        {static_cast<std::int64_t>(at.y()) << 32 | static_cast<std::int64_t>(at.x()), static_cast<std::int32_t>(i)});
  }
  std::sort(cells.begin(), cells.end(), [&](const Cell& a, const Cell& b) {
    if (a.key != b.key) return a.key < b.key;
    if (nearest) {
      const double ka = points[static_cast<std::size_t>(a.order)].kappa,
                   kb = points[static_cast<std::size_t>(b.order)].kappa;
      if (ka != kb) return ka > kb;
    }
    return a.order < b.order;
  });
  std::vector<Projected> kept;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (i == 0 || cells[i].key != cells[i - 1].key) kept.push_back(points[static_cast<std::size_t>(cells[i].order)]);
  merged += points.size() - kept.size();
  return kept;
}

std::vector<LatticePoint> WithCorners(const Domain& domain, const std::vector<Projected>& points) {
  const LatticePoint s = domain.size;
  std::vector<LatticePoint> lattice{{0, 0}, {s.x, 0}, s, {0, s.y}};
  lattice.reserve(points.size() + 4);
  for (const Projected& p : points) lattice.push_back(domain.At(p.x_px));
  return lattice;
}

// Points that no neighbour in the image agrees with: wrong ones, and those of a surface behind the one that is seen
// there.
std::vector<Projected> WithoutOutliers(std::vector<Projected> points, const Domain& domain, double spread,
                                       std::size_t& outliers) {
  constexpr std::size_t kFewest = 8;  // fewer say nothing about each other
  if (points.size() < kFewest || !(spread < std::numeric_limits<double>::infinity())) return points;
  std::vector<double> kappas;
  for (const Projected& p : points) kappas.push_back(p.kappa);
  const double tolerance = spread * (Quantile(kappas, 0.9) - Quantile(kappas, 0.1));
  std::vector<int> neighbours(points.size(), 0), agree(points.size(), 0);
  for (const auto& t : TriangulateLattice(WithCorners(domain, points)))
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = t[k] - 4, b = t[(k + 1) % 3] - 4;
      if (a < 0 || b < 0) continue;
      const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
      const bool same = std::abs(points[i].kappa - points[j].kappa) <= tolerance;
      for (const std::size_t v : {i, j}) {
        ++neighbours[v];
        agree[v] += same;
      }
    }
  std::vector<Projected> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (agree[i] > 0 || neighbours[i] == 0) kept.push_back(points[i]);
  outliers += points.size() - kept.size();
  return kept;
}

// kappa at a pixel from the points near it: the plane through them, by weighted least squares that lean towards their
// mean as far as the points do not span a plane.
double Extended(const Eigen::Vector2d& x_px, const std::vector<Projected>& points, int count,
                std::vector<std::pair<double, std::size_t>>& order) {
  order.clear();
  for (std::size_t i = 0; i < points.size(); ++i) order.emplace_back((points[i].x_px - x_px).squaredNorm(), i);
  const std::size_t n = std::min(order.size(), static_cast<std::size_t>(count));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), order.end());
  // Centred on the nearest points' mean: their spread, not their distance from the sample, is what a slope is known
  // from.
  double weight = 0, kappa = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  const double scale = order[n - 1].first + 1;  // of squared distances, in square pixels
  const auto weigh = [&](std::size_t k) { return 1 / (order[k].first + 0.01 * scale); };
  for (std::size_t k = 0; k < n; ++k) {
    const double w = weigh(k);
    weight += w;
    kappa += w * points[order[k].second].kappa;
    mean += w * points[order[k].second].x_px;
  }
  kappa /= weight;
  mean /= weight;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < n; ++k) {
    const Projected& p = points[order[k].second];
    const Eigen::Vector2d d = p.x_px - mean;
    A += weigh(k) * d * d.transpose();
    b += weigh(k) * (p.kappa - kappa) * d;
  }
  A.diagonal().array() += 0.1 * weight * (x_px - mean).squaredNorm() + 1e-12;  // far from the points a slope is a guess
  const double determinant = A(0, 0) * A(1, 1) - A(0, 1) * A(1, 0);
  const Eigen::Vector2d slope((A(1, 1) * b[0] - A(0, 1) * b[1]) / determinant,
                              (A(0, 0) * b[1] - A(1, 0) * b[0]) / determinant);
  return kappa + slope.dot(x_px - mean);
}

}  // namespace

const char* Validate(const ViewTriangulationOptions& o) {
  if (!(o.margin >= 0 && o.margin <= 10)) return "margin must be in [0, 10]";
  if (o.border_samples < 1 || o.border_samples > 10000) return "border_samples must be 1 to 10000";
  if (o.extension_points < 1) return "extension_points must be at least 1";
  if (!(o.merge_px >= 0)) return "merge_px must be >= 0";
  if (!(o.outlier_spread >= 0)) return "outlier_spread must be >= 0";
  return nullptr;
}

ViewTriangulation TriangulateView(const Matrix34d& P, const Eigen::Vector2i& size_px,
                                  std::span<const Eigen::Vector4d> X, const std::optional<Plane>& plane_at_infinity,
                                  const ViewTriangulationOptions& options) {
  if (const char* wrong = Validate(options)) throw std::invalid_argument(wrong);
  if (size_px.minCoeff() < 1 || size_px.maxCoeff() > (1 << 20))
    throw std::invalid_argument("TriangulateView: the image has no size");
  InverseView view(P, plane_at_infinity);
  const Domain domain(size_px, options.margin);
  ViewTriangulation out;

  std::vector<Projected> points;
  points.reserve(X.size());
  int positive = 0;
  for (std::size_t i = 0; i < X.size(); ++i) {
    const Eigen::Vector3d x = P * X[i];
    const double nothing =
        16 * kEpsilon * P.row(2).cwiseAbs().dot(X[i].cwiseAbs());  // of rounding: on the principal plane
    if (!(x.z() > nothing) || !x.allFinite()) {
      ++out.behind;
      continue;
    }
    const Eigen::Vector2d x_px = x.head<2>() / x.z();
    if (!domain.Holds(x_px)) {
      ++out.outside;
      continue;
    }
    const double kappa = view.Kappa(X[i], x.z());
    positive += kappa > 0 ? 1 : -1;
    points.push_back({x_px, kappa, static_cast<std::int32_t>(i)});
  }
  if (positive < 0) {
    view.TurnPlane();
    for (Projected& p : points) p.kappa = -p.kappa;
  }
  if (view.Known()) {
    // At infinity and beyond it: points that noise, or a wrong track, has sent there.
    const auto beyond = std::remove_if(points.begin(), points.end(), [](const Projected& p) { return !(p.kappa > 0); });
    out.outliers += static_cast<std::size_t>(points.end() - beyond);
    points.erase(beyond, points.end());
  }
  points = MergeNear(std::move(points), domain, options.merge_px, view.Known(), out.merged);
  points = WithoutOutliers(std::move(points), domain, options.outlier_spread, out.outliers);
  if (points.empty()) return out;
  out.used = points.size();

  // The border: its corners, and samples between them.
  const auto [least, most] = std::minmax_element(
      points.begin(), points.end(), [](const Projected& a, const Projected& b) { return a.kappa < b.kappa; });
  const double least_kappa = least->kappa, most_kappa = most->kappa;
  const LatticePoint s = domain.size;
  const double step = static_cast<double>(std::max(s.x, s.y)) / options.border_samples;
  std::vector<LatticePoint> lattice{{0, 0}, {s.x, 0}, s, {0, s.y}};
  for (std::size_t side = 0; side < 4; ++side) {
    const LatticePoint from = lattice[side], to = lattice[(side + 1) % 4];
    const int pieces =
        std::max(1, static_cast<int>(std::lround(std::max(std::abs(to.x - from.x), std::abs(to.y - from.y)) / step)));
    for (int k = 1; k < pieces; ++k)
      lattice.push_back({static_cast<std::int32_t>(from.x + (std::int64_t{to.x} - from.x) * k / pieces),
                         static_cast<std::int32_t>(from.y + (std::int64_t{to.y} - from.y) * k / pieces)});
  }
  const std::size_t border = lattice.size();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < border; ++i) {
    out.x_px.push_back(domain.Pixel(lattice[i]));
    // Extrapolation is clamped to the range of kappa that the points have.
    out.kappa.push_back(
        std::clamp(Extended(out.x_px.back(), points, options.extension_points, order), least_kappa, most_kappa));
    out.point.push_back(-1);
  }
  // Points stay off the border, whose samples are there already.
  for (const Projected& p : points) {
    LatticePoint at = domain.At(p.x_px);
    at = {std::clamp(at.x, std::min(1, s.x - 1), s.x - 1), std::clamp(at.y, std::min(1, s.y - 1), s.y - 1)};
    lattice.push_back(at);
    out.x_px.push_back(domain.Pixel(at));
    out.kappa.push_back(p.kappa);
    out.point.push_back(p.point);
  }
  out.vertices.reserve(lattice.size());
  for (std::size_t i = 0; i < lattice.size(); ++i) out.vertices.push_back(view.Point(out.x_px[i], out.kappa[i]));
  out.triangles = TriangulateLattice(lattice);
  for (auto& t : out.triangles) std::swap(t[1], t[2]);  // x right, y down, z forward: a positive turn shows its back
  return out;
}

Plane PlaneOfTriangle(const ViewTriangulation& triangulation, std::size_t triangle, const Eigen::Vector4d& C) {
  // The rows' minors, as CentreOfProjection has them of three planes: the dual.
  Matrix34d rows;
  for (int k = 0; k < 3; ++k)
    rows.row(k) =
        triangulation.vertices[static_cast<std::size_t>(triangulation.triangles[triangle][static_cast<std::size_t>(k)])]
            .normalized()
            .transpose();
  const Plane plane = CentreOfProjection(rows);
  return plane.dot(C) < 0 ? Plane(-plane) : plane;
}

Mesh MeshOf(const ViewTriangulation& triangulation) {
  Mesh mesh;
  std::vector<std::int32_t> index(triangulation.vertices.size(), -1);
  for (std::size_t i = 0; i < triangulation.vertices.size(); ++i) {
    const Eigen::Vector4d& X = triangulation.vertices[i];
    const Eigen::Vector3d x = X.head<3>() / X.w();
    if (!(X.w() > 0) || !x.allFinite()) continue;
    index[i] = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(x);
  }
  for (const auto& t : triangulation.triangles) {
    std::array<std::int32_t, 3> face{};
    for (std::size_t k = 0; k < 3; ++k) face[k] = index[static_cast<std::size_t>(t[k])];
    if (face[0] >= 0 && face[1] >= 0 && face[2] >= 0) mesh.faces.push_back(face);
  }
  return mesh;
}

Eigen::Vector4d Homogeneous(const Scene& scene, const Point& point) {
  return scene.frame == Frame::kMetric ? Eigen::Vector4d(point.x_in_world.homogeneous()) : point.X_in_world;
}

std::vector<std::int32_t> TrustedPoints(const Scene& scene) {
  constexpr double kMaxErrorPx = 4, kMinAngleCos = 0.99965732497555726;  // cos of 1.5 degrees
  constexpr std::size_t kEnough = 500;
  std::vector<Eigen::Vector3d> eyes;
  if (scene.frame == Frame::kMetric)
    for (const View& v : scene.views) eyes.push_back(v.CentreInWorld());
  struct Kept {
    std::size_t track;
    std::size_t point;
  };
  std::vector<Kept> kept;
  std::size_t three = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Point& p = scene.points[i];
    const bool finite = scene.frame == Frame::kMetric ? p.x_in_world.allFinite() : p.X_in_world.allFinite();
    if (!finite || p.track.size() < 2 || !(p.error_px <= kMaxErrorPx)) continue;
    if (scene.frame == Frame::kMetric) {
      // The widest pair: from the first ray to the farthest, and from that to its farthest.
      const auto ray = [&](std::size_t k) {
        return Eigen::Vector3d((eyes[static_cast<std::size_t>(p.track[k].view.value)] - p.x_in_world).normalized());
      };
      std::size_t at = 0;
      double cosine = 1;
      for (int round = 0; round < 2; ++round) {
        const Eigen::Vector3d from = ray(at);
        for (std::size_t k = 0; k < p.track.size(); ++k)
          if (const double c = from.dot(ray(k)); c < cosine) {
            cosine = c;
            at = k;
          }
      }
      if (!(cosine <= kMinAngleCos)) continue;
    }
    three += p.track.size() >= 3;
    kept.push_back({p.track.size(), i});
  }
  if (three >= kEnough)
    kept.erase(std::remove_if(kept.begin(), kept.end(), [](const Kept& k) { return k.track < 3; }), kept.end());
  std::stable_sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) { return a.track > b.track; });
  std::vector<std::int32_t> points;
  points.reserve(kept.size());
  for (const Kept& k : kept) points.push_back(static_cast<std::int32_t>(k.point));
  return points;
}

std::vector<Eigen::Vector4d> StructurePoints(const Scene& scene) {
  std::vector<Eigen::Vector4d> X;
  for (const std::int32_t i : TrustedPoints(scene))
    X.push_back(Homogeneous(scene, scene.points[static_cast<std::size_t>(i)]));
  return X;
}

std::optional<Plane> PlaneAtInfinity(const Scene& scene) {
  if (scene.frame == Frame::kMetric) return Plane(0, 0, 0, 1);
  if (scene.plane_at_infinity) return scene.plane_at_infinity;
  if (scene.frame == Frame::kQuasiAffine) return Plane(0, 0, 0, 1);
  return std::nullopt;
}

}  // namespace lumi
