// The measures between one ray and every photo: a kernel per measure that is on, over arrays of photos.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "render/radiance/visibility.h"

namespace lumi {

// Values of one ray for every photo, arrays of RelativeSources::padded. Left alone where their measure is off.
struct Measures {
  std::vector<float> theta;  // angle at the proxy point, rad
  std::vector<float> f;      // field of view, [0,1]; 0 where the photo is left out
  std::vector<float> v;      // visibility, (0,1]; filled by EvaluateVisibility only
  std::vector<float> terms;  // of h beside the angle: the sum of factor 2 r_max |own - value|; empty where none is on
  std::array<std::vector<float>, MeasureList::kCount> value;  // of each term of h

  template <Term M>
  const std::vector<float>& Of() const {
    return value[static_cast<std::size_t>(MeasureList::IndexOf<M>())];
  }
};

struct RayPoint;  // photo_sight.h

// Whether h has terms beside the angle.
bool HasTerms(const RadianceSettings& settings);

// theta, f and, where they are on, the terms. `normal` is read by Resolution::kJacobian only.
void EvaluateMeasures(const RelativeSources& sources, const RadianceSettings& settings,
                      const Eigen::Vector3f& direction, float t, const Eigen::Vector3f& normal, Measures& out);
// The terms alone: `value` and `terms`.
void EvaluateTerms(const RelativeSources& sources, const RadianceSettings& settings, const RayPoint& point,
                   Measures& out);
// v of every photo with f > 0; 1 where `maps` is nullptr or empty.
void EvaluateVisibility(const RelativeSources& sources, const VisibilityMaps* maps, const Eigen::Vector3f& direction,
                        float t, Measures& out);

// The terms that do not depend on the ray, summed, a number for each photo.
std::vector<float> PhotoTerms(const RelativeSources& sources, const RadianceSettings& settings);

}  // namespace lumi
