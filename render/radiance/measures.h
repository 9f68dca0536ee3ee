// What is measured between a ray and each photo, one idea a file in measures/, and how it comes together (thesis sec. 4.2,
// corrected: docs/render.md). A new measure is a file there, a field of Measures, and a term of Combined.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "render/radiance/visibility.h"

namespace lumi {

// Field-of-view value of a point on a photo's very border: it is still seen, and at an epipole it counts.
constexpr float kBarelySeen = 1e-30F;

// Values of one ray for every photo, arrays of RelativeSources::padded. Left alone where their measure is off.
struct Measures {
  std::vector<float> theta;   // angle at the proxy point, rad
  std::vector<float> f;       // field of view, [0,1]; 0 where the photo is left out
  std::vector<float> r;       // resolution value, [0,1]: 1 as good as the view's own (dissimilarity: 2 r_max |1 - r|)
  std::vector<float> tau;     // time, in units of 2 r_max: 0 in the inner half of the window, 1 at its edge, growing beyond
  std::vector<float> v;       // visibility, (0,1]; filled by EvaluateVisibility only
};

// theta, f and, where they are on, r and tau. `normal` is read by Resolution::kJacobian only.
void EvaluateMeasures(const RelativeSources& sources, const RadianceSettings& settings, const Eigen::Vector3f& direction, float t,
                      const Eigen::Vector3f& normal, Measures& out);
// v of every photo with f > 0; 1 where `maps` is nullptr or empty.
void EvaluateVisibility(const RelativeSources& sources, const VisibilityMaps* maps, const Eigen::Vector3f& direction, float t,
                        Measures& out);

}  // namespace lumi
