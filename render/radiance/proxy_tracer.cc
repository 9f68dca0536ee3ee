#include "render/radiance/proxy_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "cmake/embree.h"

namespace lumi {

struct ProxyTracer::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<Eigen::Vector3d> vertices;  // normalised
  std::vector<std::array<std::int32_t, 3>> faces;
  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

ProxyTracer::ProxyTracer(ProxyTracer&&) noexcept = default;
ProxyTracer::~ProxyTracer() = default;

ProxyTracer::ProxyTracer(const Mesh& mesh, const Similarity3& normalized_from_world) : impl_(std::make_unique<Impl>()) {
  if (const auto problem = Validate(mesh)) throw std::invalid_argument("ProxyTracer: " + *problem);
  const auto require = [&](const void* made) { embree::Require(impl_->device, made); };
  impl_->device = rtcNewDevice(nullptr);
  require(impl_->device);
  impl_->scene = rtcNewScene(impl_->device);
  require(impl_->scene);
  // Robust: a ray through an edge or a vertex hits one of its triangles, so that no pixel falls through a seam.
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  if (!mesh.faces.empty()) {
    const RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    require(geometry);
    const std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> released(geometry, rtcReleaseGeometry);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices.size()));
    require(vertices);
    impl_->faces = mesh.faces;
    impl_->vertices.reserve(mesh.vertices.size());
    for (const auto& v : mesh.vertices) {
      impl_->vertices.push_back(normalized_from_world * v);
      const Eigen::Vector3f x = impl_->vertices.back().cast<float>();
      vertices = std::copy(x.data(), x.data() + 3, vertices);
    }
    auto* faces = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.faces.size()));
    require(faces);
    for (const auto& f : mesh.faces)
      for (const auto v : f) *faces++ = static_cast<std::uint32_t>(v);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
  }
  rtcCommitScene(impl_->scene);
  require(impl_->scene);
}

void ProxyTracer::Trace(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions,
                        std::span<float> t_out, std::span<Eigen::Vector3f> normal_out,
                        std::span<std::int32_t> face_out) const {
  constexpr std::size_t kPacket = 16;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  alignas(64) RTCRayHit16 packet;
  alignas(64) int valid[kPacket];
  for (std::size_t base = 0; base < directions.size(); base += kPacket) {
    const std::size_t n = std::min(kPacket, directions.size() - base);
    for (std::size_t i = 0; i < kPacket; ++i) {
      valid[i] = i < n ? -1 : 0;
      const Eigen::Vector3f& d = directions[base + std::min(i, n - 1)];
      packet.ray.org_x[i] = origin.x();
      packet.ray.org_y[i] = origin.y();
      packet.ray.org_z[i] = origin.z();
      packet.ray.dir_x[i] = d.x();
      packet.ray.dir_y[i] = d.y();
      packet.ray.dir_z[i] = d.z();
      packet.ray.tnear[i] = 0;
      packet.ray.tfar[i] = kInfinity;
      packet.ray.time[i] = 0;
      packet.ray.mask[i] = 0xFFFFFFFFU;
      packet.ray.id[i] = 0;
      packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    embree::IntersectCoherent(valid, impl_->scene, packet);
    for (std::size_t i = 0; i < n; ++i)
      t_out[base + i] = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? kInfinity : packet.ray.tfar[i];
    if (!face_out.empty())
      for (std::size_t i = 0; i < n; ++i)
        face_out[base + i] =
            packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<std::int32_t>(packet.hit.primID[i]);
    if (normal_out.empty()) continue;
    for (std::size_t i = 0; i < n; ++i)
      normal_out[base + i] =
          packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
              ? Eigen::Vector3f::Zero()
              : Eigen::Vector3f(packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]).stableNormalized();
  }
}

std::array<Eigen::Vector3d, 3> ProxyTracer::Corners(std::int32_t face) const {
  const auto& f = impl_->faces[static_cast<std::size_t>(face)];
  const auto at = [&](std::size_t i) { return impl_->vertices[static_cast<std::size_t>(f[i])]; };
  return {at(0), at(1), at(2)};
}

double ProxyTracer::Refined(std::int32_t face, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                            float t) const {
  constexpr double kRounding = 1e-3;  // relative: more is no rounding
  const auto& f = impl_->faces[static_cast<std::size_t>(face)];
  const auto at = [&](std::size_t i) -> const Eigen::Vector3d& {
    return impl_->vertices[static_cast<std::size_t>(f[i])];
  };
  const Eigen::Vector3d n = (at(1) - at(0)).cross(at(2) - at(0));
  const auto coarse = static_cast<double>(t);
  const double exact = n.dot(at(0) - origin) / n.dot(direction);
  return std::abs(exact - coarse) <= kRounding * coarse ? exact : coarse;
}

}  // namespace lumi
