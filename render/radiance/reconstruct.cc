#include "render/radiance/reconstruct.h"

#include <cmath>

namespace lumi {
namespace {

void WeighIdentity(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                   WeighScratch& scratch) {
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.assign(rays.size(), 0.0F);
  std::vector<float> everyone;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays.t[i] > 0 && std::isfinite(rays.t[i])) {
      const Eigen::Vector3f normal = i < rays.normal.size() ? rays.normal[i] : Eigen::Vector3f::Zero();
      if (setup.settings.k == 0) {
        table.alpha[i] = WeighAll(setup.sources, visibility, rays.direction[i], rays.t[i], setup.settings, scratch, everyone, normal);
        for (std::size_t j = 0; j < everyone.size(); ++j)
          if (everyone[j] > 0) {
            table.camera.push_back(static_cast<std::int32_t>(j));
            table.weight.push_back(everyone[j]);
          }
      } else {
        const RayWeights r = Weigh(setup.sources, visibility, rays.direction[i], rays.t[i], setup.settings, scratch, normal);
        table.alpha[i] = r.alpha;
        table.camera.insert(table.camera.end(), r.camera.begin(), r.camera.begin() + r.count);
        table.weight.insert(table.weight.end(), r.weight.begin(), r.weight.begin() + r.count);
      }
    }
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
}

}  // namespace

void Reconstruct(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                 OptimumCounts& counts, WeighScratch& scratch) {
  if (setup.settings.similarity == Similarity::kFull)
    WeighOptimal(setup, visibility, rays, table, counts);
  else
    WeighIdentity(setup, visibility, rays, table, scratch);
}

}  // namespace lumi
