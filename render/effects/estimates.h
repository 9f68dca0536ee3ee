// What is estimated from all of a scene's photos before pictures are made: exposures, and the grids of the measures
// that have an estimator (radiance/measures/record.h).
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/effects/exposure.h"
#include "render/radiance/measures/record.h"
#include "scene/model/photo_grid.h"

namespace lumi {

struct PhotoEstimates {
  std::optional<Exposures> exposures;
  std::map<std::string, std::vector<PhotoGrid>>
      grids;  // by the measure's name, one for each view; empty if photos do not differ

  PhotoFacts Facts() const;
};

// Estimates what the effects named in `wanted` need. `photos`: as ReadPhotos has them; nullptr: each is read here, once
// for each effect.
PhotoEstimates EstimateFromPhotos(const Scene& scene, const std::vector<Photo>* photos,
                                  const std::function<bool(std::string_view)>& wanted, ProgressSink& sink);
// Writes the estimates to the scene's views. `corrections`: those that photos will be read with.
void Apply(const PhotoEstimates& estimates, const Corrections& corrections, Scene& scene);

}  // namespace lumi
