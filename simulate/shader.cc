#include "simulate/shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/noise.h"

namespace lumi {
namespace {

using Eigen::Vector3d;
constexpr int kMirrorDepth = 2;
constexpr double kTurn = 2 * std::numbers::pi;

// A direction within `radius_rad` of `axis`: `u`, `v` in [0, 1) pick the point of the disc.
Vector3d InCone(const Vector3d& axis, double radius_rad, double u, double v) {
  const Vector3d side = axis.unitOrthogonal();
  const Vector3d other = axis.cross(side);
  const double r = std::tan(radius_rad) * std::sqrt(u);
  return (axis + side * (r * std::cos(kTurn * v)) + other * (r * std::sin(kTurn * v))).normalized();
}

Rgb Mix(const Rgb& a, const Rgb& b, double t) { return a + static_cast<float>(t) * (b - a); }

}  // namespace

Shader::Shader(const SceneDescription& scene, const Tracer& tracer)
    : scene_(scene),
      tracer_(tracer),
      dome_(scene.background.texture),
      environment_dome_(scene.environment ? scene.environment->texture : scene.background.texture) {
  for (const MaterialDescription& material : scene.materials) textures_.emplace_back(material.texture);
  for (const LightDescription& lamp : scene.lights) {
    std::vector<Vector3d>& points = lamp_points_.emplace_back();
    const int n = scene.samples_per_pixel;
    for (int i = 0; i < n; ++i)
      points.push_back(InCone(lamp.towards, lamp.size_rad, (i + 0.5) / n, 0.6180339887498949 * i));
  }
}

Rgb Shader::Background(const Vector3d& direction, double pixel_angle, int depth) const {
  const bool mirrored = depth > 0 && scene_.environment;
  const BackgroundDescription& background = mirrored ? *scene_.environment : scene_.background;
  switch (background.kind) {
    case BackgroundKind::kColor: return background.horizon;
    case BackgroundKind::kGradient: {
      const double z = direction.normalized().z();
      return z >= 0 ? Mix(background.horizon, background.zenith, std::sqrt(z))
                    : Mix(background.horizon, background.ground, std::min(1.0, -8 * z));
    }
    case BackgroundKind::kTexture: {
      SurfacePlace place;
      const Vector3d unit = direction.normalized();
      place.x_in_object = unit.cast<float>();
      place.uv =
          Eigen::Vector2d(std::atan2(unit.x(), unit.y()), std::asin(std::clamp(unit.z(), -1.0, 1.0))).cast<float>();
      place.footprint = static_cast<float>(pixel_angle);
      return (mirrored ? environment_dome_ : dome_).At(place);
    }
  }
  return background.horizon;
}

Rgb Shader::Radiance(const Query& query, long& rays) const { return Trace(query, 0, 0, rays); }

Rgb Shader::Trace(const Query& query, double distance_before, int depth, long& rays) const {
  ++rays;
  const auto hit = tracer_.Trace(query.ray, *query.parts);
  if (!hit) return Background(query.ray.direction, query.pixel_angle, depth);
  return Shade(query, *hit, distance_before + hit->t, depth, rays);
}

Shader::Illumination Shader::Illuminate(const Query& query, const Hit& hit, long& rays) const {
  const MaterialDescription& material = scene_.materials[static_cast<std::size_t>(hit.material)];
  const Vector3d& n = hit.shading_normal;
  const Vector3d start = hit.x_in_world + SurfaceOffset(hit.x_in_world, tracer_.Extent()) * hit.normal;
  Illumination sum{Mix(scene_.ambient_ground, scene_.ambient_sky, 0.5 + 0.5 * n.z()), Rgb::Zero()};
  for (std::size_t lamp_index = 0; lamp_index < scene_.lights.size(); ++lamp_index) {
    const LightDescription& lamp = scene_.lights[lamp_index];
    Vector3d to_light = lamp.towards;
    double far = 1e3 * tracer_.Extent();
    double strength = 1;
    if (lamp.directional) {
      if (lamp.size_rad > 0) {
        // The same few points of the lamp for every pixel: soft shadows without grain.
        to_light = lamp_points_[lamp_index][static_cast<std::size_t>(query.sample) % lamp_points_[lamp_index].size()];
      }
    } else {
      to_light = lamp.towards - start;
      far = to_light.norm();
      to_light /= far;
      if (lamp.reach > 0) strength = 1 / (1 + far * far / (lamp.reach * lamp.reach));
    }
    const double cosine = n.dot(to_light);
    if (cosine <= 0 || hit.normal.dot(to_light) <= 0) continue;
    if (lamp.shadows) {
      ++rays;
      if (tracer_.IsBlocked({start, to_light}, far * (1 - 1e-6), *query.parts)) continue;
    }
    const Rgb arriving = lamp.color * static_cast<float>(strength);
    sum.diffuse += arriving * static_cast<float>(cosine);
    if (material.specular > 0) {
      const double peak = std::max(0.0, n.dot((to_light - query.ray.direction).normalized()));
      sum.highlight += arriving * (static_cast<float>(material.specular) *
                                   std::pow(static_cast<float>(peak), static_cast<float>(material.shininess)));
    }
  }
  return sum;
}

Rgb Shader::Albedo(const Hit& hit, float footprint) const {
  return textures_[static_cast<std::size_t>(hit.material)].At({hit.x_in_object.cast<float>(), hit.uv, footprint});
}

Rgb Shader::Shade(const Query& query, const Hit& hit, double distance, int depth, long& rays) const {
  const MaterialDescription& material = scene_.materials[static_cast<std::size_t>(hit.material)];
  const Vector3d to_eye = -query.ray.direction;
  // The area a sample covers is longer than wide at a slant; its geometric mean is what one width can say.
  const double facing = std::max(0.05, hit.normal.dot(to_eye));
  const Rgb albedo = Albedo(hit, static_cast<float>(distance * query.pixel_angle / std::sqrt(facing)));
  if (!material.lit) return albedo;
  const Illumination light = Illuminate(query, hit, rays);
  const Rgb color = albedo.cwiseProduct(light.diffuse) + light.highlight;
  if (material.mirror <= 0 || depth >= kMirrorDepth) return color;

  const Vector3d& n = hit.shading_normal;
  const double cosine = std::clamp(n.dot(to_eye), 0.0, 1.0);
  const double share = material.mirror + (1 - material.mirror) * std::pow(1 - cosine, 5);  // Schlick 1994
  Query mirrored = query;
  Vector3d direction = (2 * n.dot(to_eye) * n - to_eye).normalized();
  if (material.roughness > 0) {
    const double u = (query.sample + UnitFromBits(HashBits(query.random, 21))) / query.samples;
    direction = InCone(direction, material.roughness, u, UnitFromBits(HashBits(query.random, 22)));
    mirrored.pixel_angle = std::max(query.pixel_angle, material.roughness);
  }
  if (hit.normal.dot(direction) <= 0) return color;  // a smoothed normal may send it below the surface
  mirrored.ray = {hit.x_in_world + SurfaceOffset(hit.x_in_world, tracer_.Extent()) * hit.normal, direction};
  return Mix(color, Trace(mirrored, distance, depth + 1, rays), share);
}

Rgb Shader::DiffuseColor(const Hit& hit, const PartPoses& parts, long& rays) const {
  Query query;
  query.ray.direction = -hit.normal;
  query.parts = &parts;
  const bool lit = scene_.materials[static_cast<std::size_t>(hit.material)].lit;
  const Rgb albedo = Albedo(hit, 0);
  return lit ? Rgb(albedo.cwiseProduct(Illuminate(query, hit, rays).diffuse)) : albedo;
}

}  // namespace lumi
