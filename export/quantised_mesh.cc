#include "export/quantised_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace lumi {
namespace {

// The most that rounding may move a vertex in a photo: a tenth of the error that photos' pixels have anyway.
constexpr double kSeenPx = 0.1;
// Vertices nearer to a photo, as a part of the mesh's extent, are beside or in its camera.
constexpr double kBesideCamera = 1e-6;

void Put(std::string& bytes, std::uint32_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xffU));
}

double MovedPx(const Mesh& from, const Mesh& to, const std::vector<RenderView>& views, double nearest) {
  double most = 0;
  for (const RenderView& view : views) {
    const double scale = view.P.row(2).head<3>().norm();
    for (std::size_t i = 0; i < from.vertices.size(); ++i) {
      const Eigen::Vector3d a = view.P * from.vertices[i].homogeneous(), b = view.P * to.vertices[i].homogeneous();
      if (a.z() <= nearest * scale || b.z() <= nearest * scale) continue;
      const Eigen::Vector2d x = a.hnormalized();
      if ((x.array() < 0).any() || (x.array() > view.size_px.cast<double>().array()).any()) continue;
      most = std::max(most, (x - b.hnormalized()).norm());
    }
  }
  return most;
}

QuantisedMesh WithBytes(const Mesh& mesh, int bytes_a_coordinate) {
  QuantisedMesh q;
  q.bytes_a_coordinate = bytes_a_coordinate;
  Eigen::Vector3d most = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());
  q.least = -most;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    q.least = q.least.cwiseMin(v);
    most = most.cwiseMax(v);
  }
  if (mesh.vertices.empty()) q.least = most = Eigen::Vector3d::Zero();
  const double steps = std::pow(2.0, 8 * bytes_a_coordinate) - 1;
  q.step = (most - q.least) / steps;
  q.mesh = mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const double at = q.step[axis] > 0 ? (mesh.vertices[i][axis] - q.least[axis]) / q.step[axis] : 0;
      const auto whole = static_cast<std::uint32_t>(std::clamp(std::round(at), 0.0, steps));
      Put(q.bytes, whole, bytes_a_coordinate);
      q.mesh.vertices[i][axis] = q.least[axis] + q.step[axis] * whole;
    }
  const int index_bytes = mesh.vertices.size() > 65536 ? 4 : 2;
  for (const auto& face : mesh.faces)
    for (const std::int32_t v : face) Put(q.bytes, static_cast<std::uint32_t>(v), index_bytes);
  return q;
}

}  // namespace

QuantisedMesh Quantise(const Mesh& mesh, const std::vector<RenderView>& views) {
  for (const int bytes : {2, 3}) {
    QuantisedMesh q = WithBytes(mesh, bytes);
    q.error_px = MovedPx(mesh, q.mesh, views, kBesideCamera * q.step.maxCoeff() * (std::pow(2.0, 8 * bytes) - 1));
    if (q.error_px <= kSeenPx || bytes == 3) return q;
  }
  return {};
}

}  // namespace lumi
