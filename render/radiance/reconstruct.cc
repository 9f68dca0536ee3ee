#include "render/radiance/reconstruct.h"

#include <cmath>

#include "render/radiance/optimum/leaves_by_place.h"

namespace lumi {
namespace {

void WeighIdentity(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                   WeighScratch& scratch) {
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.assign(rays.size(), 0.0F);
  WeightedPhotos row;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays.t[i] > 0 && std::isfinite(rays.t[i])) {
      const Eigen::Vector3f normal = i < rays.normal.size() ? rays.normal[i] : Eigen::Vector3f::Zero();
      row.camera.clear();
      row.weight.clear();
      const ProxyRay ray = i < rays.exact_t.size() ? ProxyRay(rays.exact_direction[i], rays.exact_t[i], normal)
                                                   : ProxyRay(rays.direction[i], rays.t[i], normal);
      table.alpha[i] = WeighRay({setup.sources, visibility, setup.settings}, ray, scratch, row);
      table.camera.insert(table.camera.end(), row.camera.begin(), row.camera.end());
      table.weight.insert(table.weight.end(), row.weight.begin(), row.weight.end());
    }
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
}

}  // namespace

void Reconstruct(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                 OptimumCounts& counts, WeighScratch& scratch) {
  if (setup.method)
    setup.method->Weigh(setup, visibility, rays, table);
  else if (setup.settings.similarity == Similarity::kFull && setup.settings.by_place)
    WeighByPlace(*setup.settings.by_place, setup, visibility, rays, table, counts);
  else if (setup.settings.similarity == Similarity::kFull)
    WeighOptimal(setup, visibility, rays, table, counts);
  else
    WeighIdentity(setup, visibility, rays, table, scratch);
}

}  // namespace lumi
