// What is read off all of a scene's photos before pictures are made: their exposures, and the grids of the measures
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
      grids;  // by the measure's name, one a view; none where photos do not differ

  PhotoFacts Facts() const;
};

// Of the effects that are `wanted`, by name. `photos`: as ReadPhotos has them; nullptr: each is read here, once for
// each effect.
PhotoEstimates EstimateFromPhotos(const Scene& scene, const std::vector<Photo>* photos,
                                  const std::function<bool(std::string_view)>& wanted, ProgressSink& sink);
// To the scene's views. `corrections`: of the photos that will be read.
void Apply(const PhotoEstimates& estimates, const Corrections& corrections, Scene& scene);

}  // namespace lumi
