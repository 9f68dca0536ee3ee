// What a ray meets (Embree). Surfaces that stand still are one acceleration structure; objects that turn together are
// another, and rays are rotated back by these objects' rotation at the ray's time. Hits are refined in double: depth
// maps are as exact as the mesh.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "scene/geometry/mesh.h"
#include "simulate/scene_description.h"

namespace lumi {

struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit
};

struct Hit {
  double t = 0;      // distance, world units
  int object = -1;   // in SceneDescription::objects
  int material = 0;  // in SceneDescription::materials
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of the triangle, unit, towards the ray's origin
  Eigen::Vector3d shading_normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d x_in_object = Eigen::Vector3d::Zero();
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();
};

// Where the moving parts are at one time: one rotation for each spin that objects have, in their order.
using PartPoses = std::vector<Eigen::Affine3d>;

class Tracer {
 public:
  explicit Tracer(const SceneDescription& scene);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  bool HasMovingParts() const;
  PartPoses PartsAt(double time_s) const;

  // The nearest surface; both are safe to call from any thread.
  std::optional<Hit> Trace(const Ray& ray, const PartPoses& parts) const;
  // Is the nearest surface one of a moving part?
  bool ShowsMovingPart(const Ray& ray, const PartPoses& parts) const;
  // Is anything nearer than `distance`? `offset` keeps a surface from hiding itself.
  bool IsBlocked(const Ray& ray, double distance, const PartPoses& parts) const;

  // All surfaces as one mesh, moving parts where they are at time 0.
  Mesh TrueMesh() const;
  // What stands still, and for each moving part a rectangle in its middle across `towards` (unit, world: to the
  // cameras) that covers wherever it goes: a proxy that is right on average at all times.
  Mesh BillboardMesh(const Eigen::Vector3d& towards) const;
  // Scene's size: diagonal of the surfaces' bounding box, world units.
  double Extent() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A distance that is safely above rounding and below what anybody sees, for rays that start on a surface.
inline double SurfaceOffset(const Eigen::Vector3d& x_in_world, double extent) {
  return 1e-6 * (x_in_world.cwiseAbs().maxCoeff() + extent) + 1e-9;
}

}  // namespace lumi
