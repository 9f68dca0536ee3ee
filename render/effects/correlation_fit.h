// How radiance at a point varies with direction, read off the photos (thesis 8.1.1: "as the data have it"): a variogram
// over the proxy that is rendered over, and the falling leaves that fit it. Two photos differ at a point of a rough
// proxy mostly because they show different places; noise and gloss add to it. docs/optimum.md.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/radiance/optimum/leaves_by_place.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

struct CorrelationBin {
  double angle_rad = 0;    // mean of the pairs' angles
  double correlation = 0;  // 1 - half their mean squared difference over that of pairs far apart; may be negative
  long pairs = 0;
};

// The correlation of some places.
struct CorrelationKind {
  LeavesKind leaves;
  double share = 0;  // of the points
  std::vector<CorrelationBin> bins;
};

struct MeasuredCorrelation {
  double r_min_rad = 0, r_max_rad = 0;  // of the falling leaves that fit
  double noise = 0;                     // RadianceSettings::noise: correlation is PSame / (1 + noise) beside 0
  double rms = 0;                       // of the fit, over the bins by their pairs
  long points = 0;
  std::vector<CorrelationBin> bins;  // ascending
  // Kinds that differ by place; empty: not asked for.
  std::vector<CorrelationKind> kinds;
  std::shared_ptr<const LeavesByPlace> by_place;
};

// Points of the proxy at random pixels of the photos in use (empty: all), with the colours of those that see them; the
// same for the same photos. nullopt: too few pairs to tell (fewer than kLeastPairs in three bins), or photos that do
// not differ. Photos need their levels; exposures are divided out. Parallel.
// regions > 1: also sets kinds and by_place, over a grid with so many nodes along the longest side of the box of nine
// tenths of the points. A node with few points is drawn towards the whole scene.
std::optional<MeasuredCorrelation> MeasureCorrelation(const Scene& scene, const Mesh& proxy,
                                                      const std::vector<Photo>& photos, const std::vector<bool>& use,
                                                      int regions = 1);

// The leaves whose P_same fits a correlogram best, by weights of the bins' pairs. nullopt for fewer than three bins.
std::optional<MeasuredCorrelation> FitLeaves(const std::vector<CorrelationBin>& bins);

}  // namespace lumi
