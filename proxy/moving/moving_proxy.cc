#include "proxy/moving/moving_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "proxy/mesh_query.h"
#include "proxy/moving/belief_propagation.h"
#include "proxy/points.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWidest =
    1.05;                        // radians: cameras farther round what moves than this share no surface that faces them
constexpr double kFacing = 0.9;  // of the cameras that must be nearer
constexpr double kQuantile = 0.02;  // of masked rays beyond the region's ends on each side: strays
constexpr double kMargin = 0.05;    // of the region, added on each side
constexpr double kBeyond = 0.5;     // the last plane's inverse depth, of that of the farthest still surface
constexpr double kJoined = 1;       // planes: as near to the still surface is on it
constexpr int kPriorPlanes = 8;
constexpr std::size_t kSpeck = 9;  // samples that hang together: fewer leave the still surface by chance
constexpr double kOverlap = 1e-4;  // of a face that is cut
constexpr int kAggregate = 1;      // samples on each side that a sample's cost is averaged over
constexpr std::size_t kRaysAView = 300, kViewsForRegion = 60;

// Seen from the middle of the cameras. A sample is (u, v, 1) in this frame, its place at inverse depth w: (u, v, 1) /
// w.
struct Reference {
  Eigen::Matrix3d world_from_ref;
  Vector3d centre;
  Vector3d InRef(const Vector3d& x) const { return world_from_ref.transpose() * (x - centre); }
  Vector3d InWorld(const Vector3d& x) const { return centre + world_from_ref * x; }
};

struct Region {
  Reference ref;
  Vector2d low = Vector2d::Zero();  // of u, v
  double spacing = 0;
  int columns = 0, rows = 0;
  std::size_t Count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  std::size_t Sample(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  int ColumnOf(std::size_t sample) const { return static_cast<int>(sample % static_cast<std::size_t>(columns)); }
  int RowOf(std::size_t sample) const { return static_cast<int>(sample / static_cast<std::size_t>(columns)); }
  Vector3d RayAt(std::size_t sample) const {
    return (low + spacing * Vector2d(ColumnOf(sample), RowOf(sample))).homogeneous();
  }
};

Reference MiddleOf(const std::vector<MovingPhoto>& photos) {
  Reference ref;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (const MovingPhoto& p : photos) at.push_back(p.render.centre[a]);
    ref.centre[a] = Median(at);
  }
  Vector3d forward = Vector3d::Zero(), down = Vector3d::Zero();
  for (const MovingPhoto& p : photos) {
    const double w = p.render.size_px.x(), h = p.render.size_px.y();
    const auto middle = RayDirection(p.render.P, {w / 2, h / 2}), below = RayDirection(p.render.P, {w / 2, h});
    if (!middle || !below) continue;
    forward += middle->normalized();
    down += below->normalized() - middle->normalized();
  }
  const double epsilon = 1e-6 * static_cast<double>(photos.size());
  if (forward.norm() < epsilon)
    throw DataError("the cameras look every way: no one surface faces them all",
                    "make a hull, or give a mesh (lumi-proxy import)");
  forward.normalize();
  down -= forward * forward.dot(down);
  if (down.norm() < epsilon) down = forward.unitOrthogonal();
  down.normalize();
  ref.world_from_ref << down.cross(forward), down, forward;
  return ref;
}

// The masked rays on the still surface, as the reference sees them.
Region FindRegion(const std::vector<MovingPhoto>& photos, const MeshQuery& still, const MovingOptions& options) {
  Region region;
  region.ref = MiddleOf(photos);
  std::vector<double> u, v;
  std::vector<Vector3d> hits;
  std::size_t masked = 0;
  const std::size_t step = std::max<std::size_t>(1, photos.size() / kViewsForRegion);
  for (std::size_t i = 0; i < photos.size(); i += step) {
    const MovingPhoto& p = photos[i];
    const int stride = std::max(
        1, static_cast<int>(std::sqrt(static_cast<double>(p.moves.data.size()) / static_cast<double>(kRaysAView))));
    for (int y = stride / 2; y < p.moves.height; y += stride)
      for (int x = stride / 2; x < p.moves.width; x += stride) {
        if (p.moves.At(x, y, 0) <= 127) continue;
        ++masked;
        const auto ray = RayDirection(p.render.P, {x + 0.5, y + 0.5});
        if (!ray) continue;
        const auto hit = still.FirstHit(p.render.centre, *ray);
        if (!hit) continue;
        hits.push_back(p.render.centre + hit->distance * *ray);
      }
  }
  if (masked == 0)
    throw DataError("nothing is masked: nothing moves",
                    "lumi-timeperiodic calibrate finds what moves; or give masks in SCENE/masks, black where it moves");
  if (hits.empty())
    throw DataError("what moves lies before no surface",
                    "make a proxy of what stands still first (lumi-proxy delaunay)");
  Vector3d middle;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (const Vector3d& x : hits) at.push_back(x[a]);
    middle[a] = Median(at);
  }
  const Vector3d from = (region.ref.centre - middle).normalized();
  const auto facing = std::ranges::count_if(photos, [&](const MovingPhoto& p) {
    return (p.render.centre - middle).normalized().dot(from) > std::cos(kWidest);
  });
  const Vector3d seen = region.ref.InRef(middle);
  if (static_cast<double>(facing) < kFacing * static_cast<double>(photos.size()) || !(seen.z() > 0) ||
      seen.head<2>().norm() > std::tan(kWidest) * seen.z())
    throw DataError("the cameras stand round what moves: no one surface faces them all",
                    "make a hull (lumi-proxy hull), or give a mesh (lumi-proxy import)");
  for (const Vector3d& x : hits) {
    const Vector3d r = region.ref.InRef(x);
    if (!(r.z() > 0) || r.head<2>().norm() > 2 * std::tan(kWidest) * r.z()) continue;
    u.push_back(r.x() / r.z());
    v.push_back(r.y() / r.z());
  }
  Vector2d low(Quantile(u, kQuantile), Quantile(v, kQuantile)),
      high(Quantile(u, 1 - kQuantile), Quantile(v, 1 - kQuantile));
  const Vector2d margin = (high - low) * kMargin + Vector2d::Constant(0.02 * (high - low).maxCoeff() + 1e-6);
  low -= margin;
  high += margin;
  region.low = low;
  region.spacing = (high - low).maxCoeff() / (options.grid - 1);
  region.columns = std::max(2, static_cast<int>(std::lround((high.x() - low.x()) / region.spacing)) + 1);
  region.rows = std::max(2, static_cast<int>(std::lround((high.y() - low.y()) / region.spacing)) + 1);
  return region;
}

// Inverse depths, falling by `step` from `first`.
struct Depths {
  double first = 0, step = 0;
  int count = 0;
  double At(double label) const { return first - step * label; }
  double LabelOf(double w) const { return (first - w) / step; }
};

// Planes a pixel of parallax apart, from before the nearest still surface to beyond the farthest.
Depths SpreadDepths(const std::vector<MovingPhoto>& photos, const Region& region, const std::vector<double>& still,
                    const MovingOptions& options) {
  std::vector<double> known;
  for (const double w : still)
    if (w > 0) known.push_back(w);
  if (known.empty())
    throw DataError("what moves lies before no surface",
                    "make a proxy of what stands still first (lumi-proxy delaunay)");
  const double first = Quantile(known, 1 - kQuantile) / options.nearest, last = kBeyond * Quantile(known, kQuantile);
  // Parallax of the region's middle, between the cameras and the reference.
  const Vector3d middle = region.RayAt(region.Count() / 2 + static_cast<std::size_t>(region.columns) / 2);
  std::vector<double> parallax;
  for (const MovingPhoto& p : photos) {
    std::optional<Vector2d> ends[2];
    for (int e = 0; e < 2; ++e)
      ends[e] = Project(p.render.P, region.ref.InWorld(middle / (e == 0 ? 0.5 * (first + last) : last)));
    if (ends[0] && ends[1]) parallax.push_back(2 * (*ends[0] - *ends[1]).norm());
  }
  const double px = parallax.empty() ? 0 : Quantile(parallax, 0.9);
  Depths depths;
  depths.first = first;
  depths.count = std::clamp(static_cast<int>(std::lround(px)) + 1, 12, options.max_depths);
  depths.step = (first - last) / (depths.count - 1);
  return depths;
}

bool Bilinear(const Image8& image, double x, double y, float rgb[3]) {
  x -= 0.5;
  y -= 0.5;
  if (!(x >= 0) || !(y >= 0) || !(x < image.width - 1) || !(y < image.height - 1)) return false;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const auto fx = static_cast<float>(x - i), fy = static_cast<float>(y - j);
  const std::uint8_t *a = image.Row(j) + 3 * i, *b = image.Row(j + 1) + 3 * i;
  for (int c = 0; c < 3; ++c) {
    const float top = static_cast<float>(a[c]) + fx * static_cast<float>(a[c + 3] - a[c]),
                low = static_cast<float>(b[c]) + fx * static_cast<float>(b[c + 3] - b[c]);
    rgb[c] = top + fy * (low - top);
  }
  return true;
}

// How much photos of one moment differ where a sample is at a depth, and whether something moves there.
struct Sweep {
  int depths = 0;
  std::vector<float> cost;          // [sample][depth], code values; NaN: too few photos see it
  std::vector<std::uint8_t> moves;  // [sample][depth]
};

Sweep SweepPlanes(const std::vector<MovingPhoto>& photos, const Region& region, const Depths& depths,
                  const MovingOptions& options, ProgressSink& sink) {
  Sweep sweep;
  sweep.depths = depths.count;
  const std::size_t n = region.Count(), d = static_cast<std::size_t>(depths.count);
  sweep.cost.assign(n * d, std::numeric_limits<float>::quiet_NaN());
  sweep.moves.assign(n * d, 0);
  // P (X, 1) with X = centre + R (u, v, 1) / w, times w: P R (u, v, 1) + w P (centre, 1).
  std::vector<Vector3d> epipole(photos.size());
  for (std::size_t i = 0; i < photos.size(); ++i) epipole[i] = photos[i].render.P * region.ref.centre.homogeneous();
  Progress progress(sink, "sweeping planes over what moves", static_cast<long>(n));
  const auto most = static_cast<float>(options.truncate * options.truncate);
  ParallelFor(n, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sum(d), pairs(d), masked(d), seeing(d);
    std::vector<float> colour;
    for (std::size_t s = begin; s < end; ++s) {
      const Vector3d ray = region.ref.world_from_ref * region.RayAt(s);
      std::ranges::fill(sum, 0);
      std::ranges::fill(pairs, 0);
      std::ranges::fill(masked, 0);
      std::ranges::fill(seeing, 0);
      for (std::size_t a = 0, b = 0; a < photos.size(); a = b) {
        for (b = a; b < photos.size() && photos[b].moment == photos[a].moment;) ++b;
        std::vector<Vector3d> rays;
        for (std::size_t i = a; i < b; ++i) rays.push_back(photos[i].render.P.leftCols<3>() * ray);
        for (std::size_t l = 0; l < d; ++l) {
          const double w = depths.At(static_cast<double>(l));
          colour.clear();
          for (std::size_t i = a; i < b; ++i) {
            const Vector3d x = rays[i - a] + w * epipole[i];
            if (!(x.z() > 0)) continue;
            const double px = x.x() / x.z(), py = x.y() / x.z();
            float rgb[3];
            if (!Bilinear(photos[i].photo, px, py, rgb)) continue;
            colour.insert(colour.end(), rgb, rgb + 3);
            seeing[l] += 1;
            masked[l] += photos[i].moves.At(static_cast<int>(px), static_cast<int>(py), 0) > 127 ? 1 : 0;
          }
          for (std::size_t i = 0; i < colour.size(); i += 3)
            for (std::size_t j = 0; j < i; j += 3) {
              const float r = colour[i] - colour[j], g = colour[i + 1] - colour[j + 1],
                          b3 = colour[i + 2] - colour[j + 2];
              sum[l] += static_cast<double>(std::min(most, (r * r + g * g + b3 * b3) / 3));
              pairs[l] += 1;
            }
        }
      }
      const double enough = std::max(2.0, 0.1 * *std::ranges::max_element(pairs));
      for (std::size_t l = 0; l < d; ++l) {
        if (pairs[l] >= enough) sweep.cost[s * d + l] = static_cast<float>(sum[l] / pairs[l]);
        sweep.moves[s * d + l] = seeing[l] > 0 && masked[l] >= options.masked_share * seeing[l] ? 1 : 0;
      }
      progress.Step();
    }
  });
  return sweep;
}

// Averaged over neighbours of the same depth; what too few photos see costs as much as the worst depth there.
void Aggregate(const Region& region, Sweep& sweep) {
  const std::size_t n = region.Count(), d = static_cast<std::size_t>(sweep.depths);
  std::vector<float> out(sweep.cost.size());
  ParallelEach(n, 64, [&](std::size_t s) {
    const int c = region.ColumnOf(s), r = region.RowOf(s);
    float worst = 0;
    for (std::size_t l = 0; l < d; ++l) {
      float sum = 0, count = 0;
      for (int y = std::max(0, r - kAggregate); y <= std::min(region.rows - 1, r + kAggregate); ++y)
        for (int x = std::max(0, c - kAggregate); x <= std::min(region.columns - 1, c + kAggregate); ++x) {
          const float v = sweep.cost[region.Sample(x, y) * d + l];
          if (std::isnan(v)) continue;
          sum += v;
          count += 1;
        }
      out[s * d + l] = count > 0 ? sum / count : -1;
      worst = std::max(worst, out[s * d + l]);
    }
    for (std::size_t l = 0; l < d; ++l)
      if (out[s * d + l] < 0) out[s * d + l] = worst;
  });
  sweep.cost = std::move(out);
}

// Groups of fewer than kSpeck samples (eight neighbours) are no surface.
void RemoveSpecks(const Region& region, std::vector<std::uint8_t>& surface) {
  std::vector<std::uint8_t> seen(surface.size(), 0);
  std::vector<std::size_t> group;
  for (std::size_t start = 0; start < surface.size(); ++start) {
    if (!surface[start] || seen[start]) continue;
    group.assign(1, start);
    seen[start] = 1;
    for (std::size_t k = 0; k < group.size(); ++k) {
      const int c = region.ColumnOf(group[k]), r = region.RowOf(group[k]);
      for (int y = std::max(0, r - 1); y <= std::min(region.rows - 1, r + 1); ++y)
        for (int x = std::max(0, c - 1); x <= std::min(region.columns - 1, c + 1); ++x) {
          const std::size_t s = region.Sample(x, y);
          if (surface[s] && !seen[s]) seen[s] = 1, group.push_back(s);
        }
    }
    if (group.size() < kSpeck)
      for (const std::size_t s : group) surface[s] = 0;
  }
}

// A face of the still mesh, cut as finely as the grid where it may stand before the surface; the parts that do are
// dropped.
void KeepWhatHidesNothing(const std::array<Vector3d, 3>& corners, int level, const Region& region,
                          const std::vector<double>& w, const std::vector<std::uint8_t>& behind, Mesh& out) {
  const auto keep = [&] {
    // Neighbours are cut more or less finely: a little overlap, so that no ray slips between them.
    const double grown = level > 0 ? 1 + kOverlap : 1;
    const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
    const auto at = static_cast<std::int32_t>(out.vertices.size());
    for (const Vector3d& x : corners) out.vertices.push_back(level > 0 ? Vector3d(middle + grown * (x - middle)) : x);
    out.faces.push_back({at, at + 1, at + 2});
  };
  // Wholly on the far side of one of the region's sides, or behind the reference: as it is.
  std::array<Vector3d, 3> r;
  for (std::size_t k = 0; k < 3; ++k) r[k] = region.ref.InRef(corners[k]);
  const Vector2d end = region.low + region.spacing * Vector2d(region.columns - 1, region.rows - 1);
  const auto all = [&](const auto& outside) { return outside(r[0]) && outside(r[1]) && outside(r[2]); };
  if (all([&](const Vector3d& x) { return x.x() < region.low.x() * x.z(); }) ||
      all([&](const Vector3d& x) { return x.x() > end.x() * x.z(); }) ||
      all([&](const Vector3d& x) { return x.y() < region.low.y() * x.z(); }) ||
      all([&](const Vector3d& x) { return x.y() > end.y() * x.z(); }) ||
      all([](const Vector3d& x) { return !(x.z() > 0); }))
    return keep();
  double size = std::numeric_limits<double>::infinity();  // in samples; infinite where it reaches behind the reference
  if (all([](const Vector3d& x) { return x.z() > 0; })) {
    Vector2d low = Vector2d::Constant(size), high = -low;
    double near = 0;
    for (const Vector3d& x : r) {
      const Vector2d at = (x.head<2>() / x.z() - region.low) / region.spacing;
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
      near = std::max(near, 1 / x.z());
    }
    const int c0 = static_cast<int>(std::clamp(std::floor(low.x()), 0.0, 1.0 * region.columns)),
              c1 = static_cast<int>(std::clamp(std::ceil(high.x()), -1.0, region.columns - 1.0));
    const int r0 = static_cast<int>(std::clamp(std::floor(low.y()), 0.0, 1.0 * region.rows)),
              r1 = static_cast<int>(std::clamp(std::ceil(high.y()), -1.0, region.rows - 1.0));
    bool hides = false;
    for (int y = r0; y <= r1 && !hides; ++y)
      for (int c = c0; c <= c1 && !hides; ++c) {
        const std::size_t s = region.Sample(c, y);
        hides = behind[s] != 0 && near > w[s];
      }
    if (!hides) return keep();
    size = (high - low).maxCoeff();
  }
  // Cut down to about a sample: a part that is dropped then lies within a sample of one that it hides, and there the
  // surface is.
  constexpr int kFinest = 10;
  if (level < kFinest && size > 0.7) {
    const std::array<Vector3d, 3> middle{0.5 * (corners[0] + corners[1]), 0.5 * (corners[1] + corners[2]),
                                         0.5 * (corners[2] + corners[0])};
    for (const std::array<Vector3d, 3>& part : {std::array<Vector3d, 3>{corners[0], middle[0], middle[2]},
                                                {middle[0], corners[1], middle[1]},
                                                {middle[2], middle[1], corners[2]},
                                                middle})
      KeepWhatHidesNothing(part, level + 1, region, w, behind, out);
    return;
  }
  const Vector3d centre = (r[0] + r[1] + r[2]) / 3;
  if (!(centre.z() > 0)) return keep();
  const Vector2d at = (centre.head<2>() / centre.z() - region.low) / region.spacing;
  const int c = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
  if (c < 0 || y < 0 || c >= region.columns || y >= region.rows) return keep();
  const std::size_t s = region.Sample(c, y);
  if (behind[s] == 0 || 1 / centre.z() < w[s]) keep();
}

// Inverse depths of the still surface; 0: nothing there.
std::vector<double> DepthsOfStill(const MeshQuery& query, const Region& region) {
  std::vector<double> on_still(region.Count(), 0);
  ParallelEach(on_still.size(), 64, [&](std::size_t s) {
    const auto hit = query.FirstHit(region.ref.centre, region.ref.world_from_ref * region.RayAt(s));
    if (hit && hit->distance > 0) on_still[s] = 1 / hit->distance;
  });
  return on_still;
}

// [sample][label]. What does not move is where the still surface is.
std::vector<float> CostsOf(const Sweep& sweep, const Depths& depths, const std::vector<double>& on_still,
                           const MovingOptions& options, std::vector<std::uint8_t>& moves) {
  const std::size_t d = static_cast<std::size_t>(depths.count);
  const double worst = options.truncate * options.truncate;
  std::vector<float> costs(on_still.size() * d);
  for (std::size_t s = 0; s < on_still.size(); ++s) {
    const auto* mask = &sweep.moves[s * d];
    moves[s] = std::any_of(mask, mask + d, [](std::uint8_t m) { return m != 0; }) ? 1 : 0;
    const double label = depths.LabelOf(on_still[s]);
    for (std::size_t l = 0; l < d; ++l) {
      const double away = std::abs(static_cast<double>(l) - label), far = std::min(1.0, away / kPriorPlanes);
      if (moves[s])
        costs[s * d + l] =
            sweep.cost[s * d + l] + static_cast<float>(options.still_prior * far + (mask[l] || away < 1 ? 0 : worst));
      else
        costs[s * d + l] = static_cast<float>(worst * far);
    }
  }
  return costs;
}

struct MovingSurface {
  std::vector<double> w;             // inverse depth of each sample, on the still surface where it is not on this one
  std::vector<std::uint8_t> on;      // samples on it
  std::vector<std::uint8_t> behind;  // and behind the still one
  std::vector<double> found;         // depths of those on it
  double gain = 0;                   // of all of them together
};

MovingSurface PlaceSurface(const Region& region, const Depths& depths, const Sweep& sweep,
                           const std::vector<double>& on_still, const std::vector<double>& label,
                           const std::vector<std::uint8_t>& moves) {
  const std::size_t n = region.Count(), d = static_cast<std::size_t>(depths.count);
  MovingSurface m{on_still, std::vector<std::uint8_t>(n, 0), std::vector<std::uint8_t>(n, 0), {}};
  for (std::size_t s = 0; s < n; ++s)
    m.on[s] =
        moves[s] && !(on_still[s] > 0 && std::abs(depths.At(label[s]) - on_still[s]) <= kJoined * depths.step) ? 1 : 0;
  RemoveSpecks(region, m.on);
  for (std::size_t s = 0; s < n; ++s) {
    if (!m.on[s]) continue;
    m.w[s] = depths.At(label[s]);
    m.behind[s] = m.w[s] < on_still[s] ? 1 : 0;
    m.found.push_back(1 / m.w[s]);
    const auto cost = [&](double l) {
      return static_cast<double>(
          sweep.cost[s * d + static_cast<std::size_t>(std::clamp(std::lround(l), 0L, static_cast<long>(d) - 1))]);
    };
    if (on_still[s] > 0) m.gain += cost(depths.LabelOf(on_still[s])) - cost(label[s]);
  }
  return m;
}

// Squares of the grid with a corner on the surface; those on its border reach back to the still surface.
void AddSurface(const Region& region, const MovingSurface& m, Mesh& mesh) {
  std::vector<std::int32_t> vertex(region.Count(), -1);
  const auto put = [&](std::size_t s) {
    if (vertex[s] < 0) {
      vertex[s] = static_cast<std::int32_t>(mesh.vertices.size());
      mesh.vertices.push_back(region.ref.InWorld(region.RayAt(s) / m.w[s]));
    }
    return vertex[s];
  };
  for (int r = 0; r + 1 < region.rows; ++r)
    for (int c = 0; c + 1 < region.columns; ++c) {
      const std::size_t s = region.Sample(c, r), below = region.Sample(c, r + 1);
      if (!m.on[s] && !m.on[s + 1] && !m.on[below] && !m.on[below + 1]) continue;
      if (!(m.w[s] > 0) || !(m.w[s + 1] > 0) || !(m.w[below] > 0) || !(m.w[below + 1] > 0)) continue;
      const std::int32_t a = put(s), b = put(s + 1), e = put(below), f = put(below + 1);
      mesh.faces.push_back({a, e, b});
      mesh.faces.push_back({b, e, f});
    }
}

}  // namespace

std::string Validate(const MovingOptions& o) {
  if (o.moments < 1) return "--moments must be at least 1";
  if (o.views_a_moment < 2) return "--views-a-moment must be at least 2";
  if (o.photo_px < 32) return "--photo-px must be at least 32";
  if (o.grid < 8) return "--grid must be at least 8";
  if (o.max_depths < 12) return "--max-depths must be at least 12";
  if (!(o.nearest > 0) || !(o.nearest < 1)) return "--nearest must lie between 0 and 1";
  if (!(o.smoothness >= 0)) return "--smoothness must be at least 0";
  return {};
}

std::vector<MomentView> PickMoments(const Scene& scene, const MovingOptions& options) {
  std::vector<std::pair<double, std::int32_t>> at;  // time, folded into a period
  std::vector<double> times;
  const double period = scene.period_s.value_or(0);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (!scene.views[i].time_s) continue;
    const double t = *scene.views[i].time_s;
    times.push_back(t);
    at.emplace_back(period > 0 ? t - period * std::floor(t / period) : t, static_cast<std::int32_t>(i));
  }
  if (at.size() < 2) return {};
  std::ranges::sort(at);
  std::ranges::sort(times);
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
  const double frame = steps.empty() ? 0 : Median(steps);
  const double first = at.front().first, span = period > 0 ? period : at.back().first - first;
  const int wanted = frame > 0 ? std::clamp(static_cast<int>(std::lround(span / frame)), 1, options.moments) : 1;
  std::vector<MomentView> picked;
  std::vector<bool> taken(scene.views.size(), false);
  int moment = 0;
  for (int k = 0; k < wanted; ++k) {
    // Around a photo's own time, so that a moment is never between photos.
    const double target = first + span * (k + 0.5) / wanted;
    auto centre = std::ranges::lower_bound(at, std::pair(target, std::int32_t{-1}));
    if (centre == at.end()) --centre;
    std::vector<std::int32_t> there;
    for (const auto& [t, i] : at) {
      double apart = std::abs(t - centre->first);
      if (period > 0) apart = std::min(apart, period - apart);
      if (apart <= 0.5 * frame && !taken[static_cast<std::size_t>(i)]) there.push_back(i);
    }
    if (there.size() < 2) continue;
    // Those farthest from one another.
    std::vector<std::int32_t> far{there.front()};
    std::vector<double> nearest(there.size(), std::numeric_limits<double>::infinity());
    while (static_cast<int>(far.size()) < options.views_a_moment) {
      std::size_t best = 0;
      for (std::size_t j = 0; j < there.size(); ++j) {
        const Vector3d apart = scene.views[static_cast<std::size_t>(there[j])].CentreInWorld() -
                               scene.views[static_cast<std::size_t>(far.back())].CentreInWorld();
        nearest[j] = std::min(nearest[j], apart.norm());
        if (nearest[j] > nearest[best]) best = j;
      }
      if (!(nearest[best] > 0)) break;
      far.push_back(there[best]);
    }
    if (far.size() < 2) continue;
    for (const std::int32_t i : far) {
      picked.push_back({{i}, moment});
      taken[static_cast<std::size_t>(i)] = true;
    }
    ++moment;
  }
  return picked;
}

Mesh BuildMovingProxy(const std::vector<MovingPhoto>& photos, const Mesh& still, const MovingOptions& options,
                      ProgressSink& progress, MovingSummary* summary) {
  if (photos.size() < 2)
    throw DataError("no two photos show one moment from different places", "film more periods from elsewhere");
  const MeshQuery query(still);
  const Region region = FindRegion(photos, query, options);
  const std::vector<double> on_still = DepthsOfStill(query, region);
  const Depths depths = SpreadDepths(photos, region, on_still, options);
  Sweep sweep = SweepPlanes(photos, region, depths, options, progress);
  Aggregate(region, sweep);
  std::vector<std::uint8_t> moves(region.Count(), 0);
  const std::vector<float> costs = CostsOf(sweep, depths, on_still, options, moves);
  const auto moving = static_cast<std::size_t>(std::ranges::count(moves, 1));
  if (moving == 0)
    throw DataError("what is masked is so in too few of the photos that see it",
                    "lumi-timeperiodic calibrate finds what moves");
  const std::vector<double> label =
      SmoothLabels(costs, region.columns, region.rows, static_cast<float>(options.smoothness),
                   static_cast<float>(options.smoothness * options.smoothness_planes));
  MovingSurface m = PlaceSurface(region, depths, sweep, on_still, label, moves);
  if (m.found.empty()) throw DataError("photos of one moment agree best on the surface of what stands still", "");

  Mesh mesh;
  if (std::ranges::any_of(m.behind, [](std::uint8_t b) { return b != 0; })) {
    for (const auto& face : still.faces) {
      std::array<Vector3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) corners[k] = still.vertices[static_cast<std::size_t>(face[k])];
      KeepWhatHidesNothing(corners, 0, region, m.w, m.behind, mesh);
    }
  } else {
    mesh.vertices = still.vertices;
    mesh.faces = still.faces;
  }
  AddSurface(region, m, mesh);
  if (summary) {
    std::ranges::sort(m.found);
    *summary = {.photos = photos.size(),
                .moments = photos.back().moment + 1,
                .depths = depths.count,
                .columns = region.columns,
                .rows = region.rows,
                .region = moving,
                .surface = m.found.size(),
                .nearest = m.found.front(),
                .farthest = m.found.back(),
                .median_depth = m.found[m.found.size() / 2],
                .gain = m.gain / static_cast<double>(m.found.size())};
  }
  return mesh;
}

}  // namespace lumi
