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
#include "render/comparators/point_method.h"

namespace lumi {
namespace {

constexpr std::size_t kAsked = 12;  // nearest views among which a triangle is looked for

class Pulli final : public PointMethod {
 public:
  Pulli(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup)
      : power_(OrOwn(setup.settings.method_parameter, 1)) {
    const auto photos = static_cast<std::size_t>(std::max(1.0, OrOwn(setup.settings.method_photos, 3)));
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
    share_.assign(static_cast<std::size_t>(setup.sources.count), 0.0);
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
            // At a photo's own place the other two are 0, on either side of it by a rounding.
            if (w.minCoeff() < -kRounding) continue;
            w = w.cwiseMax(0.0);
            smallest = near[c].angle;
            std::ranges::fill(share_, 0.0);
            share_[static_cast<std::size_t>(near[a].photo)] = w.x() / w.sum();
            share_[static_cast<std::size_t>(near[b].photo)] = w.y() / w.sum();
            share_[static_cast<std::size_t>(near[c].photo)] = w.z() / w.sum();
          }
      if (std::isfinite(smallest)) return;
    }
    // No triangle encloses the view: the nearest ones, by what they are nearer than the next.
    const std::size_t n = std::min(photos, near.size());
    const double edge = n < near.size() ? near[n].angle : std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i)
      share_[static_cast<std::size_t>(near[i].photo)] =
          std::isfinite(edge) && edge > near[i].angle ? 1 - near[i].angle / edge : (std::isfinite(edge) ? 1e-6 : 1.0);
  }

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    double sum = 0;
    for (const std::int32_t j : point.seeing) {
      const auto i = static_cast<std::size_t>(j);
      if (!(share_[i] > 0)) continue;
      const double in_front = (static_cast<double>(point.v[i]) - kBlocked) / (1 - kBlocked);
      const double w = share_[i] * static_cast<double>(point.f[i]) * std::max(in_front, kBlocked) *
                       std::pow(FacingOf(point, j), power_);
      out.camera.push_back(j);
      out.weight.push_back(static_cast<float>(w));
      sum += w;
    }
    if (sum > kNothing) return;
    // None of the three sees it: the paper leaves a hole; the nearest that does is kinder.
    out.camera.assign(1, NearestInAngle(point));
    out.weight.assign(1, 1.0F);
  }

 private:
  static constexpr double kBlocked = static_cast<double>(kBlockedVisibility), kNothing = 1e-12, kFlat = 1e-12,
                          kRounding = 1e-9;
  std::vector<double> share_;  // of a photo in the triangle
  double power_;               // of the cosine
};

}  // namespace

std::shared_ptr<const RayMethod> MakePulli(const Sources& sources, const ProxyTracer& proxy, const ViewSetup& setup) {
  return std::make_shared<Pulli>(sources, proxy, setup);
}

}  // namespace lumi
