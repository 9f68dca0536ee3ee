// Pulli, Cohen, Duchamp, Hoppe, Shapiro and Stuetzle, "View-based Rendering", EGWR 1997: three views whose directions
// enclose the wanted one, seen from the object. At a pixel a view counts by its share of that triangle (w_theta), by
// how squarely it saw the surface (w_phi), less towards its border (w_gamma), and softly by whether its surface is the
// one in front (soft z).
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "render/comparators/methods.h"
#include "render/comparators/photo_rank.h"
#include "render/comparators/view_share_method.h"

namespace lumi {
namespace {

constexpr double kFlat = 1e-12, kRounding = 1e-9;
constexpr std::size_t kAsked = 12;  // nearest views among which a triangle is looked for

// The barycentric coordinates of the desired view in a triangle of source views.
std::vector<double> SharesOfTriangle(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup) {
  const auto photos = static_cast<std::size_t>(std::max(1.0, OrOwn(setup.settings.method_count, 3)));
  const double distance = MedianDepth(setup, proxy);
  const Eigen::Vector3d object = distance * AxisOf(setup.desired);
  struct Direction {
    std::int32_t photo;
    Eigen::Vector3d unit;
    double angle;
  };
  std::vector<Direction> near;
  const Eigen::Vector3d wanted = -object.normalized();
  for (const RankedPhoto& r : RankPhotos(sources, setup, distance)) {
    const Eigen::Vector3d to = (CentreOf(setup, r.photo) - object).normalized();
    near.push_back({r.photo, to, 2 * std::atan2((to - wanted).norm(), (to + wanted).norm())});
  }
  std::ranges::stable_sort(near, {}, &Direction::angle);
  std::vector<double> share(static_cast<std::size_t>(setup.sources.count), 0.0);
  if (photos == 3 && near.size() >= 3) {
    near.resize(std::min(near.size(), kAsked));
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a + 2 < near.size(); ++a)
      for (std::size_t b = a + 1; b + 1 < near.size(); ++b)
        for (std::size_t c = b + 1; c < near.size(); ++c) {
          if (!(near[c].angle < smallest)) break;
          Eigen::Matrix3d corners;
          corners << near[a].unit, near[b].unit, near[c].unit;
          if (std::abs(corners.determinant()) < kFlat) continue;
          Eigen::Vector3d w = corners.inverse() * wanted;
          // At a photo's own position the other two weights are 0, up to rounding of either sign.
          if (w.minCoeff() < -kRounding) continue;
          w = w.cwiseMax(0.0);
          smallest = near[c].angle;
          std::ranges::fill(share, 0.0);
          share[static_cast<std::size_t>(near[a].photo)] = w.x() / w.sum();
          share[static_cast<std::size_t>(near[b].photo)] = w.y() / w.sum();
          share[static_cast<std::size_t>(near[c].photo)] = w.z() / w.sum();
        }
    if (std::isfinite(smallest)) return share;
  }
  // No triangle encloses the view: the nearest photos count by how much nearer they are than the next one.
  const std::size_t n = std::min(photos, near.size());
  const double edge = n < near.size() ? near[n].angle : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i)
    share[static_cast<std::size_t>(near[i].photo)] =
        std::isfinite(edge) && edge > near[i].angle ? 1 - near[i].angle / edge : (std::isfinite(edge) ? 1e-6 : 1.0);
  return share;
}

class Pulli final : public ViewShareMethod {
 public:
  using ViewShareMethod::ViewShareMethod;

 protected:
  // The soft z-buffer averages surfaces that lie nearly in front.
  double Seen(double visibility) const override {
    constexpr double kBlocked = static_cast<double>(kBlockedVisibility);
    return std::max((visibility - kBlocked) / (1 - kBlocked), kBlocked);
  }
};

}  // namespace

std::shared_ptr<const RayMethod> MakePulli(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup) {
  return std::make_shared<Pulli>(SharesOfTriangle(sources, proxy, setup), OrOwn(setup.settings.method_parameter, 1));
}

}  // namespace lumi
