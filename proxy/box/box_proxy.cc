#include "proxy/box/box_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr std::size_t kLeastPoints = 12;
// A wall is one where this share of all points lies on it; else its points are an accident.
constexpr double kLeastWallShare = 0.02;
// The frame's angle about the axis is free where the scene has no up: it is tried in steps that the fit can bridge.
constexpr int kRolls = 18;  // over a right angle
constexpr int kFitRounds = 12;
constexpr double kWideTolerance = 4;  // the first round's, in tolerances

struct Fit {
  Eigen::Matrix3d frame;           // rows: right, down, along
  std::array<double, 4> offset{};  // left, right (along row 0), upper, lower (along row 1)
  std::array<bool, 4> found{};
  double score = -1;
};

int AxisOf(int wall) { return wall / 2; }

struct Cloud {
  std::vector<Eigen::Vector3d> x;       // relative to the mean camera
  std::vector<Eigen::Vector3d> camera;  // likewise
};

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void Add(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

Range CameraRange(const Cloud& cloud, const Eigen::RowVector3d& axis) {
  Range r;
  for (const Eigen::Vector3d& c : cloud.camera) r.Add(axis * c);
  return r;
}

// Half the width that the points take up across the axis.
double HalfWidth(const Cloud& cloud, const Eigen::Matrix3d& frame) {
  std::vector<double> away;
  for (const Eigen::Vector3d& x : cloud.x) away.push_back((frame.topRows<2>() * x).cwiseAbs().maxCoeff());
  return Quantile(std::move(away), 0.75);
}

// The distance at which most points lie within `tolerance`, outside of all cameras, and how many: a window slides over
// the sorted values.
std::size_t DensestWall(std::vector<double> values, double beyond, double tolerance, double* offset) {
  std::erase_if(values, [&](double v) { return v <= beyond; });
  std::ranges::sort(values);
  std::size_t best = 0, best_begin = 0;
  for (std::size_t i = 0, j = 0; j < values.size(); ++j) {
    while (values[j] - values[i] > 2 * tolerance) ++i;
    if (j - i + 1 > best) best = j - i + 1, best_begin = i;
  }
  if (best > 0) *offset = values[best_begin + best / 2];
  return best;
}

// The wall with most points first; its points are then no other's: a wall of doors and posters has points at every
// height.
void PlaceWalls(const Cloud& cloud, double tolerance, Fit& fit) {
  const auto least =
      std::max<std::size_t>(3, static_cast<std::size_t>(kLeastWallShare * static_cast<double>(cloud.x.size())));
  std::vector<Eigen::Vector3d> left = cloud.x;
  fit.found = {};
  for (int round = 0; round < 4; ++round) {
    int most = -1;
    std::size_t count = least;
    for (int wall = 0; wall < 4; ++wall) {
      const auto w = static_cast<std::size_t>(wall);
      if (fit.found[w]) continue;
      const double side = wall % 2 ? 1 : -1;
      const Eigen::RowVector3d axis = side * fit.frame.row(AxisOf(wall));
      std::vector<double> values;
      for (const Eigen::Vector3d& x : left) values.push_back(axis * x);
      const std::size_t n = DensestWall(values, CameraRange(cloud, axis).high, tolerance, &fit.offset[w]);
      if (n == 0) fit.offset[w] = Quantile(values, 0.98);
      fit.offset[w] *= side;
      if (n >= count) most = wall, count = n;
    }
    if (most < 0) break;
    fit.found[static_cast<std::size_t>(most)] = true;
    std::erase_if(left, [&](const Eigen::Vector3d& x) {
      return std::abs(fit.frame.row(AxisOf(most)) * x - fit.offset[static_cast<std::size_t>(most)]) <= tolerance;
    });
  }
  // Where no wall stands out, the space ends where the points do.
  for (int wall = 0; wall < 4; ++wall) {
    const auto w = static_cast<std::size_t>(wall);
    if (fit.found[w]) continue;
    const double side = wall % 2 ? 1 : -1;
    std::vector<double> values;
    for (const Eigen::Vector3d& x : cloud.x) values.push_back(side * fit.frame.row(AxisOf(wall)) * x);
    fit.offset[w] = side * Quantile(values, 0.98);
  }
}

// The wall that x is near to, or -1; its signed distance.
int NearestWall(const Fit& fit, const Eigen::Vector3d& x, double tolerance, double* distance) {
  int best = -1;
  *distance = tolerance;
  for (int wall = 0; wall < 4; ++wall) {
    const auto w = static_cast<std::size_t>(wall);
    if (!fit.found[w]) continue;
    const double d = fit.frame.row(AxisOf(wall)) * x - fit.offset[w];
    if (std::abs(d) < std::abs(*distance)) best = wall, *distance = d;
  }
  return best;
}

// Gauss-Newton on three angles and four distances, the tolerance shrinking to its end.
void Refine(const Cloud& cloud, double tolerance, Fit& fit) {
  for (int round = 0; round < kFitRounds; ++round) {
    const double within = tolerance * std::max(1.0, kWideTolerance * (1 - round / (0.5 * kFitRounds)));
    Eigen::Matrix<double, 7, 7> A = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> g = Eigen::Matrix<double, 7, 1>::Zero();
    double spread = 0;
    for (const Eigen::Vector3d& x : cloud.x) {
      double d;
      const int wall = NearestWall(fit, x, within, &d);
      if (wall < 0) continue;
      // A turn w of the points changes n.x by (x cross n).w; Tukey's weight ends at the tolerance.
      Eigen::Matrix<double, 7, 1> J = Eigen::Matrix<double, 7, 1>::Zero();
      J.head<3>() = x.cross(Eigen::Vector3d(fit.frame.row(AxisOf(wall)).transpose()));
      J[3 + wall] = -1;
      const double u = d / within, weight = (1 - u * u) * (1 - u * u);
      A.noalias() += weight * J * J.transpose();
      g.noalias() += weight * d * J;
      spread += x.squaredNorm();
    }
    // What no point speaks of (a wall that is missing, the turn about the only wall's normal) stays as it is.
    A.diagonal().head<3>().array() += 1e-9 * std::max(spread, 1e-300);
    A.diagonal().tail<4>().array() += 1e-9;
    const Eigen::Matrix<double, 7, 1> step = -SolveSymmetric(A, g);
    if (!step.allFinite()) return;
    const Eigen::Vector3d turn = step.head<3>();
    if (turn.norm() > 0) fit.frame = fit.frame * Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    for (int wall = 0; wall < 4; ++wall) fit.offset[static_cast<std::size_t>(wall)] += step[3 + wall];
  }
}

double Score(const Cloud& cloud, const Fit& fit, double tolerance) {
  double score = 0;
  for (const Eigen::Vector3d& x : cloud.x) {
    double d;
    if (NearestWall(fit, x, tolerance, &d) >= 0) score += 1 - (d / tolerance) * (d / tolerance);
  }
  return score;
}

// Directions that the tube may run along: the path's, the views'.
std::vector<Eigen::Vector3d> Axes(const Cloud& cloud, const std::vector<ProxyView>& views) {
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  for (const ProxyView& v : views) forward += v.forward / static_cast<double>(views.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& c : cloud.camera) scatter += c * c.transpose();
  std::vector<Eigen::Vector3d> axes;
  const SymmetricEigen eigen = EigenOfSymmetric(scatter);
  if (eigen.values[2] > 4 * eigen.values[1] && eigen.values[2] > 0) {
    Eigen::Vector3d path = eigen.vectors.col(2);
    if (path.dot(forward) < 0) path = -path;
    axes.push_back(path);
  }
  if (forward.norm() > 0.1) axes.push_back(forward.normalized());
  return axes;
}

Eigen::Matrix3d TubeFrame(const Eigen::Vector3d& along, const Eigen::Vector3d& about_down, double roll_rad) {
  const Eigen::Vector3d down = (about_down - about_down.dot(along) * along).normalized(), right = down.cross(along);
  Eigen::Matrix3d frame;
  frame.row(0) = std::cos(roll_rad) * right + std::sin(roll_rad) * down;
  frame.row(1) = -std::sin(roll_rad) * right + std::cos(roll_rad) * down;
  frame.row(2) = along;
  return frame;
}

struct Tube {
  Fit fit;
  double tolerance = 0;
};

// The frame and walls that most points agree with, over the axes and the turns about them.
Tube FitTube(const Cloud& cloud, const std::vector<Eigen::Vector3d>& axes, const Eigen::Vector3d& down,
             double relative_tolerance) {
  Tube best;
  for (const Eigen::Vector3d& along : axes) {
    const Eigen::Vector3d about_down = down.cross(along).norm() > 1e-3 * down.norm() ? down : along.unitOrthogonal();
    for (int i = 0; i < kRolls; ++i) {
      // From the cameras' own down outwards: a tie goes to the frame nearest to it.
      const int step = (i + 1) / 2 * (i % 2 ? 1 : -1);
      Fit fit;
      fit.frame = TubeFrame(along, about_down, step * M_PI / 2 / kRolls);
      const double tolerance = relative_tolerance * HalfWidth(cloud, fit.frame);
      if (!(tolerance > 0)) continue;
      PlaceWalls(cloud, kWideTolerance / 2 * tolerance, fit);
      Refine(cloud, tolerance, fit);
      PlaceWalls(cloud, tolerance, fit);
      Refine(cloud, tolerance, fit);
      fit.score = Score(cloud, fit, tolerance);
      if (fit.score > 1.02 * best.fit.score) best = {fit, tolerance};
    }
  }
  if (best.fit.score < 0)
    throw DataError("all points lie on the cameras' own line: a box has no width", "lumi-proxy plane");
  return best;
}

// The same walls in the frame nearest to the cameras' own: down is down.
void StandUpright(const Eigen::Vector3d& down, Fit& fit) {
  if (std::abs(fit.frame.row(0) * down) > std::abs(fit.frame.row(1) * down)) {
    fit.frame.row(0).swap(fit.frame.row(1));
    for (std::size_t side : {0, 1}) {
      std::swap(fit.offset[side], fit.offset[side + 2]);
      std::swap(fit.found[side], fit.found[side + 2]);
    }
  }
  for (const int row : {1, 0}) {
    const bool turn = row == 1 ? fit.frame.row(1) * down < 0 : fit.frame.determinant() < 0;
    if (!turn) continue;
    fit.frame.row(row) *= -1.0;
    const auto low = static_cast<std::size_t>(2 * row);
    fit.offset[low] *= -1;
    fit.offset[low + 1] *= -1;
    std::swap(fit.offset[low], fit.offset[low + 1]);
    std::swap(fit.found[low], fit.found[low + 1]);
  }
}

// From the first camera or wall to the last, in the box's frame; every camera inside, with room.
Eigen::AlignedBox3d ExtentOf(const Cloud& cloud, const Tube& tube, const BoxOptions& options) {
  const Fit& fit = tube.fit;
  std::vector<double> along;
  for (const Eigen::Vector3d& x : cloud.x) {
    double d;  // what is seen through a window is not the tube's length
    if (NearestWall(fit, x, tube.tolerance, &d) >= 0) along.push_back(fit.frame.row(2) * x);
  }
  const Range path = CameraRange(cloud, fit.frame.row(2));
  Eigen::Vector3d low(fit.offset[0], fit.offset[2], path.low);
  Eigen::Vector3d high(fit.offset[1], fit.offset[3], std::max(Quantile(along, options.end_quantile), path.high));
  const double width = std::max((high - low).head<2>().maxCoeff(), 1e-12);
  for (int k = 0; k < 3; ++k) {
    const Range cameras = CameraRange(cloud, fit.frame.row(k));
    const double room = options.margin * (k == 2 ? std::max(width, high.z() - low.z()) : width);
    low[k] = std::min(low[k], cameras.low - room);
    high[k] = std::max(high[k], cameras.high + room);
  }
  return {low, high};
}

BoxSummary Summarize(const Cloud& cloud, const Tube& tube, const Eigen::AlignedBox3d& box) {
  BoxSummary s{.box_from_world = tube.fit.frame, .low = box.min(), .high = box.max(), .points = cloud.x.size()};
  for (const Eigen::Vector3d& x : cloud.x) {
    double d;
    const int wall = NearestWall(tube.fit, x, tube.tolerance, &d);
    if (wall < 0) continue;
    ++s.wall_points[static_cast<std::size_t>(wall)];
    s.wall_rms[static_cast<std::size_t>(wall)] += d * d;
    ++s.points_on_walls;
  }
  for (std::size_t w = 0; w < 4; ++w)
    if (s.wall_points[w] > 0) s.wall_rms[w] = std::sqrt(s.wall_rms[w] / static_cast<double>(s.wall_points[w]));
  return s;
}

}  // namespace

std::string Validate(const BoxOptions& options) {
  if (options.sides < 4 || options.sides > 6)
    return "--sides takes 4 (open at both ends), 5 (open behind the cameras) or 6";
  if (!(options.tolerance > 0 && options.tolerance <= 0.5)) return "the walls' tolerance must lie in (0, 0.5]";
  if (!(options.end_quantile > 0 && options.end_quantile <= 1)) return "end_quantile must lie in (0, 1]";
  if (!(options.margin >= 0 && options.margin <= 1)) return "margin must lie in [0, 1]";
  return {};
}

Mesh BuildBoxProxy(const Scene& scene, const BoxOptions& options, BoxSummary* summary) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  const std::vector<ProxyPoint> points = SelectPoints(scene, views, options.points).points;
  if (points.size() < kLeastPoints)
    throw DataError("too few reliable points for a box: " + std::to_string(points.size()) + " of " +
                        std::to_string(scene.points.size()),
                    "lumi-proxy plane needs none");
  // Relative to the cameras: it does not matter where the world's origin is.
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  for (const ProxyView& v : views) eye += v.render.centre / static_cast<double>(views.size());
  Cloud cloud;
  for (const ProxyPoint& p : points) cloud.x.push_back(p.x_in_world - eye);
  for (const ProxyView& v : views) cloud.camera.push_back(v.render.centre - eye);

  const std::vector<Eigen::Vector3d> axes = Axes(cloud, views);
  if (axes.empty())
    throw DataError("the cameras neither travel nor look in one direction: a box has no axis",
                    "lumi-proxy delaunay, or import a mesh (lumi-proxy import)");
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) down += view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();

  Tube tube = FitTube(cloud, axes, down, options.tolerance);
  StandUpright(down, tube.fit);
  const Eigen::AlignedBox3d box = ExtentOf(cloud, tube, options);

  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    // Eigen counts corners as this does: bit 0 for x, 1 for y, 2 for z.
    const Eigen::Vector3d c = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    mesh.vertices.push_back(eye + tube.fit.frame.transpose() * c);
  }
  // Counter-clockwise for who stands inside.
  std::vector<std::array<std::int32_t, 4>> quads{{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}};
  if (options.sides >= 5) quads.push_back({4, 6, 7, 5});
  if (options.sides == 6) quads.push_back({0, 1, 3, 2});
  for (const auto& q : quads) {
    mesh.faces.push_back({q[0], q[1], q[2]});
    mesh.faces.push_back({q[0], q[2], q[3]});
  }
  if (summary) *summary = Summarize(cloud, tube, box);
  return mesh;
}

}  // namespace lumi
