// The real-time blending weights at a ray (thesis sec. 5.1: identity similarity, k nearest, Eq. 5.1 windowed at the
// k+1st), from the dissimilarities h of dissimilarity.h: infinite where the camera is blind, continuous between, 0 at
// an epipole whatever f inside the photo (errata of Eq. 4.7: an additive, finite penalty lets blind cameras
// contribute). Weights are h_1/h_j - h_1/h_{k+1}, finite as h_1 -> 0, then normalised to sum 1; for
// Correlation::kFallingLeaves R(h_j) (1 - h_j/h_{k+1}).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "render/radiance/measures/evaluate.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "render/radiance/visibility.h"

namespace lumi {

// One ray's result for k <= kMaxBlend.
struct RayWeights {
  int count = 0;                               // cameras with a weight > 0
  std::array<std::int32_t, kMaxBlend> camera;  // into Sources::views
  std::array<float, kMaxBlend> weight;         // sum 1 (count > 0)
  float alpha = 0;                             // 0: a hole, no camera sees the point
};

// Photos and their weights, one after another.
struct WeightedPhotos {
  std::vector<std::int32_t> camera;
  std::vector<float> weight;
};

// Scratch for Weigh, one a thread.
struct WeighScratch {
  std::vector<float> h, f, everyone;
  Measures measures;
};

// What weighs photos in a view.
struct Weighing {
  const RelativeSources& sources;
  const VisibilityMaps* visibility;  // nullptr or empty maps: everything is visible
  const RadianceSettings& settings;
};

// A ray of the view, up to the proxy.
struct ProxyRay {
  // In double: rounded to float, one ray seen from two views is no longer the same ray.
  ProxyRay(const Eigen::Vector3d& unit_direction, double distance,
           const Eigen::Vector3f& of_proxy = Eigen::Vector3f::Zero())
      : direction(unit_direction), t(distance), normal(of_proxy) {}
  // If only floats are known: the direction is normalised in double.
  ProxyRay(const Eigen::Vector3f& unit_direction, float distance,
           const Eigen::Vector3f& of_proxy = Eigen::Vector3f::Zero())
      : ProxyRay(unit_direction.cast<double>().normalized(), static_cast<double>(distance), of_proxy) {}

  Eigen::Vector3d direction;  // unit, normalised frame
  double t;                   // distance along it to the proxy, normalised units, > 0
  Eigen::Vector3f normal;     // of the proxy there (read by Resolution::kJacobian; zero: it faces the view)
};

// settings.k in 1..kMaxBlend. Visibility is looked up only for cameras that may be among the k + 1 nearest.
RayWeights Weigh(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch);

// The same for every camera (k = all): weights_out has sources.count entries, sum 1. Returns alpha.
float WeighAll(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch, std::vector<float>& weights_out);

// The k nearest or all, as settings.k says: appends the photos with a weight above 0, in ascending order of h or of
// their number. Returns alpha.
float WeighRay(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch, WeightedPhotos& out);

}  // namespace lumi
