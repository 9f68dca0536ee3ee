#include "render/tradeoff/ray_bench.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "render/comparators/comparators.h"
#include "render/radiance/reconstruct.h"
#include "scene/geometry/median.h"
#include "scene/geometry/rigid3.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

double SpacingOf(const std::vector<RenderView>& views) {
  std::vector<double> nearest;
  for (std::size_t i = 0; i < views.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < views.size(); ++j)
      if (i != j) best = std::min(best, (views[i].centre - views[j].centre).norm());
    if (std::isfinite(best)) nearest.push_back(best);
  }
  return nearest.empty() ? 0.1 : std::max(1e-6, Median(nearest));
}

}  // namespace

RayBench::RayBench(const Scene& scene, const Mesh& proxy)
    : scene_(scene), traced_(scene, proxy), spacing_(SpacingOf(traced_.sources.views)) {
  // Test views get the focal length and size of a photo.
  const RenderView& v = sources().views[sources().views.size() / 2];
  const Eigen::Matrix3d M = v.P.leftCols<3>() / v.P.row(2).head<3>().norm();
  size_px_ = v.size_px;
  focal_px_ = std::sqrt(std::abs(M.determinant()));
}

std::vector<RayBench::Ray> RayBench::RandomRays(int count, double spread, unsigned seed) const {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1), both(-1, 1);
  std::vector<Ray> rays;
  const std::vector<RenderView>& views = sources().views;
  for (int tries = 0; tries < 50 * count && static_cast<int>(rays.size()) < count; ++tries) {
    const std::size_t j = static_cast<std::size_t>(unit(random) * static_cast<double>(views.size())) % views.size();
    const RenderView& v = views[j];
    const Eigen::Vector2d x_px(v.size_px.x() * (0.1 + 0.8 * unit(random)), v.size_px.y() * (0.1 + 0.8 * unit(random)));
    const auto direction = RayDirection(v.P, x_px);
    if (!direction) continue;
    const Eigen::Vector3d eye =
        v.centre + spread * spacing_ * Eigen::Vector3d(both(random), both(random), both(random));
    const Eigen::Vector3d d = direction->normalized();
    const double t = Trace(eye, d);
    if (std::isfinite(t) && t > 0) rays.push_back({eye, eye + t * d, static_cast<std::int32_t>(j)});
  }
  if (rays.empty())
    throw DataError("no ray from near the cameras meets the proxy", "choose another --proxy", scene_.folder);
  return rays;
}

double RayBench::Trace(const Eigen::Vector3d& eye, const Eigen::Vector3d& d) const {
  const Eigen::Vector3f direction = d.cast<float>();
  float t = 0;
  traced_.tracer.Trace(eye.cast<float>(), {&direction, 1}, {&t, 1});
  return t;
}

Eigen::Matrix3d RayBench::Facing(const Eigen::Vector3d& eye, const Eigen::Vector3d& p) const {
  Eigen::Matrix3d K;
  K << focal_px_, 0, 0.5 * size_px_.x(), 0, focal_px_, 0.5 * size_px_.y(), 0, 0, 1;
  return K * LookAt(eye, p, scene_.normalized_from_world.rotation * scene_.up).R();
}

std::vector<double> RayBench::WeightsAt(const Sources& sources, const Eigen::Vector3d& eye, const Eigen::Vector3d& p,
                                        const RadianceSettings& s, const Eigen::Matrix3d& KR,
                                        const VisibilityMaps* visibility) const {
  RenderView desired;
  desired.P.leftCols<3>() = KR;
  desired.P.col(3) = -KR * eye;
  desired.centre = eye;
  desired.size_px = size_px_;
  // MakeViewSetup takes world coordinates; these are normalised already.
  const Sources here = {sources.views, Similarity3(), sources.fields};
  ViewSetup setup = MakeViewSetup(here, desired, s);
  if (s.method != Algorithm::kUlr) setup.method = MakeComparator(here, traced_.tracer, setup);
  // Computes the direction as a renderer does: from the pixel, by the matrix.
  const Eigen::Vector3d pixel = KR * (p - eye);
  RaySamples rays;
  rays.exact_direction = {
      (setup.ray_from_pixel * Eigen::Vector3d(pixel.x() / pixel.z(), pixel.y() / pixel.z(), 1)).normalized()};
  rays.direction = {rays.exact_direction[0].cast<float>()};
  rays.t = {0.0F};
  rays.normal.resize(1);
  rays.face = {-1};
  // Finds the surface at p even if something occludes it, by tracing from shortly before p.
  constexpr double kShortlyBefore = 1e-3;  // of the distance
  traced_.tracer.Trace((p - kShortlyBefore * (p - eye)).cast<float>(), rays.direction, rays.t, rays.normal, rays.face);
  rays.t = {static_cast<float>((p - eye).norm())};
  rays.exact_t = {(p - eye).norm()};
  if (setup.method) setup.method->Meet(rays);
  WeightTable table;
  OptimumCounts counts;
  WeighScratch scratch;
  Reconstruct(setup, visibility, rays, table, counts, scratch);
  std::vector<double> weights(sources.views.size(), 0.0);
  for (std::size_t i = 0; i < table.camera.size(); ++i)
    weights[static_cast<std::size_t>(table.camera[i])] = static_cast<double>(table.weight[i]);
  return weights;
}

double RayBench::LargestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  double d = 0;
  for (std::size_t i = 0; i < a.size(); ++i) d = std::max(d, std::abs(a[i] - b[i]));
  return d;
}

}  // namespace lumi
