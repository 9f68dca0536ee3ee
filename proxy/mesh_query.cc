#include "proxy/mesh_query.h"

#include <CGAL/AABB_tree.h>
#include <CGAL/version.h>
#if CGAL_VERSION_MAJOR >= 6
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <variant>
#include <vector>

#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangle = Kernel::Triangle_3;
using Iterator = std::vector<Triangle>::const_iterator;
#if CGAL_VERSION_MAJOR >= 6
using Tree = CGAL::AABB_tree<CGAL::AABB_traits_3<Kernel, CGAL::AABB_triangle_primitive_3<Kernel, Iterator>>>;
#else
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_triangle_primitive<Kernel, Iterator>>>;
#endif

using Intersection = Tree::Intersection_and_primitive_id<Kernel::Ray_3>::Type;

// What an intersection is, where it is a T: CGAL 5 returns boost's variant, CGAL 6 the standard's.
template <typename T, typename Variant>
const T* As(const Variant& intersection) {
  if constexpr (requires { std::get_if<T>(&intersection); })
    return std::get_if<T>(&intersection);
  else
    return boost::get<T>(&intersection);
}

}  // namespace

struct MeshQuery::Impl {
  Eigen::Vector3d centre =
      Eigen::Vector3d::Zero();  // coordinates below are relative to it: digits wherever the scene is
  std::vector<Triangle> triangles;
  std::vector<std::int32_t> face;  // of each triangle
  double extent = 0;               // largest of the coordinates
  Tree tree;
  // Intersections no farther apart along a ray than this, at that distance, are at one place.
  double Same(double distance) const {
    constexpr double kSame = 1e-9, kRounding = 8 * std::numeric_limits<double>::epsilon();
    return kSame * distance + kRounding * extent;
  }
  Kernel::Point_3 Local(const Eigen::Vector3d& x) const {
    return {x.x() - centre.x(), x.y() - centre.y(), x.z() - centre.z()};
  }
};

MeshQuery::MeshQuery(const Mesh& mesh) : impl_(std::make_unique<Impl>()) {
  if (!mesh.vertices.empty())
    for (const Eigen::Vector3d& v : mesh.vertices) impl_->centre += v / static_cast<double>(mesh.vertices.size());
  impl_->triangles.reserve(mesh.faces.size());
  for (const auto& face : mesh.faces) {
    const Triangle t(impl_->Local(mesh.vertices[static_cast<std::size_t>(face[0])]),
                     impl_->Local(mesh.vertices[static_cast<std::size_t>(face[1])]),
                     impl_->Local(mesh.vertices[static_cast<std::size_t>(face[2])]));
    if (t.is_degenerate()) continue;  // no ray meets a face without area
    impl_->triangles.push_back(t);
    for (int corner = 0; corner < 3; ++corner)
      for (int axis = 0; axis < 3; ++axis) impl_->extent = std::max(impl_->extent, std::abs(t[corner][axis]));
    impl_->face.push_back(static_cast<std::int32_t>(&face - mesh.faces.data()));
  }
  impl_->tree.rebuild(impl_->triangles.cbegin(), impl_->triangles.cend());
  if (!impl_->triangles.empty()) {
    impl_->tree.build();
    impl_->tree.accelerate_distance_queries();
  }
}

MeshQuery::~MeshQuery() = default;

std::optional<MeshQuery::Hit> MeshQuery::FirstHit(const Eigen::Vector3d& origin,
                                                  const Eigen::Vector3d& direction) const {
  const double length = direction.norm();
  if (impl_->triangles.empty() || !(length > 0)) return std::nullopt;
  const Kernel::Point_3 o = impl_->Local(origin);
  const Eigen::Vector3d d = direction / length;
  const Kernel::Vector_3 ray_direction(d.x(), d.y(), d.z());
  const Kernel::Ray_3 ray(o, ray_direction);
  const auto first = impl_->tree.first_intersection(ray);
  if (!first) return std::nullopt;
  const auto hit_of = [&](const Intersection& hit) {
    double t = std::numeric_limits<double>::infinity();
    if (const auto* point = As<Kernel::Point_3>(hit.first))
      t = (*point - o) * ray_direction;
    else if (const auto* segment = As<Kernel::Segment_3>(hit.first))  // the face contains the ray
      t = std::min((segment->source() - o) * ray_direction, (segment->target() - o) * ray_direction);
    const Triangle& triangle = *hit.second;
    const Kernel::Vector_3 normal = CGAL::cross_product(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    return Hit{std::max(t, 0.0) / length, normal * ray_direction < 0,
               impl_->face[static_cast<std::size_t>(hit.second - impl_->triangles.cbegin())]};
  };
  const Hit hit = hit_of(*first);
  if (hit.front) return hit;
  // Of faces at one distance it may be any: then one that is met from its front.
  std::vector<Intersection> all;
  impl_->tree.all_intersections(ray, std::back_inserter(all));
  for (const Intersection& each : all)
    if (const Hit other = hit_of(each);
        other.front && length * (other.distance - hit.distance) <= impl_->Same(length * hit.distance))
      return other;
  return hit;
}

int MeshQuery::Layers(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  const double length = direction.norm();
  if (impl_->triangles.empty() || !(length > 0)) return 0;
  const Kernel::Point_3 o = impl_->Local(origin);
  const Kernel::Vector_3 ray_direction(direction.x() / length, direction.y() / length, direction.z() / length);
  std::vector<Intersection> hits;
  impl_->tree.all_intersections(Kernel::Ray_3(o, ray_direction), std::back_inserter(hits));
  std::vector<double> distances;
  for (const auto& hit : hits)
    if (const auto* point = As<Kernel::Point_3>(hit.first)) distances.push_back((*point - o) * ray_direction);
  std::ranges::sort(distances);
  int layers = 0;
  double last = 0;
  for (const double d : distances) {
    if (layers == 0 || d > last + impl_->Same(d)) ++layers;
    last = d;
  }
  return layers;
}

MeshQuery::Nearest MeshQuery::NearestTo(const Eigen::Vector3d& point) const {
  const auto nearest = impl_->tree.closest_point_and_primitive(impl_->Local(point));
  const Triangle& triangle = *nearest.second;
  const Kernel::Vector_3 normal = CGAL::cross_product(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  return {Eigen::Vector3d(nearest.first.x(), nearest.first.y(), nearest.first.z()) + impl_->centre,
          Eigen::Vector3d(normal.x(), normal.y(), normal.z()).stableNormalized()};
}

double MeshQuery::Distance(const Eigen::Vector3d& point) const {
  if (impl_->triangles.empty()) return std::numeric_limits<double>::infinity();
  return std::sqrt(impl_->tree.squared_distance(impl_->Local(point)));
}

MeshFit MeasureFit(const Mesh& mesh, const std::vector<ProxyView>& views, const std::vector<ProxyPoint>& points,
                   const MeshFitOptions& options) {
  const MeshQuery query(mesh);
  MeshFit fit;
  const int rays_a_view = options.grid_x * options.grid_y;
  std::vector<int> met(views.size()), front(views.size()), layers(views.size()), layers_max(views.size());
  ParallelEach(views.size(), 1, [&](std::size_t v) {
    const Eigen::Vector2d size = views[v].render.size_px.cast<double>();
    for (int i = 0; i < rays_a_view; ++i) {
      const Eigen::Vector2d x_px(size.x() * (i % options.grid_x) / std::max(options.grid_x - 1, 1),
                                 size.y() * (i / options.grid_x) / std::max(options.grid_y - 1, 1));
      const auto direction = RayDirection(views[v].render.P, x_px);
      const auto hit = direction ? query.FirstHit(views[v].render.centre, *direction) : std::nullopt;
      met[v] += hit.has_value();
      front[v] += hit && hit->front;
      if (!hit) continue;
      const int n = std::max(1, query.Layers(views[v].render.centre, *direction));
      layers[v] += n;
      layers_max[v] = std::max(layers_max[v], n);
    }
  });
  long all_met = 0, all_front = 0, all_layers = 0;
  int least = rays_a_view;
  for (std::size_t v = 0; v < views.size(); ++v) {
    all_met += met[v];
    all_front += front[v];
    all_layers += layers[v];
    fit.layers_max = std::max(fit.layers_max, layers_max[v]);
    least = std::min(least, met[v]);
  }
  fit.coverage = views.empty() ? 0
                               : static_cast<double>(all_met) /
                                     (static_cast<double>(rays_a_view) * static_cast<double>(views.size()));
  fit.coverage_min = views.empty() ? 0 : static_cast<double>(least) / rays_a_view;
  fit.front_fraction = all_met > 0 ? static_cast<double>(all_front) / static_cast<double>(all_met) : 0;

  fit.layers_mean = all_met > 0 ? static_cast<double>(all_layers) / static_cast<double>(all_met) : 0;

  std::vector<std::pair<std::int32_t, std::int32_t>> lines;  // point, view
  for (std::size_t p = 0; p < points.size(); ++p)
    for (const std::int32_t v : points[p].views) lines.emplace_back(static_cast<std::int32_t>(p), v);
  const std::size_t stride = std::max<std::size_t>(
      1, (lines.size() + options.max_lines_of_sight - 1) / std::max<std::size_t>(options.max_lines_of_sight, 1));
  const std::size_t picked = (lines.size() + stride - 1) / stride;
  std::atomic<std::size_t> blocked = 0;
  ParallelEach(picked, 256, [&](std::size_t i) {
    const auto [p, v] = lines[i * stride];
    const Eigen::Vector3d& eye = views[static_cast<std::size_t>(v)].render.centre;
    const auto hit = query.FirstHit(eye, points[static_cast<std::size_t>(p)].x_in_world - eye);
    if (hit && hit->distance < 1 - options.block_tolerance) ++blocked;
  });
  fit.lines_of_sight = picked;
  fit.blocked_ray_fraction = picked > 0 ? static_cast<double>(blocked) / static_cast<double>(picked) : 0;

  std::vector<double> distances(points.size());
  ParallelEach(points.size(), 256, [&](std::size_t p) {
    double depth = std::numeric_limits<double>::infinity();
    for (const std::int32_t v : points[p].views)
      depth = std::min(depth, views[static_cast<std::size_t>(v)].DepthOf(points[p].x_in_world));
    distances[p] = query.Distance(points[p].x_in_world) / depth;
  });
  fit.points = points.size();
  fit.distance_median = Quantile(distances, 0.5);
  fit.distance_95 = Quantile(distances, 0.95);
  return fit;
}

}  // namespace lumi
