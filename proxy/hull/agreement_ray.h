// Rays through the pixels of silhouettes, followed through all other silhouettes: what dilation makes them agree on
// some point of the ray, and which views stand in the way where that is too much.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "proxy/hull/silhouette_cone.h"

namespace lumi {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
};

// The part of a ray within the box that hulls are looked for in, in steps of about a pixel of the view that sees it
// finest.
struct AgreementRay {
  Eigen::Vector3d start = Eigen::Vector3d::Zero(), step = Eigen::Vector3d::Zero();  // in the cones' frame
  int steps = 0;                                                                    // none: it misses the box
  float depth_px = 0;  // of its pixel inside its silhouette
  Eigen::Vector3d At(double s) const { return start + s * step; }
};

class RayCaster {
 public:
  // box: in the cones' frame, whose unit is `unit` world lengths and whose origin is `origin`. The views and cones are
  // kept by reference: cones may be changed, not moved.
  RayCaster(const std::vector<SilhouetteView>& views, const std::vector<SilhouetteCone>& cones, const Box& box,
            const Eigen::Vector3d& origin, double unit);
  // Through the centre of pixel (x, y); nullopt where the camera is singular.
  std::optional<AgreementRay> Through(std::size_t view, int x, int y, float depth_px) const;
  // Evenly spread over a silhouette.
  std::vector<AgreementRay> Sample(std::size_t view, int count) const;

 private:
  const std::vector<SilhouetteView>& views_;
  const std::vector<SilhouetteCone>& cones_;
  Box box_;
  Eigen::Vector3d origin_;
  double unit_, finest_ = 0;
};

constexpr float kSparedDilationPx = 0.25F;  // that everybody can spare: less is not asked for

struct RayAgreement {
  float needed_px = std::numeric_limits<float>::infinity();  // dilation; at most kSparedDilationPx counts as that
  // Where that is too much: the views that stand in the way where they cost least, and where that is. Empty: too many
  // do everywhere.
  std::vector<std::int32_t> blockers;
  double blocked_at = 0;  // in steps
};

// order: the cones that take part. cap_px: what is too much.
RayAgreement Follow(const AgreementRay& ray, const std::vector<SilhouetteCone>& cones,
                    const std::vector<std::int32_t>& order, double cap_px);

// Views far from each other in the list first: a point outside is found to be so by few of them.
std::vector<std::int32_t> SpreadOrder(const std::vector<std::size_t>& views);

}  // namespace lumi
