#include "proxy/simplify/tight_wrap.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <array>
#include <vector>

#include "proxy/simplify/mesh_topology.h"

namespace lumi {
namespace {

using WrapKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using WrapMesh = CGAL::Surface_mesh<WrapKernel::Point_3>;

}  // namespace

Mesh TightWrap(const Mesh& mesh, double alpha, double offset) {
  const NormalisedFrame frame(mesh);
  std::vector<WrapKernel::Point_3> points;
  points.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const Eigen::Vector3d x = frame.ToLocal(v);
    points.emplace_back(x.x(), x.y(), x.z());
  }
  std::vector<std::array<std::size_t, 3>> faces;
  faces.reserve(mesh.faces.size());
  for (const auto& f : mesh.faces)
    faces.push_back({static_cast<std::size_t>(f[0]), static_cast<std::size_t>(f[1]), static_cast<std::size_t>(f[2])});
  WrapMesh wrap;
  CGAL::alpha_wrap_3(points, faces, alpha / frame.world_length(), offset / frame.world_length(), wrap);
  Mesh out;
  std::vector<std::int32_t> name(wrap.num_vertices(), -1);
  for (const auto f : wrap.faces()) {
    std::array<std::int32_t, 3> face{};
    std::size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(wrap.halfedge(f), wrap)) {
      std::int32_t& n = name[static_cast<std::size_t>(v)];
      if (n < 0) {
        n = static_cast<std::int32_t>(out.vertices.size());
        const auto& p = wrap.point(v);
        out.vertices.push_back(frame.ToWorld({p.x(), p.y(), p.z()}));
      }
      face[k++] = n;
    }
    out.faces.push_back(face);
  }
  return out;
}

}  // namespace lumi
