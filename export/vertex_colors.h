// A colour for each vertex of a mesh, by the renderer's own weights: the vertex seen head-on, from as far away as the
// photos are. View-dependent effects are lost.
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
