// A mesh for a web page: vertices in whole steps of the box around them, 16 bits a coordinate where no photo sees the
// rounding, else 24.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

struct QuantisedMesh {
  int bytes_a_coordinate = 2;
  Eigen::Vector3d least = Eigen::Vector3d::Zero(), step = Eigen::Vector3d::Zero();  // x = least + step q
  std::string bytes;    // little endian: all x, all y, all z; then three indices a face, 16 bits up to 65536 vertices
  Mesh mesh;            // the mesh as decoded from `bytes`, in the same frame
  double error_px = 0;  // the most that a vertex moved in any photo
};

// `views` in the mesh's frame. Vertices behind a photo, or nearer to it than a millionth of the mesh's extent, do not
// count for the error.
QuantisedMesh Quantise(const Mesh& mesh, const std::vector<RenderView>& views);

}  // namespace lumi
