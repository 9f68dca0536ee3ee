#include "simulate/tracer.h"

#include <limits>
#include <memory>

#include "cmake/embree.h"
#include "simulate/shapes.h"

namespace lumi {
namespace {

using Eigen::Vector3d;

struct DeviceDeleter {
  void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
  void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceDeleter>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneDeleter>;

void AddShape(RTCDevice device, RTCScene scene, const ShapeMesh& shape, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  embree::Require(device, geometry);
  const std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> released(geometry, rtcReleaseGeometry);
  auto* x = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                        3 * sizeof(float), shape.x_in_world.size()));
  auto* f = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                           3 * sizeof(unsigned), shape.faces.size()));
  embree::Require(device, x);
  embree::Require(device, f);
  for (const Vector3d& v : shape.x_in_world)
    for (Eigen::Index k = 0; k < 3; ++k) *x++ = static_cast<float>(v[k]);
  for (const auto& face : shape.faces)
    for (const std::int32_t v : face) *f++ = static_cast<unsigned>(v);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
}

ScenePtr NewScene(RTCDevice device) {
  ScenePtr scene(rtcNewScene(device));
  embree::Require(device, scene.get());
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
  return scene;
}

void SetRay(RTCRay& out, const Ray& ray, double near, double far) {
  out.org_x = static_cast<float>(ray.origin.x());
  out.org_y = static_cast<float>(ray.origin.y());
  out.org_z = static_cast<float>(ray.origin.z());
  out.dir_x = static_cast<float>(ray.direction.x());
  out.dir_y = static_cast<float>(ray.direction.y());
  out.dir_z = static_cast<float>(ray.direction.z());
  out.tnear = static_cast<float>(near);
  out.tfar = static_cast<float>(far);
  out.time = 0;
  out.mask = 0xffffffffU;
  out.id = 0;
  out.flags = 0;
}

Ray Moved(const Ray& ray, const Eigen::Affine3d& part) {
  const Eigen::Affine3d inverse = part.inverse(Eigen::Isometry);
  return {inverse * ray.origin, inverse.linear() * ray.direction};
}

}  // namespace

struct Tracer::Impl {
  const SceneDescription& description;
  std::vector<ShapeMesh> shapes;
  DevicePtr device;
  ScenePtr still;
  bool any_still = false;
  std::vector<SpinDescription> moving;  // of the objects of one of moving_scenes
  std::vector<ScenePtr> moving_scenes;
  double extent = 0;

  explicit Impl(const SceneDescription& scene) : description(scene), device(rtcNewDevice(nullptr)) {
    embree::Require(device.get(), device.get());
    still = NewScene(device.get());
    Eigen::AlignedBox3d bounds;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      shapes.push_back(Tessellate(scene.objects[i]));
      for (const Vector3d& x : shapes.back().x_in_world) bounds.extend(x);
      if (scene.objects[i].spin) {
        const SpinDescription& spin = *scene.objects[i].spin;
        std::size_t group = 0;
        while (group < moving.size() && !(moving[group] == spin)) ++group;
        if (group == moving.size()) {
          moving.push_back(spin);
          moving_scenes.push_back(NewScene(device.get()));
        }
        AddShape(device.get(), moving_scenes[group].get(), shapes.back(), static_cast<unsigned>(i));
      } else {
        AddShape(device.get(), still.get(), shapes.back(), static_cast<unsigned>(i));
        any_still = true;
      }
    }
    rtcCommitScene(still.get());
    for (const ScenePtr& part : moving_scenes) rtcCommitScene(part.get());
    embree::Require(device.get(), still.get());
    if (!bounds.isEmpty()) extent = bounds.diagonal().norm();
  }

  // Refines Embree's float hit: the same triangle, met in double.
  Hit Refine(const Ray& ray, const RTCRayHit& found) const {
    Hit hit;
    hit.object = static_cast<int>(found.hit.geomID);
    const ShapeMesh& shape = shapes[found.hit.geomID];
    const auto& face = shape.faces[found.hit.primID];
    const auto a = static_cast<std::size_t>(face[0]), b = static_cast<std::size_t>(face[1]),
               c = static_cast<std::size_t>(face[2]);
    const Vector3d &p = shape.x_in_world[a], &q = shape.x_in_world[b], &r = shape.x_in_world[c];
    const Vector3d area = (q - p).cross(r - p);
    const double area2 = area.squaredNorm();
    const double facing = area.dot(ray.direction);
    // At a graze beyond double's own accuracy Embree's distance is as good.
    const bool grazing = std::abs(facing) < 1e-9 * std::sqrt(area2);
    hit.t = grazing ? static_cast<double>(found.ray.tfar) : area.dot(p - ray.origin) / facing;
    hit.x_in_world = ray.origin + hit.t * ray.direction;
    const double v = (q - p).cross(hit.x_in_world - p).dot(area) / area2;
    const double u = (hit.x_in_world - p).cross(r - p).dot(area) / area2;
    const double w = 1 - u - v;
    const double side = facing <= 0 ? 1.0 : -1.0;
    hit.normal = area * (side / std::sqrt(area2));
    hit.shading_normal = side * (w * shape.normals[a] + u * shape.normals[b] + v * shape.normals[c]);
    hit.shading_normal.normalize();
    hit.x_in_object = w * shape.x_in_object[a] + u * shape.x_in_object[b] + v * shape.x_in_object[c];
    hit.uv =
        static_cast<float>(w) * shape.uv[a] + static_cast<float>(u) * shape.uv[b] + static_cast<float>(v) * shape.uv[c];
    const auto& materials = description.objects[found.hit.geomID].materials;
    const std::size_t part = shape.part[found.hit.primID];
    hit.material = materials[part < materials.size() ? part : 0];
    return hit;
  }

  static std::optional<RTCRayHit> Intersect(RTCScene scene, const Ray& ray) {
    RTCRayHit query;
    SetRay(query.ray, ray, 0, std::numeric_limits<float>::infinity());
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embree::Intersect(scene, query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return query;
  }

  static bool Occluded(RTCScene scene, const Ray& ray, double distance) {
    RTCRay query;
    SetRay(query, ray, 0, distance);
    embree::Occluded(scene, query);
    return query.tfar < 0;
  }
};

Tracer::Tracer(const SceneDescription& scene) : impl_(std::make_unique<Impl>(scene)) {}
Tracer::~Tracer() = default;

bool Tracer::HasMovingParts() const { return !impl_->moving.empty(); }
double Tracer::Extent() const { return impl_->extent; }

PartPoses Tracer::PartsAt(double time_s) const {
  PartPoses poses;
  for (const SpinDescription& spin : impl_->moving) {
    // The speed wavers by sines that have no common period; their integral is added to the time.
    double at_s = time_s;
    constexpr double kHz[] = {0.443, 1.151, 2.087}, kShare[] = {0.4, 0.35, 0.25};
    for (int i = 0; i < 3 && spin.unsteady > 0; ++i)
      at_s += spin.unsteady * kShare[i] * (1 - std::cos(6.283185307179586 * kHz[i] * time_s)) /
              (6.283185307179586 * kHz[i]);
    const double turns = at_s / spin.period_s;
    const double angle = 6.283185307179586 * (turns - std::floor(turns));
    poses.push_back(Eigen::Translation3d(spin.centre) * Eigen::AngleAxisd(angle, spin.axis) *
                    Eigen::Translation3d(-spin.centre));
  }
  return poses;
}

std::optional<Hit> Tracer::Trace(const Ray& ray, const PartPoses& parts) const {
  std::optional<Hit> nearest;
  if (impl_->any_still)
    if (const auto found = Impl::Intersect(impl_->still.get(), ray)) nearest = impl_->Refine(ray, *found);
  for (std::size_t i = 0; i < impl_->moving.size(); ++i) {
    const Ray moved = Moved(ray, parts[i]);
    const auto found = Impl::Intersect(impl_->moving_scenes[i].get(), moved);
    if (!found) continue;
    Hit hit = impl_->Refine(moved, *found);
    if (nearest && nearest->t <= hit.t) continue;
    hit.x_in_world = parts[i] * hit.x_in_world;
    hit.normal = parts[i].linear() * hit.normal;
    hit.shading_normal = parts[i].linear() * hit.shading_normal;
    nearest = hit;
  }
  return nearest;
}

bool Tracer::ShowsMovingPart(const Ray& ray, const PartPoses& parts) const {
  for (std::size_t i = 0; i < impl_->moving.size(); ++i) {
    const auto found = Impl::Intersect(impl_->moving_scenes[i].get(), Moved(ray, parts[i]));
    if (!found) continue;
    const double t = static_cast<double>(found->ray.tfar);
    if (!impl_->any_still || !Impl::Occluded(impl_->still.get(), ray, t * (1 - 1e-6))) return true;
  }
  return false;
}

bool Tracer::IsBlocked(const Ray& ray, double distance, const PartPoses& parts) const {
  if (impl_->any_still && Impl::Occluded(impl_->still.get(), ray, distance)) return true;
  for (std::size_t i = 0; i < impl_->moving.size(); ++i)
    if (Impl::Occluded(impl_->moving_scenes[i].get(), Moved(ray, parts[i]), distance)) return true;
  return false;
}

Mesh Tracer::BillboardMesh(const Vector3d& towards) const {
  Mesh mesh;
  for (std::size_t i = 0; i < impl_->shapes.size(); ++i)
    if (!impl_->description.objects[i].spin) Append(mesh, Welded(impl_->shapes[i]));
  const Vector3d right =
      (std::abs(towards.z()) < 0.99 ? Vector3d(Vector3d::UnitZ().cross(towards)) : Vector3d(Vector3d::UnitX()))
          .normalized();
  const Vector3d up = towards.cross(right);
  for (const SpinDescription& spin : impl_->moving) {
    constexpr int kTimes = 48;
    Eigen::AlignedBox3d box;  // along right, up and towards
    for (std::size_t i = 0; i < impl_->shapes.size(); ++i) {
      const auto& own = impl_->description.objects[i].spin;
      if (!own || !(*own == spin)) continue;
      for (int k = 0; k < kTimes; ++k) {
        const Eigen::AngleAxisd turn(6.283185307179586 * k / kTimes, spin.axis);
        for (const Vector3d& x : impl_->shapes[i].x_in_world) {
          const Vector3d at = spin.centre + turn * (x - spin.centre);
          box.extend(Vector3d(right.dot(at), up.dot(at), towards.dot(at)));
        }
      }
    }
    const double depth = box.center().z();
    const auto first = static_cast<std::int32_t>(mesh.vertices.size());
    for (const auto& [a, b] : {std::pair{box.min().x(), box.min().y()}, std::pair{box.max().x(), box.min().y()},
                               std::pair{box.max().x(), box.max().y()}, std::pair{box.min().x(), box.max().y()}})
      mesh.vertices.push_back(a * right + b * up + depth * towards);
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

Mesh Tracer::TrueMesh() const {
  Mesh mesh;
  for (const ShapeMesh& shape : impl_->shapes) Append(mesh, Welded(shape));
  return mesh;
}

}  // namespace lumi
