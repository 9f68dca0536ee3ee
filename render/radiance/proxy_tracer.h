// Rays against the proxy (Embree), in the scene's normalised frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "scene/geometry/mesh.h"
#include "scene/geometry/similarity3.h"

namespace lumi {

class ProxyTracer {
 public:
  // The mesh is copied, moved to the normalised frame in double and then rounded.
  ProxyTracer(const Mesh& mesh, const Similarity3& normalized_from_world);
  ~ProxyTracer();
  ProxyTracer(ProxyTracer&&) noexcept;
  ProxyTracer(const ProxyTracer&) = delete;

  // Distances along unit directions from one origin; +infinity where the proxy is missed. Unit normals of the
  // triangles that are hit where `normal_out` is not empty (zero on a miss), and which they are in `face_out` (-1).
  // Thread-safe.
  void Trace(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions, std::span<float> t_out,
             std::span<Eigen::Vector3f> normal_out = {}, std::span<std::int32_t> face_out = {}) const;
  // The distance t at which a ray meets this face in double: on oblique faces and towards a photo's border a float's
  // last digits show in the weights. t itself where the face is seen from its edge.
  double Refined(std::int32_t face, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float t) const;
  // The face's corners, normalised frame.
  std::array<Eigen::Vector3d, 3> Corners(std::int32_t face) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
