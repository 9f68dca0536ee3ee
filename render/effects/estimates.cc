#include "render/effects/estimates.h"

#include "render/radiance/measures/list.h"

namespace lumi {

PhotoEstimates EstimateFromPhotos(const Scene& scene, const std::vector<Photo>* photos,
                                  const std::function<bool(std::string_view)>& wanted, ProgressSink& sink) {
  PhotoEstimates out;
  if (wanted(measure::Exposure::kName))
    out.exposures = photos ? EstimateExposures(scene, *photos) : EstimateExposures(scene, sink);
  MeasureList::ForEach([&]<typename M> {
    if constexpr (Estimated<M>)
      if (wanted(M::kName))
        if (auto grids = M::Estimate(scene, photos, sink); !grids.empty())
          out.grids[std::string(M::kName)] = std::move(grids);
  });
  return out;
}

PhotoFacts PhotoEstimates::Facts() const {
  PhotoFacts facts;
  facts.compared = exposures.has_value();
  if (!exposures) return facts;
  if (exposures->Differ()) facts.gain_spread = exposures->spread;
  if (exposures->white_balances.Differ()) facts.color_spread = exposures->white_balances.spread;
  if (exposures->vignetting.Seen()) facts.corner = exposures->vignetting.corner;
  return facts;
}

void Apply(const PhotoEstimates& estimates, const Corrections& corrections, Scene& scene) {
  if (estimates.exposures) Apply(*estimates.exposures, corrections, scene);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    View& view = scene.views[i];
    if (estimates.grids.empty()) continue;
    PhotoGrids grids = view.grids ? *view.grids : PhotoGrids();
    for (const auto& [name, of_views] : estimates.grids) grids[name] = of_views[i];
    view.grids = std::make_shared<const PhotoGrids>(std::move(grids));
  }
}

}  // namespace lumi
