// Chen and Williams, "View Interpolation for Image Synthesis", SIGGRAPH 1993: the photos nearest to the whole view are
// warped by their correspondences and dissolved into one another; holes are filled from the next photo that sees them.
// The correspondences are the proxy's.
#include <algorithm>
#include <cmath>

#include "render/comparators/methods.h"
#include "render/comparators/photo_rank.h"
#include "render/comparators/point_method.h"

namespace lumi {
namespace {

class ChenWilliams final : public PointMethod {
 public:
  ChenWilliams(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup)
      : ranked_(RankPhotos(sources, setup, MedianDepth(setup, proxy))),
        photos_(static_cast<std::size_t>(std::max(1.0, OrOwn(setup.settings.method_count, 2)))) {
    const double power = OrOwn(setup.settings.method_parameter, 1);
    place_.assign(static_cast<std::size_t>(setup.sources.count), ranked_.size());
    for (std::size_t i = 0; i < ranked_.size(); ++i) {
      place_[static_cast<std::size_t>(ranked_[i].photo)] = i;
      // Of two photos with the view between them, 1/distance is the dissolve that is linear along the way.
      weight_.push_back(std::pow(std::max(ranked_[i].distance, kOwnView), -power));
    }
  }

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    std::size_t first = ranked_.size();
    for (const std::int32_t j : point.seeing) {
      const std::size_t place = place_[static_cast<std::size_t>(j)];
      first = std::min(first, place);
      if (place >= photos_) continue;
      out.camera.push_back(j);
      out.weight.push_back(static_cast<float>(weight_[place]));
    }
    if (!out.camera.empty()) return;
    out.camera.push_back(ranked_[first].photo);
    out.weight.push_back(1);
  }

 private:
  static constexpr double kOwnView = 1e-9;  // rad: a view nearer than this is the photo's own
  std::vector<RankedPhoto> ranked_;
  std::size_t photos_;
  std::vector<std::size_t> place_;  // of each photo in ranked_
  std::vector<double> weight_;      // by rank
};

}  // namespace

std::shared_ptr<const RayMethod> MakeChenWilliams(const Sources& sources, const ProxyTracer& proxy,
                                                  const ViewSetup& setup) {
  return std::make_shared<ChenWilliams>(sources, proxy, setup);
}

}  // namespace lumi
