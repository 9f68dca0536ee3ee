#include "render/holdout/seen_pixels.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "render/radiance/measures/visibility.h"
#include "render/world/visibility_maps.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kSeeing = 2;           // photos
constexpr float kSeenEnough = 0.5F;  // of SeenPast: the middle of visibility's feather
constexpr std::size_t kRowsAtOnce = 4;

// Whether camera P sees the point within its picture.
bool InField(const RenderView& camera, const Eigen::Vector3d& x_normalized) {
  const Eigen::Vector3d p = camera.P * x_normalized.homogeneous();
  return p.z() > 0 && p.x() > 0 && p.y() > 0 && p.x() < p.z() * camera.size_px.x() &&
         p.y() < p.z() * camera.size_px.y();
}

}  // namespace

// What a row of pixels needs, kept from row to row.
struct SeenPixels::Rays {
  std::vector<Eigen::Vector3f> directions;
  std::vector<float> distance;
  std::vector<Eigen::Vector3d> points;  // in the normalised frame
  std::vector<int> pixels, seen_by;     // of points
  std::vector<std::size_t> asked;       // indices of points that a photo may see
};

SeenPixels::SeenPixels(const PictureWorld& world)
    : sources_(world.sources),
      photos_(world.photos),
      use_(world.use),
      occlusion_(world.occlusion && CanOcclude(world.proxy)),
      tracer_(world.proxy, world.sources.normalized_from_world) {}

Image8 SeenPixels::Mask(const RenderView& view, const std::vector<bool>& use) const {
  const RenderView v = Normalized(view, sources_.normalized_from_world);
  std::vector<std::int32_t> cameras;
  for (std::size_t j = 0; j < photos_.size(); ++j)
    if ((use_.empty() || use_[j]) && (use.empty() || use[static_cast<std::size_t>(photos_[j])]))
      cameras.push_back(static_cast<std::int32_t>(j));
  // Near cameras first: they see most of the picture, and the others then need not be tested.
  const auto distance = [&](std::int32_t j) {
    return (sources_.views[static_cast<std::size_t>(j)].centre - v.centre).squaredNorm();
  };
  std::ranges::stable_sort(cameras, {}, distance);

  Image8 mask(v.size_px.x(), v.size_px.y(), 1);
  ParallelFor(static_cast<std::size_t>(mask.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
    Rays rays;
    for (std::size_t y = begin; y < end && !InterruptRequested(); ++y)
      MaskRow(v, cameras, static_cast<int>(y), rays, mask);
  });
  CheckInterrupted();
  return mask;
}

void SeenPixels::MaskRow(const RenderView& v, const std::vector<std::int32_t>& cameras, int y, Rays& rays,
                         Image8& mask) const {
  const Eigen::Matrix3d ray_from_pixel = v.P.leftCols<3>().inverse();
  const auto width = static_cast<std::size_t>(mask.width);
  rays.directions.resize(width);
  rays.distance.resize(width);
  for (std::size_t x = 0; x < width; ++x)
    rays.directions[x] =
        (ray_from_pixel * Eigen::Vector3d(static_cast<double>(x) + 0.5, y + 0.5, 1)).normalized().cast<float>();
  tracer_.Trace(v.centre.cast<float>(), rays.directions, rays.distance);
  rays.points.clear();
  rays.pixels.clear();
  for (std::size_t x = 0; x < width; ++x) {
    if (!std::isfinite(rays.distance[x])) continue;
    rays.points.emplace_back(v.centre + static_cast<double>(rays.distance[x]) * rays.directions[x].cast<double>());
    rays.pixels.push_back(static_cast<int>(x));
  }
  rays.seen_by.assign(rays.points.size(), 0);
  std::size_t open = rays.points.size();
  for (std::size_t c = 0; c < cameras.size() && open > 0; ++c) {
    const RenderView& camera = sources_.views[static_cast<std::size_t>(cameras[c])];
    rays.asked.clear();
    for (std::size_t i = 0; i < rays.points.size(); ++i)
      if (rays.seen_by[i] < kSeeing && InField(camera, rays.points[i])) rays.asked.push_back(i);
    if (rays.asked.empty()) continue;
    const std::size_t n = rays.asked.size();
    if (occlusion_) {
      rays.directions.resize(n);
      rays.distance.resize(n);
      for (std::size_t i = 0; i < n; ++i)
        rays.directions[i] = (rays.points[rays.asked[i]] - camera.centre).normalized().cast<float>();
      tracer_.Trace(camera.centre.cast<float>(), rays.directions, rays.distance);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t p = rays.asked[i];
      const auto depth = static_cast<float>((rays.points[p] - camera.centre).norm());
      if (occlusion_ && SeenPast(depth, rays.distance[i]) < kSeenEnough) continue;
      if (++rays.seen_by[p] < kSeeing) continue;
      mask.At(rays.pixels[p], y, 0) = 255;
      --open;
    }
  }
}

double ShareOf(const Image8& mask) {
  const auto set = std::ranges::count_if(mask.data, [](std::uint8_t value) { return value > 127; });
  return mask.data.empty() ? 0 : static_cast<double>(set) / static_cast<double>(mask.data.size());
}

}  // namespace lumi
