#include "proxy/delaunay/delaunay_proxy.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "proxy/delaunay/min_cut.h"
#include "proxy/delaunay/surface.h"
#include "proxy/delaunay/tetrahedra.h"
#include "scene/geometry/median.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// One line of sight is this many units of capacity: fine enough for the soft term's fractions.
constexpr double kUnitsPerRay = 1024;
// More than all lines of sight together can pay.
constexpr Capacity kForced = Capacity{1} << 48;
// A line of sight counts as blocked where it meets something full nearer than 1 - this of the distance to its point.
constexpr double kBlockTolerance = 0.02;
// The floor lies this share of the points' height below them.
constexpr double kFloorMargin = 0.02;
// And below the cameras by at least this share of the dome's radius, so that none touches it.
constexpr double kEyeMargin = 0.005;
constexpr int kRimPoints = 48;

// Directions spread over the sphere: an icosahedron's vertices, its faces split `subdivisions` times.
std::vector<Eigen::Vector3d> DomeDirections(int subdivisions) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> v;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-g, g}) {
      v.emplace_back(Eigen::Vector3d(0, a, b).normalized());
      v.emplace_back(Eigen::Vector3d(a, b, 0).normalized());
      v.emplace_back(Eigen::Vector3d(b, 0, a).normalized());
    }
  }
  std::vector<std::array<std::size_t, 3>> faces;
  const double edge = 1.06;  // of the unit icosahedron: 1.0515
  for (std::size_t a = 0; a < 12; ++a) {
    for (std::size_t b = a + 1; b < 12; ++b) {
      for (std::size_t c = b + 1; c < 12; ++c)
        if ((v[a] - v[b]).norm() < edge && (v[b] - v[c]).norm() < edge && (v[c] - v[a]).norm() < edge)
          faces.push_back({a, b, c});
    }
  }
  for (int s = 0; s < subdivisions; ++s) {
    std::vector<std::array<std::size_t, 3>> finer;
    std::vector<std::pair<std::array<std::size_t, 2>, std::size_t>> middles;
    std::vector<std::vector<std::pair<std::size_t, std::size_t>>> middle_of(v.size());
    const auto middle = [&](std::size_t a, std::size_t b) {
      if (a > b) std::swap(a, b);
      for (const auto& [other, m] : middle_of[a])
        if (other == b) return m;
      v.push_back((v[a] + v[b]).normalized());
      middle_of[a].emplace_back(b, v.size() - 1);
      return v.size() - 1;
    };
    for (const auto& [a, b, c] : faces) {
      const std::size_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  return v;
}

// The scene moved to its centre: predicates and planes keep their digits wherever the world's origin is.
struct Workspace {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double dome_radius = 1;
  std::vector<Eigen::Vector3d> positions;  // the points, then helpers, then the backdrop
  std::vector<Eigen::Vector3d> eyes;       // cameras
  std::vector<ProxyPoint> points;
};

// The mean of the photos' up directions, without those more than 60 degrees from it. It leans from the vertical towards
// the side that all photos look down from, and the floor with it: away from the cameras the floor falls below what
// stands there. A level floor comes out just below a table's top and cuts into it.
Eigen::Vector3d MeanPhotoUp(const Scene& scene) {
  const auto mean = [&](const Eigen::Vector3d& around, double least_cosine) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const View& view : scene.views) {
      const Eigen::Vector3d up = -UprightPose(view.cam_from_world, view.orientation).R().row(1).transpose();
      if (up.dot(around) >= least_cosine) sum += up;
    }
    return sum;
  };
  const Eigen::Vector3d all = mean(scene.up, -2);
  if (!(all.norm() > 1e-9)) return scene.up;
  const Eigen::Vector3d near = mean(all.normalized(), 0.5);
  return near.norm() > 1e-9 ? near.normalized() : all.normalized();
}

// Points of the backdrop: a dome around the origin, cut off at the floor. A floor below all cameras and nearly all
// points is where unseen ground in the foreground most likely is.
std::vector<Eigen::Vector3d> Backdrop(const Workspace& w, const Eigen::Vector3d& up, const DelaunayOptions& options) {
  std::vector<double> depths;  // below the origin
  for (std::size_t p = 0; p < w.points.size(); ++p) depths.push_back(-w.positions[p].dot(up));
  const double low = Quantile(depths, 1 - options.floor_quantile), high = Quantile(depths, options.floor_quantile);
  double floor = low + kFloorMargin * (low - high);
  for (const Eigen::Vector3d& eye : w.eyes) floor = std::max(floor, -eye.dot(up) + kEyeMargin * w.dome_radius);

  std::vector<Eigen::Vector3d> backdrop;
  for (const Eigen::Vector3d& d : DomeDirections(options.dome_subdivisions)) {
    const double descent = -d.dot(up);
    backdrop.push_back(descent * w.dome_radius > floor ? floor / descent * d : w.dome_radius * d);
  }
  // The rim where dome and floor meet: without it the polyhedron would rise from the floor far inside.
  const double rim = std::sqrt(std::max(w.dome_radius * w.dome_radius - floor * floor, 0.0));
  const Eigen::Vector3d a = up.unitOrthogonal(), b = up.cross(a);
  for (int i = 0; i < kRimPoints && rim > 0; ++i) {
    const double angle_rad = 2 * 3.14159265358979323846 * i / kRimPoints;
    backdrop.push_back(-floor * up + rim * (std::cos(angle_rad) * a + std::sin(angle_rad) * b));
  }
  return backdrop;
}

Workspace Prepare(const Scene& scene, const std::vector<ProxyView>& views, std::vector<ProxyPoint> points,
                  const DelaunayOptions& options) {
  Workspace w;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> x;
    for (const ProxyPoint& p : points) x.push_back(p.x_in_world[axis]);
    w.centre[axis] = Quantile(x, 0.5);
  }
  double radius = 0;
  for (const ProxyPoint& p : points) radius = std::max(radius, (p.x_in_world - w.centre).norm());
  for (const ProxyView& v : views) radius = std::max(radius, (v.render.centre - w.centre).norm());
  w.dome_radius = options.dome_factor * radius;
  for (const ProxyPoint& p : points) w.positions.push_back(p.x_in_world - w.centre);
  for (const ProxyView& v : views) w.eyes.push_back(v.render.centre - w.centre);
  w.points = std::move(points);
  const std::vector<Eigen::Vector3d> backdrop = Backdrop(w, MeanPhotoUp(scene), options);
  if (options.backing > 0) {
    const std::vector<double> spacing = MeanNeighbourDistance(w.positions, 6);
    for (std::size_t p = 0; p < w.points.size(); ++p) {
      Eigen::Vector3d away = Eigen::Vector3d::Zero();
      for (const std::int32_t v : w.points[p].views)
        away += (w.positions[p] - w.eyes[static_cast<std::size_t>(v)]).normalized();
      if (away.norm() > 0) w.positions.push_back(w.positions[p] + options.backing * spacing[p] * away.normalized());
    }
  }
  w.positions.insert(w.positions.end(), backdrop.begin(), backdrop.end());
  return w;
}

// cos of the angle between a facet and the circumsphere of its cell, towards the cell's inside; 1 for infinite cells.
class Circumspheres {
 public:
  explicit Circumspheres(const Tetrahedra& tets)
      : tets_(tets), centre_(tets.cells.size()), radius_(tets.cells.size(), -1) {
    for (std::size_t c = 0; c < tets.cells.size(); ++c) {
      const Tetrahedra::Cell& cell = tets.cells[c];
      if (!cell.finite()) continue;
      const Eigen::Vector3d o = Vertex(cell.vertex[0]);
      Eigen::Matrix3d edges;
      Eigen::Vector3d half;
      for (int i = 0; i < 3; ++i) {
        edges.row(i) = (Vertex(cell.vertex[static_cast<std::size_t>(i) + 1]) - o).transpose();
        half[i] = 0.5 * edges.row(i).squaredNorm();
      }
      const Eigen::Vector3d relative = edges.inverse() * half;
      if (!relative.allFinite()) continue;  // flat to rounding: as an infinite one
      centre_[c] = o + relative;
      radius_[c] = relative.norm();
    }
  }
  double CosAngle(std::size_t cell, std::size_t facet) const {
    if (radius_[cell] < 0) return 1;
    const Tetrahedra::FacetPlane& plane = tets_.planes[cell][facet];
    return std::clamp((plane.offset - plane.n.dot(centre_[cell])) / radius_[cell], -1.0, 1.0);
  }

 private:
  const Eigen::Vector3d& Vertex(std::int32_t v) const { return tets_.vertices[static_cast<std::size_t>(v)]; }
  const Tetrahedra& tets_;
  std::vector<Eigen::Vector3d> centre_;
  std::vector<double> radius_;
};

// Points one after another in space (Morton's order): the lines of sight of neighbours pass through the same cells,
// which are then in the cache. Nothing but the time depends on it.
std::vector<std::uint32_t> InSpatialOrder(const std::vector<Eigen::Vector3d>& positions, std::size_t count) {
  constexpr int kBits = 21;  // of a coordinate: three of them fill 63
  Eigen::AlignedBox3d box;
  for (std::size_t p = 0; p < count; ++p) box.extend(positions[p]);
  const Eigen::Array3d unit = ((1 << kBits) - 1) / box.sizes().array().max(std::numeric_limits<double>::min());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(count);
  ParallelEach(count, 1024, [&](std::size_t p) {
    const Eigen::Array3d at = (positions[p] - box.min()).array() * unit;
    std::uint64_t key = 0;
    for (int bit = kBits - 1; bit >= 0; --bit)
      for (int axis = 0; axis < 3; ++axis) key = 2 * key + (static_cast<std::uint64_t>(at[axis]) >> bit & 1U);
    keys[p] = {key, static_cast<std::uint32_t>(p)};
  });
  std::ranges::sort(keys);
  std::vector<std::uint32_t> order(count);
  std::ranges::transform(keys, order.begin(), [](const auto& k) { return k.second; });
  return order;
}

void Add(Capacity& to, Capacity value) { std::atomic_ref<Capacity>(to).fetch_add(value, std::memory_order_relaxed); }

// The cell across a facet, and which of its facets that is.
std::pair<std::size_t, std::size_t> Across(const Tetrahedra& tets, std::size_t cell, std::size_t facet) {
  const auto next = static_cast<std::size_t>(tets.cells[cell].neighbor[facet]);
  std::size_t back = 0;
  while (back < 3 && tets.cells[next].neighbor[back] != static_cast<std::int32_t>(cell)) ++back;
  return {next, back};
}

Eigen::Vector3d MiddleOf(const Tetrahedra& tets, const Tetrahedra::Cell& finite) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::int32_t v : finite.vertex) sum += tets.vertices[static_cast<std::size_t>(v)];
  return 0.25 * sum;
}

// Whether x, in the workspace as the eye is, projects into the view's picture or close enough outside its border: a
// surface that reaches the border goes on a little rather than end there. What stands before it does not count.
bool Shows(const RenderView& view, const Eigen::Vector3d& eye, const Eigen::Vector3d& x, double beyond_picture) {
  const Eigen::Vector3d x_px = view.P.leftCols<3>() * (x - eye);
  if (!(x_px.z() > 0)) return false;
  const Eigen::Array2d size_px = view.size_px.cast<double>().array();
  const double beyond_px = beyond_picture * size_px.maxCoeff();
  const Eigen::Array2d at = x_px.head<2>().array() / x_px.z();
  return (at >= -beyond_px).all() && (at <= size_px + beyond_px).all();
}

// What each line of sight says of the cells that it passes, and of the one behind its point. Returns how many there
// are.
std::size_t AddLinesOfSight(const Workspace& w, const std::vector<ProxyView>& views, const Tetrahedra& tets,
                            const DelaunayOptions& options, CutProblem& problem) {
  // Beyond so many standard deviations the soft term is 1 to the last digit of a double.
  constexpr double kCertain = 9;
  std::atomic<std::size_t> rays = 0;
  const std::vector<std::uint32_t> order = InSpatialOrder(w.positions, w.points.size());
  ParallelEach(order.size(), 64, [&](std::size_t i) {
    const std::size_t p = order[i];
    const Eigen::Vector3d& x = w.positions[p];
    const double sigma = options.tolerance_sigma * w.points[p].sigma;
    for (const std::int32_t v : w.points[p].views) {
      const Eigen::Vector3d& eye = w.eyes[static_cast<std::size_t>(v)];
      const double distance = (eye - x).norm();
      if (!(distance > 0)) continue;
      rays.fetch_add(1, std::memory_order_relaxed);
      // Towards the camera all is free: a facet pays for being a surface, the less the nearer it is to the point.
      WalkFromVertex(tets, static_cast<std::int32_t>(p), eye, [&](std::int32_t cell, int facet, double d) {
        const double weight = d > kCertain * sigma
                                  ? options.ray_weight
                                  : options.ray_weight * (1 - std::exp(-0.5 * (d / sigma) * (d / sigma)));
        const auto [next, back] = Across(tets, static_cast<std::size_t>(cell), static_cast<std::size_t>(facet));
        Add(problem.facet[next][back], std::llround(kUnitsPerRay * weight));
        return true;
      });
      // Behind the point it is full, as deep as the point's position is uncertain. At the border of what was seen that
      // cell may be a sliver that reaches across space where no photo looks, and would be a wall before whoever stands
      // there: a photo says nothing of a cell that it does not show.
      const Eigen::Vector3d behind = x + (x - eye) * (std::min(3 * sigma, 0.5 * distance) / distance);
      const std::int32_t cell =
          WalkFromVertex(tets, static_cast<std::int32_t>(p), behind, [](std::int32_t, int, double) { return true; });
      if (cell < 0) continue;
      const Eigen::Vector3d middle =
          MiddleOf(tets, tets.cells[static_cast<std::size_t>(cell)]);  // walks end in finite ones
      if (Shows(views[static_cast<std::size_t>(v)].render, eye, middle, options.beyond_picture))
        Add(problem.sink[static_cast<std::size_t>(cell)], std::llround(kUnitsPerRay * options.ray_weight));
    }
  });
  return rays;
}

// What is known without any line of sight: outside is full, cameras stand in free cells, a surface is smooth. What no
// photo shows counts as free, so that who stands beside the photos does not stand within something full.
void AddSurroundings(const Workspace& w, const std::vector<ProxyView>& views, const LocatedTetrahedra& located,
                     const DelaunayOptions& options, CutProblem& problem) {
  const Tetrahedra& tets = located.tetrahedra;
  const Circumspheres spheres(tets);
  for (std::size_t c = 0; c < tets.cells.size(); ++c) {
    if (!tets.cells[c].finite()) problem.sink[c] = kForced;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto [n, back] = Across(tets, c, i);
      const double quality = 1 - std::min(spheres.CosAngle(c, i), spheres.CosAngle(n, back));
      problem.facet[c][i] += std::llround(kUnitsPerRay * options.quality_weight * quality);
    }
  }
  // Photos that show none of the points are not looked at: they may be left out on purpose, for an evaluation.
  std::vector<std::uint8_t> looks(views.size(), 0);
  for (const ProxyPoint& point : w.points)
    for (const std::int32_t v : point.views) looks[static_cast<std::size_t>(v)] = 1;
  const auto shown_by = [&](std::size_t v, const Eigen::Vector3d& x) {
    return looks[v] && Shows(views[v].render, w.eyes[v], x, options.beyond_picture);
  };
  ParallelEach(tets.cells.size(), 1024, [&](std::size_t c) {
    const Tetrahedra::Cell& cell = tets.cells[c];
    if (!cell.finite()) return;
    const Eigen::Vector3d middle = MiddleOf(tets, cell);
    // Those that see a corner first: nearly always one of them shows the middle too.
    for (const std::int32_t corner : cell.vertex)
      if (static_cast<std::size_t>(corner) < w.points.size())
        for (const std::int32_t v : w.points[static_cast<std::size_t>(corner)].views)
          if (shown_by(static_cast<std::size_t>(v), middle)) return;
    for (std::size_t v = 0; v < views.size(); ++v)
      if (shown_by(v, middle)) return;
    problem.source[c] = std::llround(kUnitsPerRay * options.ray_weight);
  });
  for (const std::int32_t c : located.query_cell) problem.source[static_cast<std::size_t>(c)] = kForced;
}

std::size_t CountBlocked(const Workspace& w, const Tetrahedra& tets, const std::vector<std::uint8_t>& free) {
  std::atomic<std::size_t> blocked = 0;
  const std::vector<std::uint32_t> order = InSpatialOrder(w.positions, w.points.size());
  ParallelEach(order.size(), 64, [&](std::size_t i) {
    const std::size_t p = order[i];
    for (const std::int32_t v : w.points[p].views) {
      const Eigen::Vector3d& eye = w.eyes[static_cast<std::size_t>(v)];
      const double tolerated = kBlockTolerance * (eye - w.positions[p]).norm();
      bool is_blocked = false;
      WalkFromVertex(tets, static_cast<std::int32_t>(p), eye, [&](std::int32_t cell, int facet, double d) {
        const std::int32_t next = tets.cells[static_cast<std::size_t>(cell)].neighbor[static_cast<std::size_t>(facet)];
        is_blocked = d > tolerated && !(free[static_cast<std::size_t>(cell)] && free[static_cast<std::size_t>(next)]);
        return !is_blocked;
      });
      if (is_blocked) blocked.fetch_add(1, std::memory_order_relaxed);
    }
  });
  return blocked;
}

}  // namespace

std::string Validate(const DelaunayOptions& o) {
  if (!(o.merge_px >= 0)) return "merge_px must be >= 0";
  if (!(o.ray_weight > 0)) return "ray_weight must be > 0";
  if (!(o.quality_weight >= 0)) return "quality_weight must be >= 0";
  if (!(o.tolerance_sigma > 0)) return "tolerance_sigma must be > 0";
  if (!(o.dome_factor >= 1.2)) return "dome_factor must be at least 1.2";
  if (o.dome_subdivisions < 1 || o.dome_subdivisions > 6) return "dome_subdivisions must be 1 to 6";
  if (!(o.backing >= 0)) return "backing must be >= 0";
  if (!(o.floor_quantile >= 0 && o.floor_quantile < 0.5)) return "floor_quantile must be in [0, 0.5)";
  if (!(o.beyond_picture >= 0)) return "beyond_picture must be >= 0";
  return {};
}

std::map<std::string, std::string> OptionValues(const DelaunayOptions& o) {
  const auto text = [](double value) { return fmt::format("{}", value); };
  return {{"max_error_px", text(o.points.max_error_px)},
          {"min_angle_deg", text(o.points.min_angle_deg)},
          {"min_track", text(o.points.min_track)},
          {"enough_points", text(o.points.enough_points)},
          {"neighbours", text(o.points.neighbours)},
          {"max_neighbour_ratio", text(o.points.max_neighbour_ratio)},
          {"merge_px", text(o.merge_px)},
          {"ray_weight", text(o.ray_weight)},
          {"quality_weight", text(o.quality_weight)},
          {"tolerance_sigma", text(o.tolerance_sigma)},
          {"backing", text(o.backing)},
          {"beyond_picture", text(o.beyond_picture)},
          {"dome_factor", text(o.dome_factor)},
          {"floor_quantile", text(o.floor_quantile)},
          {"dome_subdivisions", text(o.dome_subdivisions)}};
}

Mesh BuildDelaunayProxy(const Scene& scene, const DelaunayOptions& options, ProgressSink& progress,
                        DelaunaySummary* summary) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  DelaunaySummary local;
  DelaunaySummary& s = summary ? *summary : local;
  s = {};
  Stopwatch watch;
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  s.selection = SelectPoints(scene, views, options.points);
  std::vector<ProxyPoint> points = MergePoints(s.selection.points, options.merge_px);
  s.select_s = watch.Lap();
  if (points.size() < 4) {
    throw DataError("a mesh needs at least 4 reliable points, the scene has " + std::to_string(points.size()) + " of " +
                        std::to_string(s.selection.total),
                    "use lumi-proxy plane, or reconstruct from more photos that overlap");
  }
  return MeshThroughPoints(scene, views, std::move(points), options, progress, &s);
}

Mesh MeshThroughPoints(const Scene& scene, const std::vector<ProxyView>& views, std::vector<ProxyPoint> points,
                       const DelaunayOptions& options, ProgressSink& progress, DelaunaySummary* summary) {
  DelaunaySummary local;
  DelaunaySummary& s = summary ? *summary : local;
  Stopwatch watch;
  Progress steps(progress, "delaunay proxy", 5);
  Workspace w = Prepare(scene, views, std::move(points), options);
  s.vertices_used = w.points.size();
  s.select_s += watch.Lap();
  steps.Step();
  const std::optional<LocatedTetrahedra> located = Tetrahedralize(w.positions, w.eyes);
  if (!located) throw DataError("the points and their backdrop span no volume", "use lumi-proxy plane");
  const Tetrahedra& tets = located->tetrahedra;
  s.tetrahedra = tets.cells.size();
  s.tetrahedra_s = watch.Lap();
  steps.Step();

  CutProblem problem;
  problem.source.assign(tets.cells.size(), 0);
  problem.sink.assign(tets.cells.size(), 0);
  problem.facet.assign(tets.cells.size(), {0, 0, 0, 0});
  s.rays = AddLinesOfSight(w, views, tets, options, problem);
  AddSurroundings(w, views, *located, options, problem);
  s.rays_s = watch.Lap();
  steps.Step();

  const std::vector<std::uint8_t> free = SolveMinCut(tets, problem);
  s.cut_s = watch.Lap();
  steps.Step();

  s.blocked_ray_fraction =
      s.rays > 0 ? static_cast<double>(CountBlocked(w, tets, free)) / static_cast<double>(s.rays) : 0;
  Mesh mesh = ExtractSurface(tets, free);
  for (Eigen::Vector3d& x : mesh.vertices) x += w.centre;
  s.surface_s = watch.Lap();
  steps.Step();
  return mesh;
}

}  // namespace lumi
