#include "render/world/visibility_maps.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "scene/program/parallel.h"

namespace lumi {

bool CanOcclude(const Mesh& proxy) {
  if (proxy.faces.size() < 2) return false;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& v : proxy.vertices) mean += v;
  mean /= static_cast<double>(proxy.vertices.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& v : proxy.vertices) scatter += (v - mean) * (v - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter, Eigen::EigenvaluesOnly);
  constexpr double kFlat = 1e-12;  // squared: a millionth of its extent
  return eigen.eigenvalues()[0] > kFlat * eigen.eigenvalues()[2];
}

VisibilityMaps MakeVisibilityMaps(const Sources& sources, const ProxyTracer& proxy) {
  if (sources.views.empty()) return {};
  const int count = static_cast<int>(sources.views.size());
  const int side = VisibilityMaps::SuggestedSide(count);
  const Eigen::Vector2i size = sources.views.front().size_px;
  const double scale = static_cast<double>(side) / size.maxCoeff();
  VisibilityMaps maps(count, std::max(1, static_cast<int>(std::lround(size.x() * scale))),
                      std::max(1, static_cast<int>(std::lround(size.y() * scale))));
  ParallelFor(sources.views.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) maps.Fill(static_cast<int>(j), sources.views[j], proxy);
  });
  return maps;
}

VisibilityMaps ProxyVisibility(const Sources& sources, const Mesh& proxy, const ProxyTracer& tracer) {
  return CanOcclude(proxy) ? MakeVisibilityMaps(sources, tracer) : VisibilityMaps();
}

TracedProxy::TracedProxy(const Scene& scene, const Mesh& proxy)
    : sources(MakeSources(scene)),
      tracer(proxy, sources.normalized_from_world),
      maps(ProxyVisibility(sources, proxy, tracer)) {}

TracedProxy::TracedProxy(const PictureWorld& world)
    : sources(world.sources), tracer(world.proxy, sources.normalized_from_world) {}

}  // namespace lumi
