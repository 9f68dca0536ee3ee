// Debevec, Yu and Borshukov, "Efficient View-Dependent Image-Based Rendering with Projective Texture-Mapping", EGWR
// 1998: each face has a view map, a grid of directions that holds, for each direction, the photo that saw the face from
// nearest to it; a view blends the photos of the three directions around its own. The paper splits faces until a photo
// sees all of each or nothing; here faces are split into cells of at most kCellSize of their distance, visibility is
// tested at a cell's middle, and a photo that does not see a pixel leaves it to the others.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "render/comparators/methods.h"
#include "render/comparators/point_method.h"
#include "render/comparators/sphere_grid.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kCellSize = 0.05;  // of the distance from the view
constexpr int kMostParts = 1023;    // that a face's side is split into

class Debevec1998 final : public PointMethod {
 public:
  Debevec1998(const ProxyTracer& proxy, const ViewSetup& setup)
      : proxy_(proxy),
        eye_(setup.desired.centre),
        grid_(static_cast<int>(std::clamp(OrOwn(setup.settings.method_parameter, 4), 1.0, 32.0))) {}

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override {
    const Cell cell = CellOf(point);
    auto [found, is_new] = memo.photos_of_cell.try_emplace(cell.key);
    if (is_new) found->second = ViewMap(point, cell.middle);
    double sum = 0;
    for (const auto& [photo, weight] : found->second) {
      if (photo < 0 || !std::binary_search(point.seeing.begin(), point.seeing.end(), photo)) continue;
      out.camera.push_back(photo);
      out.weight.push_back(weight);
      sum += static_cast<double>(weight);
    }
    if (sum > 1e-6) return;
    out.camera.assign(1, NearestInAngle(point));
    out.weight.assign(1, 1.0F);
  }

 private:
  struct Cell {
    std::uint64_t key = 0;
    Eigen::Vector3d middle;  // relative to the view's centre
  };

  Cell CellOf(const PhotosAtPoint& point) const {
    if (point.face < 0) return {0, point.point()};
    auto corners = proxy_.Corners(point.face);
    for (auto& c : corners) c -= eye_;
    const Eigen::Vector3d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0], n = e1.cross(e2);
    const double longest = std::max({e1.norm(), e2.norm(), (e2 - e1).norm()});
    const int parts = std::clamp(static_cast<int>(std::ceil(longest / (kCellSize * Nearest(corners)))), 1, kMostParts);
    Cell cell{static_cast<std::uint64_t>(point.face) << 32, (corners[0] + corners[1] + corners[2]) / 3};
    const double area2 = n.squaredNorm();
    if (parts == 1 || !(area2 > 0)) return cell;
    const Eigen::Vector3d x = point.point() - corners[0];
    const double b = n.dot(x.cross(e2)) / area2 * parts, c = n.dot(e1.cross(x)) / area2 * parts;
    const int i = std::clamp(static_cast<int>(b), 0, parts - 1), j = std::clamp(static_cast<int>(c), 0, parts - 1);
    const bool upper = b - i + (c - j) > 1;
    const double third = upper ? 2.0 / 3 : 1.0 / 3;
    cell.middle = corners[0] + ((i + third) * e1 + (j + third) * e2) / parts;
    cell.key |= static_cast<std::uint64_t>(i) << 12 | static_cast<std::uint64_t>(j) << 1 | (upper ? 1U : 0U);
    return cell;
  }
  static double Nearest(const std::array<Eigen::Vector3d, 3>& corners) {
    const double least = std::min(
        {corners[0].norm(), corners[1].norm(), corners[2].norm(), ((corners[0] + corners[1] + corners[2]) / 3).norm()});
    return std::max(least, 1e-6);
  }

  // The photos at the three nodes around the view's direction.
  std::array<std::pair<std::int32_t, float>, 3> ViewMap(const PhotosAtPoint& point,
                                                        const Eigen::Vector3d& middle) const {
    std::array<std::pair<std::int32_t, float>, 3> map;
    map.fill({-1, 0.0F});
    PointSight sight(point.setup, point.visibility);
    if (!sight.Look(middle.normalized(), middle.norm())) return map;
    const auto around = grid_.Around(-middle);
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& direction = grid_.Direction(static_cast<std::size_t>(around[k].first));
      double best = -2;
      for (const std::int32_t j : sight.seeing()) {
        const double cosine = (CentreOf(point.setup, j) - middle).normalized().dot(direction);
        if (cosine <= best) continue;
        best = cosine;
        map[k] = {j, static_cast<float>(around[k].second)};
      }
    }
    return map;
  }

  const ProxyTracer& proxy_;
  Eigen::Vector3d eye_;
  SphereGrid grid_;
};

}  // namespace

std::shared_ptr<const RayMethod> MakeDebevec1998(const Sources&, const ProxyTracer& proxy, const ViewSetup& setup) {
  return std::make_shared<Debevec1998>(proxy, setup);
}

}  // namespace lumi
