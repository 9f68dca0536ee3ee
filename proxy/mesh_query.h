// What rays and points meet of a mesh, and from that what a proxy is worth to the views (CGAL's AABB tree, exact
// predicates: a ray cannot slip through between two faces that share an edge).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"

namespace lumi {

class MeshQuery {
 public:
  explicit MeshQuery(const Mesh& mesh);  // the mesh must outlive it
  ~MeshQuery();

  struct Hit {
    double distance = 0;  // along the ray, in units of its direction's length
    bool front = false;   // the face was met from its front
    std::int32_t face = -1;
  };
  // Where several faces are met at the same distance (to 1e-9 of it), a front face is reported if there is one.
  std::optional<Hit> FirstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // How often the ray meets the mesh: faces at one distance, as at an edge that two share, count once.
  int Layers(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  double Distance(const Eigen::Vector3d& point) const;  // to the nearest point of the mesh; infinity for an empty one

  struct Nearest {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of its face, unit
  };
  // The mesh must have a face with area.
  Nearest NearestTo(const Eigen::Vector3d& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct MeshFit {
  double coverage = 0;              // share of rays that meet the mesh: a grid over every view, its corners included
  double coverage_min = 0;          // of the view that sees it least
  double front_fraction = 0;        // of those rays: faces met from the front
  double blocked_ray_fraction = 0;  // lines of sight that the mesh blocks before their point
  std::size_t lines_of_sight = 0;
  double distance_median = 0;  // from the points to the mesh, over their depth in the view that sees them finest ...
  double distance_95 = 0;      // ... and of 95 % of them
  double layers_mean = 0;      // depth complexity: how often a ray that meets the mesh meets it
  int layers_max = 0;
  std::size_t points = 0;
};

struct MeshFitOptions {
  int grid_x = 17, grid_y = 13;            // rays a view
  std::size_t max_lines_of_sight = 20000;  // evenly picked beyond
  double block_tolerance = 0.02;           // blocked: met before 1 - this of the distance to the point
};
MeshFit MeasureFit(const Mesh& mesh, const std::vector<ProxyView>& views, const std::vector<ProxyPoint>& points,
                   const MeshFitOptions& options = {});

}  // namespace lumi
