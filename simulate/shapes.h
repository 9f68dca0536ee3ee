// Every shape becomes triangles, so that what is rendered is exactly the mesh that is handed out as the truth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "scene/geometry/mesh.h"
#include "simulate/scene_description.h"

namespace lumi {

struct ShapeMesh {
  std::vector<Eigen::Vector3d> x_in_object;  // where textures live (the object's scale applied)
  std::vector<Eigen::Vector3d> x_in_world;   // rounded to float: what the ray tracer sees
  std::vector<Eigen::Vector3d> normals;      // in world, unit, for shading; split at sharp edges
  std::vector<Eigen::Vector2f> uv;           // along the surface, world units
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<std::uint8_t> part;  // of each face: which of the object's materials
};

// Triangles of one object. Throws InputError where its mesh file is not usable.
ShapeMesh Tessellate(const ObjectDescription& object);

// As a plain mesh: vertices at the same place are one, faces without area are left out; so a closed shape is closed.
Mesh Welded(const ShapeMesh& shape);

}  // namespace lumi
