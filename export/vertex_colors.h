// A colour for each vertex of a mesh, by the renderer's own weights: as somebody sees the vertex who looks at it
// head-on, from as far away as the photos are. What changes with the direction of view is lost.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/lumigraph/lumigraph.h"

namespace lumi {

struct VertexColors {
  std::vector<Eigen::Array3f> rgb;  // sRGB, [0, 1]
  std::vector<bool> seen;           // by a photo; others have the mean colour of those that are seen
};

// Of lumigraph.mesh().
VertexColors ColorVertices(const Lumigraph& lumigraph, ProgressSink& sink);

// Unit normals of vertices, areas weighted, turned to where most of the photos are; zero where there is none.
std::vector<Eigen::Vector3d> VertexNormals(const Mesh& mesh, const std::vector<Eigen::Vector3d>& centres);

}  // namespace lumi
