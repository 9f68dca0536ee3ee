// Pighin, Hecker, Lischinski, Szeliski and Salesin, "Synthesizing Realistic Facial Expressions from Photographs",
// SIGGRAPH 1998, its view-dependent texture mapping: the two photographs to either side of the view, seen from the
// object, blended by the angles to them; at a point also by the cosine under which they saw it (positional certainty),
// feathered at their borders and where the surface hides itself.
#include <algorithm>
#include <cmath>
#include <limits>

#include "render/comparators/methods.h"
#include "render/comparators/photo_rank.h"
#include "render/comparators/view_share_method.h"

namespace lumi {
namespace {

// The shares of the two photographs; 0 for all others.
std::vector<double> SharesOfTwo(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup) {
  const double distance = MedianDepth(setup, proxy);
  const Eigen::Vector3d object = distance * AxisOf(setup.desired), wanted = -object.normalized();
  std::vector<double> share(static_cast<std::size_t>(setup.sources.count), 0.0);
  struct Photo {
    std::int32_t photo;
    double angle;
    Eigen::Vector3d across;  // the photo's direction less the wanted one's part
  };
  std::vector<Photo> photos;
  for (const RankedPhoto& r : RankPhotos(sources, setup, distance)) {
    const Eigen::Vector3d to = (CentreOf(setup, r.photo) - object).normalized();
    photos.push_back(
        {r.photo, 2 * std::atan2((to - wanted).norm(), (to + wanted).norm()), to - to.dot(wanted) * wanted});
  }
  if (photos.empty()) return share;
  std::ranges::stable_sort(photos, {}, &Photo::angle);
  // The nearest photograph, and the nearest one on the view's other side (the paper's photographs go round a head).
  const Photo& first = photos.front();
  const Photo* second = nullptr;
  for (std::size_t i = 1; i < photos.size() && !second; ++i)
    if (photos[i].across.dot(first.across) < 0) second = &photos[i];
  if (!second && photos.size() > 1) second = &photos[1];
  const double both = second ? first.angle + second->angle : 0;
  share[static_cast<std::size_t>(first.photo)] = both > 0 ? second->angle / both : 1;
  if (both > 0) share[static_cast<std::size_t>(second->photo)] = first.angle / both;
  return share;
}

}  // namespace

std::shared_ptr<const RayMethod> MakePighin(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup) {
  return std::make_shared<ViewShareMethod>(SharesOfTwo(sources, proxy, setup),
                                           OrOwn(setup.settings.method_parameter, 1));
}

}  // namespace lumi
