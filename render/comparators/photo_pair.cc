#include "render/comparators/photo_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumi {
namespace {

constexpr std::size_t kAskedForPairs = 10;  // photos nearest to the view
constexpr double kOwnWeight = 1e-6;         // least weight of a photo, so that it fills what the other one does not see

// Whether the photo's frame, or its mirror image behind it, shows the point: the epipole lies in the picture then.
bool ShowsEpipole(const RenderView& view, const Eigen::Vector3d& x) {
  const Eigen::Vector3d q = view.P * x.homogeneous();
  if (!(std::abs(q.z()) > 1e-9 * q.norm())) return false;
  const double u = q.x() / q.z(), v = q.y() / q.z();
  return u >= 0 && v >= 0 && u <= view.size_px.x() && v <= view.size_px.y();
}

}  // namespace

std::optional<PhotoPair> PairAround(const Sources& sources, const ViewSetup& setup, double median_depth,
                                    bool rectifiable) {
  std::vector<RankedPhoto> near = RankPhotos(sources, setup, median_depth);
  near.resize(std::min(near.size(), kAskedForPairs));
  const auto view = [&](const RankedPhoto& r) -> const RenderView& {
    return sources.views[static_cast<std::size_t>(setup.sources.view[static_cast<std::size_t>(r.photo)])];
  };
  std::optional<PhotoPair> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < near.size(); ++a)
    for (std::size_t b = a + 1; b < near.size(); ++b) {
      const RenderView &first = view(near[a]), &second = view(near[b]);
      const Eigen::Vector3d way = second.centre - first.centre;
      if (!(way.squaredNorm() > 0)) continue;
      if (rectifiable && (ShowsEpipole(first, second.centre) || ShowsEpipole(second, first.centre))) continue;
      const double share = std::clamp((setup.desired.centre - first.centre).dot(way) / way.squaredNorm(), 0.0, 1.0);
      const double aside = (first.centre + share * way - setup.desired.centre).norm() / median_depth;
      // The view's distance from the baseline, plus the distance to be interpolated: of two baselines through the view,
      // the shorter one wins.
      const double cost = aside + 0.5 * ((1 - share) * near[a].distance + share * near[b].distance);
      if (cost < least) {
        least = cost;
        best = {near[a].photo, near[b].photo, share};
      }
    }
  return best;
}

void PairMethod::AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const {
  for (const std::int32_t j : point.seeing)
    if (j == pair_.first || j == pair_.second) {
      const double share = j == pair_.second ? pair_.share : 1 - pair_.share;
      out.camera.push_back(j);
      out.weight.push_back(static_cast<float>(std::max(share, kOwnWeight)));
    }
  if (!out.camera.empty()) return;
  out.camera.push_back(NearestInAngle(point));
  out.weight.push_back(1);
}

}  // namespace lumi
