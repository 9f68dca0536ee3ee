#include "render/world/photos_wanted.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "render/photos/most_used.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kLooks = 4;              // points a side of a cell
constexpr double kSpareLevels = 0.5;   // of a pyramid: something between the points may be nearer
constexpr int kUnseenHalvings = 1000;  // of a photo that ends before all of its cells' points: an epipole's mostly

// The fewest photo pixels for one of the view's pixels, for each entry of plan.camera.
std::vector<float> PixelsAPixel(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer) {
  const RelativeSources& s = setup.sources;
  const Eigen::Vector3f centre = setup.desired.centre.cast<float>();
  const Eigen::Vector3f axis(s.desired_m[6], s.desired_m[7], s.desired_m[8]);
  std::vector<float> fewest(plan.camera.size(), std::numeric_limits<float>::infinity());
  const std::size_t cells = static_cast<std::size_t>(plan.cell_columns) * static_cast<std::size_t>(plan.cell_rows);
  ParallelFor(cells, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> directions(kLooks * kLooks);
    std::vector<float> t(directions.size());
    for (std::size_t cell = begin; cell < end; ++cell) {
      const auto columns = static_cast<std::size_t>(plan.cell_columns);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        const double x = static_cast<double>(cell % columns) + static_cast<double>(i % kLooks) / (kLooks - 1),
                     y = static_cast<double>(cell / columns) + static_cast<double>(i / kLooks) / (kLooks - 1);
        directions[i] = (setup.ray_from_pixel * Eigen::Vector3d(x * plan.cell_width_px, y * plan.cell_height_px, 1))
                            .normalized()
                            .cast<float>();
      }
      tracer.Trace(centre, directions, t);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        if (!std::isfinite(t[i])) continue;
        const Eigen::Vector3f x = t[i] * directions[i];
        const float view_px = s.desired_focal_px / std::max(axis.dot(x), std::numeric_limits<float>::min());
        for (auto entry = static_cast<std::size_t>(plan.first[cell]);
             entry < static_cast<std::size_t>(plan.first[cell + 1]); ++entry) {
          const auto j = static_cast<std::size_t>(plan.camera[entry]);
          const Eigen::Vector3f to_point = x - Eigen::Vector3f(s.dx[j], s.dy[j], s.dz[j]);
          const auto row = [&](std::size_t r) {
            return s.m[3 * r][j] * to_point.x() + s.m[3 * r + 1][j] * to_point.y() + s.m[3 * r + 2][j] * to_point.z();
          };
          const float depth = row(2), u = row(0), v = row(1);
          // A cell may see what is near and what is far: photos of the one do not show the other.
          if (!(depth > 0) || u < 0 || v < 0 || u > s.width_px[j] * depth || v > s.height_px[j] * depth) continue;
          fewest[entry] = std::min(fewest[entry], s.focal_px[j] / depth / view_px);
        }
      }
    }
  });
  return fewest;
}

}  // namespace

std::vector<WantedPhoto> PhotosWanted(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer) {
  const std::vector<float> pixels = PixelsAPixel(plan, setup, tracer);
  std::vector<float> fewest(static_cast<std::size_t>(setup.sources.count), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    float& of_photo = fewest[static_cast<std::size_t>(plan.camera[i])];
    of_photo = std::min(of_photo, pixels[i]);
  }
  std::vector<WantedPhoto> wanted;
  for (const std::int32_t photo : MostUsedFirst(plan.camera)) {
    const float of_photo = fewest[static_cast<std::size_t>(photo)];
    const double halvings = std::floor(std::log2(std::max(of_photo, 1.0F)) - kSpareLevels);
    wanted.push_back({photo, std::isfinite(of_photo) ? std::max(0, static_cast<int>(halvings)) : kUnseenHalvings});
  }
  return wanted;
}

}  // namespace lumi
