// The unstructured lumigraph of SIBR (Bonopera et al., sibr.gitlabpages.inria.fr, 2020), ulr_v2 and ulr_v3, as their
// fragment shaders have it: the angle itself in place of 1/angle, for resolution (photo's distance - view's distance) /
// photo's distance, both at least 1e-4; the four least penalties count 1 - penalty / fourth penalty; frustum and
// occlusion are hard tests.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/comparators/methods.h"
#include "render/comparators/point_method.h"

namespace lumi {
namespace {

constexpr double kLeastPenalty = 1e-4, kThresholdOverLast = 1.0000001, kNoPhoto = 1e5;

class SibrUlr final : public PointMethod {
 public:
  explicit SibrUlr(const RadianceSettings& s)
      : photos_(static_cast<std::size_t>(std::clamp(OrOwn(s.method_count, 4), 2.0, 16.0))),
        beta_(OrOwn(s.method_parameter, 0.1)) {}

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    struct Candidate {
      double penalty;
      std::int32_t photo;
    };
    std::array<Candidate, 16> best;
    best.fill({kNoPhoto, -1});
    const Eigen::Vector3d p = point.point();
    for (const std::int32_t j : point.seeing) {
      const double to_photo = (p - CentreOf(point.setup, j)).norm();
      const double angle = std::max<double>(kLeastPenalty, point.theta[static_cast<std::size_t>(j)]);
      const double resolution = std::max(kLeastPenalty, to_photo > 0 ? (to_photo - point.t) / to_photo : 0.0);
      const Candidate c{angle + beta_ * resolution, j};
      if (!(c.penalty < best[photos_ - 1].penalty)) continue;
      std::size_t i = photos_ - 1;
      for (; i > 0 && best[i - 1].penalty > c.penalty; --i) best[i] = best[i - 1];
      best[i] = c;
    }
    const double threshold = kThresholdOverLast * best[photos_ - 1].penalty;
    for (std::size_t i = 0; i < photos_ && best[i].photo >= 0; ++i) {
      out.camera.push_back(best[i].photo);
      out.weight.push_back(static_cast<float>(i + 1 < photos_ ? std::max(0.0, 1 - best[i].penalty / threshold)
                                                              : 1 - 1 / kThresholdOverLast));
    }
  }

 private:
  std::size_t photos_;
  double beta_;
};

}  // namespace

std::shared_ptr<const RayMethod> MakeSibrUlr(const Sources&, const ProxyTracer&, const ViewSetup& setup) {
  return std::make_shared<SibrUlr>(setup.settings);
}

}  // namespace lumi
