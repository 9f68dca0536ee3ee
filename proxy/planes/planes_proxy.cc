#include "proxy/planes/planes_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>

#include "proxy/mesh_query.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/constants.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr std::size_t kLeastPlanePoints = 12;
constexpr int kLocalDraws = 24;          // a sample's second and third point are the nearest of so many
constexpr double kSideShare = 0.9;       // a plane with this share of its points on one side of another is cut there
constexpr double kBoundaryShare = 0.97;  // a plane with this share of all points on its cameras' side bounds the scene
constexpr double kMergedShare = 0.85;    // of the points of both that the merged plane must keep
constexpr double kSeenThrough =
    0.5;  // lines of sight that a plane blocks over those that end on it: beyond, there is no plane
constexpr double kTukeyPerMedian = 4.685 * kSigmaPerMad;  // 95 % efficient where the scatter is normal
constexpr double kExtentMargin = 0.05;
constexpr double kEmptyShare = 0.02;        // of the views' rays: beyond, a backdrop is wanted
constexpr double kBackdropQuantile = 0.98;  // of the points' depths

using Polygon = std::vector<Eigen::Vector3d>;

struct Cloud3 {
  std::vector<Eigen::Vector3d> x;  // relative to the mean camera
  std::vector<double> reach;       // within which a plane explains the point
};

double SignedDistance(const FittedPlane& plane, const Eigen::Vector3d& x) { return plane.normal.dot(x) - plane.offset; }

// Least squares by Tukey's weights that end at `scale` reaches; false where the points have no plane.
bool FitWithin(const Cloud3& cloud, const std::vector<std::int32_t>& among, double scale, FittedPlane& plane) {
  for (int round = 0; round < 6; ++round) {
    double sum = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    const auto weight = [&](std::size_t i) {
      const double u = SignedDistance(plane, cloud.x[i]) / (scale * cloud.reach[i]);
      return std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) / (cloud.reach[i] * cloud.reach[i]) : 0.0;
    };
    for (const std::int32_t k : among) {
      const auto i = static_cast<std::size_t>(k);
      const double w = weight(i);
      sum += w;
      mean += w * cloud.x[i];
    }
    if (!(sum > 0)) return false;
    mean /= sum;
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const std::int32_t k : among) {
      const auto i = static_cast<std::size_t>(k);
      scatter += weight(i) / sum * (cloud.x[i] - mean) * (cloud.x[i] - mean).transpose();
    }
    const SymmetricEigen eigen = EigenOfSymmetric(scatter);
    if (!(eigen.values[1] > 1e-6 * eigen.values[2])) return false;  // a line
    Eigen::Vector3d normal = eigen.vectors.col(0);
    if (normal.dot(plane.normal) < 0) normal = -normal;
    plane.normal = normal;
    plane.offset = normal.dot(mean);
  }
  return true;
}

// Then once more by the scatter that the points have, where that is less: what stands on a ground is not to lift it.
bool RefitPlane(const Cloud3& cloud, const std::vector<std::int32_t>& among, FittedPlane& plane) {
  if (!FitWithin(cloud, among, 1, plane)) return false;
  for (int round = 0; round < 3; ++round) {
    std::vector<double> off;
    for (const std::int32_t k : among) {
      const auto i = static_cast<std::size_t>(k);
      const double u = std::abs(SignedDistance(plane, cloud.x[i])) / cloud.reach[i];
      if (u < 1) off.push_back(u);
    }
    const double scale = kTukeyPerMedian * Quantile(std::move(off), 0.5);
    FittedPlane finer = plane;
    if (!(scale > 1e-9 && scale < 1) || !FitWithin(cloud, among, scale, finer)) break;
    plane = finer;
  }
  return true;
}

void TakePoints(const Cloud3& cloud, const std::vector<std::int32_t>& among, FittedPlane& plane) {
  plane.points.clear();
  double sum = 0;
  for (const std::int32_t k : among) {
    const double d = SignedDistance(plane, cloud.x[static_cast<std::size_t>(k)]);
    if (std::abs(d) >= cloud.reach[static_cast<std::size_t>(k)]) continue;
    plane.points.push_back(k);
    sum += d * d;
  }
  plane.rms = plane.points.empty() ? 0 : std::sqrt(sum / static_cast<double>(plane.points.size()));
}

// A plane stands out: in a cloud without one, the best holds half as many points as the layers of its thickness beside
// it, which are twice as thick.
bool FindPlane(const Cloud3& cloud, const std::vector<std::int32_t>& left, const PlanesOptions& options,
               std::size_t least, std::mt19937_64& random, FittedPlane* found) {
  if (left.size() < least) return false;
  const auto draw = [&] { return left[static_cast<std::size_t>(random() % left.size())]; };
  double best = 0;
  for (int trial = 0; trial < options.trials; ++trial) {
    const Eigen::Vector3d a = cloud.x[static_cast<std::size_t>(draw())];
    // Points near one another lie in one plane more often than any three.
    std::array<std::int32_t, kLocalDraws> near;
    for (auto& k : near) k = draw();
    const auto distance2 = [&](std::int32_t k) { return (cloud.x[static_cast<std::size_t>(k)] - a).squaredNorm(); };
    std::partial_sort(near.begin(), near.begin() + kLocalDraws / 4, near.end(),
                      [&](auto i, auto j) { return distance2(i) < distance2(j); });
    const Eigen::Vector3d b = cloud.x[static_cast<std::size_t>(near[random() % (kLocalDraws / 4)])],
                          c = cloud.x[static_cast<std::size_t>(near[random() % (kLocalDraws / 4)])];
    FittedPlane plane;
    plane.normal = (b - a).cross(c - a);
    const double n = plane.normal.norm();
    if (!(n > 1e-6 * (b - a).norm() * (c - a).norm()) || n == 0) continue;
    plane.normal /= n;
    plane.offset = plane.normal.dot(a);
    double score = 0;
    for (const std::int32_t k : left) {
      const double u =
          SignedDistance(plane, cloud.x[static_cast<std::size_t>(k)]) / cloud.reach[static_cast<std::size_t>(k)];
      if (std::abs(u) < 1) score += 1 - u * u;
    }
    if (score > best) best = score, *found = plane;
  }
  if (!(best > 0) || !RefitPlane(cloud, left, *found)) return false;
  TakePoints(cloud, left, *found);
  if (found->points.size() < least) return false;
  std::size_t beside = 0;
  for (const std::int32_t k : left) {
    const auto i = static_cast<std::size_t>(k);
    const double u = std::abs(SignedDistance(*found, cloud.x[i])) / cloud.reach[i];
    beside += u >= 1 && u < 3;
  }
  return found->points.size() >= beside;
}

void MergeLikePlanes(const Cloud3& cloud, const PlanesOptions& options, std::vector<FittedPlane>& planes) {
  const double least_cosine = std::cos(options.merge_angle_deg * kRadPerDeg);
  for (std::size_t i = 0; i < planes.size(); ++i)
    for (std::size_t j = i + 1; j < planes.size();) {
      FittedPlane both = planes[i];
      std::vector<std::int32_t> among = planes[i].points;
      among.insert(among.end(), planes[j].points.begin(), planes[j].points.end());
      const bool like =
          std::abs(planes[i].normal.dot(planes[j].normal)) >= least_cosine && RefitPlane(cloud, among, both);
      if (like) TakePoints(cloud, among, both);
      if (like && static_cast<double>(both.points.size()) >= kMergedShare * static_cast<double>(among.size())) {
        planes[i] = std::move(both);
        planes.erase(planes.begin() + static_cast<std::ptrdiff_t>(j));
        j = i + 1;
      } else {
        ++j;
      }
    }
}

// The part of a convex polygon on the positive side of a plane.
Polygon ClipPolygon(const Polygon& polygon, const Eigen::Vector3d& normal, double offset) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = normal.dot(a) - offset, db = normal.dot(b) - offset;
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + da / (da - db) * (b - a));
  }
  return kept;
}

// Axes in a plane: along the mean image's where that is possible, so that rectangles are small.
std::pair<Eigen::Vector3d, Eigen::Vector3d> AxesIn(const FittedPlane& plane, const Eigen::Vector3d& right) {
  Eigen::Vector3d u = right - right.dot(plane.normal) * plane.normal;
  if (!(u.norm() > 1e-3)) u = plane.normal.unitOrthogonal();
  u.normalize();
  return {u, plane.normal.cross(u)};
}

Polygon Rectangle3(const FittedPlane& plane, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                   Eigen::AlignedBox2d e) {
  const Eigen::Vector2d margin = kExtentMargin * e.sizes(), low = e.min() - margin, high = e.max() + margin;
  const Eigen::Vector3d origin = plane.offset * plane.normal;
  return {origin + low.x() * u + low.y() * v, origin + high.x() * u + low.y() * v, origin + high.x() * u + high.y() * v,
          origin + low.x() * u + high.y() * v};
}

struct Frusta {
  std::vector<Eigen::Vector3d> centre, ray;  // a pair a corner (and edge middle) of a view, relative to the mean camera
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double far = 0;
};

// What the views see of the plane, as a rectangle.
Polygon SeenRectangle(const FittedPlane& plane, const Frusta& frusta) {
  const auto [u, v] = AxesIn(plane, frusta.right);
  Eigen::AlignedBox2d extent;
  for (std::size_t i = 0; i < frusta.ray.size(); ++i) {
    const double approach = -plane.normal.dot(frusta.ray[i]), height = SignedDistance(plane, frusta.centre[i]);
    const double t = approach > 0 && height > 0 ? std::min(height / approach, frusta.far) : frusta.far;
    const Eigen::Vector3d hit = frusta.centre[i] + t * frusta.ray[i];
    extent.extend(Eigen::Vector2d(u.dot(hit), v.dot(hit)));
  }
  return Rectangle3(plane, u, v, extent);
}

// The rectangle of the plane's own points, 1 % of them left out on each side.
Polygon PointsRectangle(const Cloud3& cloud, const FittedPlane& plane, const Frusta& frusta) {
  const auto [u, v] = AxesIn(plane, frusta.right);
  std::vector<double> us, vs;
  for (const std::int32_t k : plane.points) {
    us.push_back(u.dot(cloud.x[static_cast<std::size_t>(k)]));
    vs.push_back(v.dot(cloud.x[static_cast<std::size_t>(k)]));
  }
  Eigen::AlignedBox2d extent;
  extent.extend(Eigen::Vector2d(Quantile(us, 0.01), Quantile(vs, 0.01)));
  extent.extend(Eigen::Vector2d(Quantile(us, 0.99), Quantile(vs, 0.99)));
  return Rectangle3(plane, u, v, extent);
}

// Does everything lie on the plane or on its cameras' side?
bool BoundsTheScene(const Cloud3& cloud, const FittedPlane& plane) {
  std::size_t inside = 0;
  for (std::size_t i = 0; i < cloud.x.size(); ++i) inside += SignedDistance(plane, cloud.x[i]) > -2 * cloud.reach[i];
  return static_cast<double>(inside) >= kBoundaryShare * static_cast<double>(cloud.x.size());
}

bool InPolygon(const Polygon& polygon, const Eigen::Vector3d& normal, const Eigen::Vector3d& x) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((b - a).cross(x - a).dot(normal) < 0) return false;
  }
  return polygon.size() >= 3;
}

// Is a plane amid the scene one that cameras look through? Lines of sight that it would block against those that end on
// it.
bool SeenThrough(const Cloud3& cloud, const std::vector<ProxyPoint>& points, const std::vector<Eigen::Vector3d>& camera,
                 const FittedPlane& plane, const Frusta& frusta) {
  const Polygon polygon = PointsRectangle(cloud, plane, frusta);
  std::size_t through = 0, on = 0;
  for (const std::int32_t k : plane.points) on += points[static_cast<std::size_t>(k)].views.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double end = SignedDistance(plane, cloud.x[i]);
    if (std::abs(end) < 2 * cloud.reach[i]) continue;
    for (const std::int32_t v : points[i].views) {
      const Eigen::Vector3d& c = camera[static_cast<std::size_t>(v)];
      const double begin = SignedDistance(plane, c);
      if ((begin > 0) == (end > 0)) continue;
      through += InPolygon(polygon, plane.normal, c + begin / (begin - end) * (cloud.x[i] - c));
    }
  }
  return static_cast<double>(through) > kSeenThrough * static_cast<double>(on);
}

// +1: plane's points lie on `other`'s cameras' side; -1: on its far side; 0: on both.
int SideOf(const Cloud3& cloud, const FittedPlane& plane, const FittedPlane& other) {
  std::size_t front = 0, back = 0;
  for (const std::int32_t k : plane.points) {
    const auto i = static_cast<std::size_t>(k);
    const double d = SignedDistance(other, cloud.x[i]);
    if (std::abs(d) <= 2 * cloud.reach[i]) continue;  // at the crease: either
    ++(d > 0 ? front : back);
  }
  const double all = static_cast<double>(front + back);
  if (all == 0 || static_cast<double>(front) >= kSideShare * all) return 1;
  return static_cast<double>(back) >= kSideShare * all ? -1 : 0;
}

Mesh CutAndJoin(const Cloud3& cloud, const std::vector<FittedPlane>& planes, const Frusta& frusta) {
  Mesh mesh;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const bool far_reaching = planes[i].points.empty() || BoundsTheScene(cloud, planes[i]);
    Polygon polygon = far_reaching ? SeenRectangle(planes[i], frusta) : PointsRectangle(cloud, planes[i], frusta);
    for (std::size_t j = 0; j < planes.size(); ++j) {
      if (j == i) continue;
      // Another plane's rectangle amid the scene cuts nothing that bounds the scene.
      if (far_reaching && !planes[j].points.empty() && !BoundsTheScene(cloud, planes[j])) continue;
      const int side = SideOf(cloud, planes[i], planes[j]);
      if (side != 0) polygon = ClipPolygon(polygon, side * planes[j].normal, side * planes[j].offset);
    }
    if (polygon.size() < 3) continue;
    const auto first = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), polygon.begin(), polygon.end());
    for (std::int32_t k = 1; k + 1 < static_cast<std::int32_t>(polygon.size()); ++k)
      mesh.faces.push_back({first, first + k, first + k + 1});
  }
  return mesh;
}

void FaceTheCameras(const Frusta& frusta, FittedPlane& plane) {
  long front = 0;
  for (const Eigen::Vector3d& c : frusta.centre) front += SignedDistance(plane, c) > 0 ? 1 : -1;
  if (front >= 0) return;
  plane.normal = -plane.normal;
  plane.offset = -plane.offset;
}

void MoveBy(const Eigen::Vector3d& shift, FittedPlane& plane) { plane.offset += plane.normal.dot(shift); }

Frusta FrustaOf(const Scene& scene, const std::vector<ProxyView>& views, const Eigen::Vector3d& eye, double far) {
  Frusta frusta;
  frusta.far = far;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const RenderView& view = views[i].render;
    frusta.right += scene.views[i].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitX() /
                    static_cast<double>(views.size());
    for (const double x : {0.0, 0.5, 1.0})
      for (const double y : {0.0, 0.5, 1.0}) {
        const auto ray = RayDirection(view.P, {x * view.size_px.x(), y * view.size_px.y()});
        if (!ray) continue;
        frusta.centre.push_back(view.centre - eye);
        frusta.ray.push_back(ray->normalized());
      }
  }
  return frusta;
}

// Planes are found one after the other; then planes that one plane explains are merged, and planes that cameras look
// through are dropped.
std::vector<FittedPlane> FindPlanes(const Cloud3& cloud, const std::vector<ProxyPoint>& points,
                                    const std::vector<Eigen::Vector3d>& camera, const Frusta& frusta,
                                    const PlanesOptions& options) {
  std::vector<FittedPlane> planes;
  std::mt19937_64 random(options.seed);
  const auto least =
      std::max(kLeastPlanePoints, static_cast<std::size_t>(options.min_share * static_cast<double>(points.size())));
  std::vector<std::int32_t> left(points.size());
  std::iota(left.begin(), left.end(), 0);
  FittedPlane next;
  while (static_cast<int>(planes.size()) < options.max_planes &&
         FindPlane(cloud, left, options, least, random, &next)) {
    std::vector<std::int32_t> rest;
    std::ranges::set_difference(left, next.points, std::back_inserter(rest));
    left = std::move(rest);
    planes.push_back(next);
  }
  if (planes.empty())
    throw DataError(
        "no plane holds " + std::to_string(least) + " of the " + std::to_string(points.size()) + " reliable points",
        "lumi-proxy delaunay takes any shape");
  MergeLikePlanes(cloud, options, planes);
  for (FittedPlane& plane : planes) FaceTheCameras(frusta, plane);
  std::erase_if(planes, [&](const FittedPlane& p) {
    return !BoundsTheScene(cloud, p) && SeenThrough(cloud, points, camera, p, frusta);
  });
  if (planes.empty())
    throw DataError("what planes there are the cameras look through", "lumi-proxy delaunay takes any shape");
  return planes;
}

// Behind nearly all points, across the views' common direction.
FittedPlane BackdropOf(const Cloud3& cloud, const Eigen::Vector3d& forward, const Frusta& frusta) {
  FittedPlane backdrop;
  backdrop.normal = -forward.normalized();
  std::vector<double> along;
  for (const Eigen::Vector3d& x : cloud.x) along.push_back(-backdrop.normal.dot(x));
  backdrop.offset = -Quantile(along, kBackdropQuantile);
  FaceTheCameras(frusta, backdrop);
  return backdrop;
}

}  // namespace

std::string Validate(const PlanesOptions& options) {
  if (options.max_planes < 1 || options.max_planes > 100) return "--max-planes takes 1 to 100";
  if (!(options.tolerance > 0 && options.tolerance <= 0.5)) return "--tolerance must lie in (0, 0.5]";
  if (!(options.min_share > 0 && options.min_share <= 1)) return "--min-share must lie in (0, 1]";
  if (options.trials < 1) return "trials must be 1 or more";
  if (!(options.merge_angle_deg >= 0 && options.merge_angle_deg <= 90)) return "merge_angle_deg must lie in [0, 90]";
  if (!(options.far_factor > 1)) return "far_factor must be above 1";
  return {};
}

Mesh BuildPlanesProxy(const Scene& scene, const PlanesOptions& options, const std::vector<FittedPlane>& given,
                      PlanesSummary* summary) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  const std::vector<ProxyPoint> points = SelectPoints(scene, views, options.points).points;

  // Relative to the cameras: it does not matter where the world's origin is.
  Eigen::Vector3d eye = Eigen::Vector3d::Zero(), forward = Eigen::Vector3d::Zero();
  for (const ProxyView& v : views) {
    eye += v.render.centre / static_cast<double>(views.size());
    forward += v.forward;
  }
  std::vector<double> depths;
  for (const ProxyPoint& p : points)
    for (const std::int32_t v : p.views) depths.push_back(views[static_cast<std::size_t>(v)].DepthOf(p.x_in_world));
  const double depth = Quantile(depths, 0.5);
  if (!(depth > 0))
    throw DataError("no reliable point lies before the cameras: planes cannot be fitted or clipped",
                    "lumi-proxy plane needs none");
  Cloud3 cloud;
  for (const ProxyPoint& p : points) {
    cloud.x.push_back(p.x_in_world - eye);
    cloud.reach.push_back(options.tolerance * depth + 2 * p.sigma);
  }
  const Frusta frusta = FrustaOf(scene, views, eye, options.far_factor * depth);

  std::vector<FittedPlane> planes = given;
  if (given.empty()) {
    std::vector<Eigen::Vector3d> camera;
    for (const ProxyView& v : views) camera.push_back(v.render.centre - eye);
    planes = FindPlanes(cloud, points, camera, frusta, options);
  } else {
    std::vector<std::int32_t> all(points.size());
    std::iota(all.begin(), all.end(), 0);
    for (FittedPlane& plane : planes) {
      MoveBy(-eye, plane);
      TakePoints(cloud, all, plane);
    }
  }
  for (FittedPlane& plane : planes) FaceTheCameras(frusta, plane);

  Mesh mesh = CutAndJoin(cloud, planes, frusta);
  const auto into_world = [&](Mesh m) {
    for (Eigen::Vector3d& v : m.vertices) v += eye;
    return m;
  };
  double coverage = MeasureFit(into_world(mesh), views, {}).coverage;
  bool backdrop_added = false;
  if (options.backdrop && coverage < 1 - kEmptyShare && forward.norm() > 0.1 * static_cast<double>(views.size())) {
    std::vector<FittedPlane> with = planes;
    with.push_back(BackdropOf(cloud, forward, frusta));
    Mesh covered = CutAndJoin(cloud, with, frusta);
    const double better = MeasureFit(into_world(covered), views, {}).coverage;
    if (better > coverage) {
      planes = std::move(with);
      mesh = std::move(covered);
      coverage = better;
      backdrop_added = true;
    }
  }
  if (mesh.faces.empty())
    throw DataError("the planes do not lie before any view", "choose others, or lumi-proxy plane");
  mesh = into_world(std::move(mesh));
  if (summary) {
    *summary = {};
    summary->points = points.size();
    summary->backdrop_added = backdrop_added;
    summary->coverage = coverage;
    for (FittedPlane& plane : planes) {
      summary->points_on_planes += plane.points.size();
      MoveBy(eye, plane);
    }
    summary->planes = std::move(planes);
  }
  return mesh;
}

}  // namespace lumi
