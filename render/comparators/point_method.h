// What most published methods share: weights at a point of the surface, of the photos that see it.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/evaluate.h"
#include "render/radiance/ray_method.h"

namespace lumi {

// A point of the surface on a ray of the view, and what photos show of it. All relative to the view's centre, in the
// normalised frame; arrays have an entry a photo (RelativeSources::count).
struct PhotosAtPoint {
  const ViewSetup& setup;
  const VisibilityMaps* visibility;
  Eigen::Vector3d direction;  // unit
  double t = 0;
  Eigen::Vector3d normal;  // unit, towards the view
  std::int32_t face = -1;  // of the proxy
  const std::vector<float>&theta, &f, &v;
  const std::vector<std::int32_t>& seeing;  // photos that see the point or, if none does, those that contain it

  Eigen::Vector3d point() const { return t * direction; }
};

// What a method keeps from pixel to pixel within one window of the picture.
struct WindowMemo {
  std::unordered_map<std::uint64_t, std::array<std::pair<std::int32_t, float>, 3>> photos_of_cell;
};

// The measures of a ray that comparators read: angle, field of view, visibility. Scratch, one a thread.
class PointSight {
 public:
  // visibility: nullptr if the proxy hides nothing, or the method ignores occlusion. Both arguments must outlive this
  // object.
  PointSight(const ViewSetup& setup, const VisibilityMaps* visibility);
  // Replaces the arrays. False: no photo contains the point.
  bool Look(const Eigen::Vector3d& direction, double t);
  const std::vector<float>& theta() const { return measures_.theta; }
  const std::vector<float>& f() const { return measures_.f; }
  const std::vector<float>& v() const { return measures_.v; }
  const std::vector<std::int32_t>& seeing() const { return seeing_; }

 private:
  const ViewSetup& setup_;
  const VisibilityMaps* visibility_;
  RadianceSettings settings_;  // angle and field of view alone
  Measures measures_;
  std::vector<std::int32_t> seeing_;
};

class PointMethod : public RayMethod {
 public:
  void Weigh(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
             WeightTable& table) const final;

 protected:
  // Appends photos of `point.seeing` and weights with a positive sum; they are made to sum to 1. Nothing: a hole.
  virtual void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const = 0;
  // False for a method without geometry: a photo counts even if the proxy hides the point from it.
  virtual bool heeds_visibility() const { return true; }
};

// C_j less the view's centre.
inline Eigen::Vector3d CentreOf(const ViewSetup& setup, std::int32_t photo) {
  const auto j = static_cast<std::size_t>(photo);
  return {setup.sources.dx[j], setup.sources.dy[j], setup.sources.dz[j]};
}
// The photo of `point.seeing` that is nearest to the ray in angle. There is one.
std::int32_t NearestInAngle(const PhotosAtPoint& point);
// Cosine between the surface's normal and the direction to the photo, 0 from behind.
double FacingOf(const PhotosAtPoint& point, std::int32_t photo);
// A setting below 0 is the paper's own.
inline double OrOwn(double setting, double own) { return setting < 0 ? own : setting; }

}  // namespace lumi
