// Rays of a lumigraph and the weights of photos at them, by any method and without rendering a picture: for measuring
// properties of reconstruction.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "render/radiance/settings.h"
#include "render/world/visibility_maps.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

class RayBench {
 public:
  RayBench(const Scene& scene, const Mesh& proxy);

  // From a point near a source camera to the proxy, normalised frame.
  struct Ray {
    Eigen::Vector3d eye, p;
    std::int32_t near = 0;  // that camera
  };
  // spread: distance of eyes from the cameras along each axis, at most, in spacings. Throws DataError where no ray
  // meets the proxy.
  std::vector<Ray> RandomRays(int count, double spread = 0.3, unsigned seed = 7) const;

  // Distance to the proxy along a unit direction; +infinity where it is missed.
  double Trace(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const;
  // Median distance of a camera to its nearest neighbour, normalised units.
  double Spacing() const { return spacing_; }
  // Matrix of a camera at `eye` that looks at p, with a photo's focal length.
  Eigen::Matrix3d Facing(const Eigen::Vector3d& eye, const Eigen::Vector3d& p) const;

  // All photos' weights at p, seen from `eye` by a camera with this matrix; zeros: a hole. Throws what the method
  // throws.
  std::vector<double> WeightsAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& p, const RadianceSettings& s,
                                const Eigen::Matrix3d& KR) const {
    return WeightsAt(traced_.sources, eye, p, s, KR, Visibility(s));
  }
  // The same for other cameras (e.g. with one moved), as many as the scene has.
  std::vector<double> WeightsAt(const Sources& sources, const Eigen::Vector3d& eye, const Eigen::Vector3d& p,
                                const RadianceSettings& s, const Eigen::Matrix3d& KR,
                                const VisibilityMaps* visibility) const;

  const Sources& sources() const { return traced_.sources; }
  const VisibilityMaps* Visibility(const RadianceSettings& s) const {
    return s.visibility && !traced_.maps.empty() ? &traced_.maps : nullptr;
  }

  static double LargestDifference(const std::vector<double>& a, const std::vector<double>& b);

 private:
  const Scene& scene_;
  TracedProxy traced_;
  double spacing_ = 0, focal_px_ = 0;
  Eigen::Vector2i size_px_;
};

}  // namespace lumi
