#include "proxy/dense/fusion.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <optional>

#include "scene/geometry/angle.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// A pixel is uncertain by at least this much, whatever the maps say: they were made of the same photos.
constexpr double kLeastErrorPx = 0.3;

// What is read of a map as doubles and back, kept small: two photos seen from each other.
struct Partner {
  std::int32_t view = 0;
  FusionMap fusion;
  PairGeometry to, back;
};

struct Agreed {
  std::size_t pixel = 0;  // of the partner's map
  double error_px = 0;
  double depth = 0;  // there
};

// The partner's pixel that shows what pixel (x, y) of the reference does, if both maps agree that it does. `could`
// counts partners in whose picture the point lies at all.
std::optional<Agreed> Agreement(const DepthMap& map, int x, int y, const Partner& partner, const FusionOptions& o,
                                std::size_t& could) {
  const DepthMap& other = *partner.fusion.map;
  const float w = map.w[map.At(x, y)];
  const float cx = static_cast<float>(x) + 0.5F, cy = static_cast<float>(y) + 0.5F;
  float q[3], p[3];
  for (int r = 0; r < 3; ++r)
    q[r] = partner.to.a[3 * r] * cx + partner.to.a[3 * r + 1] * cy + partner.to.a[3 * r + 2] + w * partner.to.b[r];
  if (!(q[2] > 0)) return std::nullopt;
  const float u = q[0] / q[2], v = q[1] / q[2];
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(other.width) && v < static_cast<float>(other.height)))
    return std::nullopt;
  ++could;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const std::size_t m = other.At(i, j);
  if (!(other.w[m] > 0) || !(other.cost[m] <= o.max_cost)) return std::nullopt;
  const float there =
      other.w[m] + other.gx[m] * (u - static_cast<float>(i) - 0.5F) + other.gy[m] * (v - static_cast<float>(j) - 0.5F);
  if (!(there > 0)) return std::nullopt;
  // The depth in the partner is q[2] / w, its own map's is 1 / there.
  if (!(std::abs(there * q[2] / w - 1) <= o.max_depth_error)) return std::nullopt;
  for (int r = 0; r < 3; ++r)
    p[r] = partner.back.a[3 * r] * u + partner.back.a[3 * r + 1] * v + partner.back.a[3 * r + 2] +
           there * partner.back.b[r];
  if (!(p[2] > 0)) return std::nullopt;
  const float ex = p[0] / p[2] - cx, ey = p[1] / p[2] - cy;
  const double error_px = std::sqrt(ex * ex + ey * ey);
  if (!(error_px <= o.max_error_px)) return std::nullopt;
  return Agreed{m, error_px, 1.0 / there};
}

// The point of a pixel, or none; `seen` gets the partners' pixels that it takes with it.
std::optional<ProxyPoint> PointAt(const FusionMap& reference, std::int32_t view, int x, int y,
                                  const std::vector<Partner>& partners, const FusionOptions& options,
                                  std::vector<std::pair<std::size_t, std::size_t>>& seen) {
  const DepthMap& map = *reference.map;
  const std::size_t pixel = map.At(x, y);
  if (!(map.w[pixel] > 0) || !(map.cost[pixel] <= options.max_cost)) return std::nullopt;
  ProxyPoint point;
  const double depth = 1.0 / map.w[pixel];
  const StereoCamera& camera = reference.camera;
  const Eigen::Vector3d own = camera.InWorld(x + 0.5, y + 0.5, depth);
  const Eigen::Vector3d eye = camera.cam_from_world.OriginInSource();
  Eigen::Vector3d sum = own;
  double error_px = 0, angle_rad = 0;
  point.footprint = depth / camera.FocalPx();
  point.views.push_back(view);
  seen.clear();
  std::size_t could = 0;
  for (std::size_t k = 0; k < partners.size(); ++k) {
    const auto agreed = Agreement(map, x, y, partners[k], options, could);
    if (!agreed) continue;
    const StereoCamera& there = partners[k].fusion.camera;
    const int width = partners[k].fusion.map->width;
    const int i = static_cast<int>(agreed->pixel) % width, j = static_cast<int>(agreed->pixel) / width;
    sum += there.InWorld(i + 0.5, j + 0.5, 1.0 / partners[k].fusion.map->w[agreed->pixel]);
    error_px += agreed->error_px;
    point.footprint = std::min(point.footprint, agreed->depth / there.FocalPx());
    angle_rad = std::max(angle_rad, AngleBetween(eye - own, there.cam_from_world.OriginInSource() - own));
    point.views.push_back(partners[k].view);
    seen.emplace_back(k, agreed->pixel);
  }
  const auto agreeing = static_cast<double>(seen.size());
  // At the end of a row fewer photos see a place than must agree elsewhere: there all of them must.
  const std::size_t needed = std::min(static_cast<std::size_t>(options.agree), std::max<std::size_t>(1, could));
  if (seen.size() < needed || !(angle_rad > 0)) return std::nullopt;
  point.x_in_world = sum / (1 + agreeing);
  std::ranges::sort(point.views);
  point.sigma =
      point.footprint * std::max(error_px / agreeing, kLeastErrorPx) / std::sin(std::min(angle_rad, 90 * kRadPerDeg));
  return point;
}

}  // namespace

std::vector<ProxyPoint> FuseDepths(const FusionInput& input, const FusionOptions& options,
                                   const std::function<void()>& on_view) {
  const std::size_t count = input.partners.size();
  std::vector<std::vector<std::uint8_t>> taken(count);  // pixels whose point was made from another photo
  std::vector<ProxyPoint> points;
  for (std::size_t v = 0; v < count; ++v) {
    const FusionMap reference = input.load(static_cast<std::int32_t>(v));
    if (!reference.map) {
      on_view();
      continue;
    }
    std::vector<Partner> partners;
    for (const std::int32_t other : input.partners[v]) {
      Partner p{other, input.load(other), {}, {}};
      if (!p.fusion.map) continue;
      p.to = Pair(reference.camera, p.fusion.camera);
      p.back = Pair(p.fusion.camera, reference.camera);
      std::vector<std::uint8_t>& marks = taken[static_cast<std::size_t>(other)];
      if (marks.empty()) marks.resize(p.fusion.map->Pixels());
      partners.push_back(std::move(p));
    }
    const DepthMap& map = *reference.map;
    if (taken[v].empty()) taken[v].resize(map.Pixels());
    // Rows may run in any order: they mark pixels of other photos only, and a mark is the same whichever row sets it.
    std::vector<std::vector<ProxyPoint>> rows(static_cast<std::size_t>(map.height));
    ParallelEach(rows.size(), 8, [&](std::size_t y) {
      std::vector<std::pair<std::size_t, std::size_t>> seen;
      for (int x = 0; x < map.width; ++x) {
        if (taken[v][map.At(x, static_cast<int>(y))] != 0) continue;
        auto point = PointAt(reference, static_cast<std::int32_t>(v), x, static_cast<int>(y), partners, options, seen);
        if (!point) continue;
        rows[y].push_back(std::move(*point));
        for (const auto& [k, pixel] : seen)
          std::atomic_ref<std::uint8_t>(taken[static_cast<std::size_t>(partners[k].view)][pixel])
              .store(1, std::memory_order_relaxed);
      }
    });
    for (std::vector<ProxyPoint>& row : rows) std::ranges::move(row, std::back_inserter(points));
    taken[v] = {};
    on_view();
  }
  return points;
}

}  // namespace lumi
