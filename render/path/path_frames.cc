#include "render/path/path_frames.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "render/time/clock.h"

namespace lumi {
namespace {

constexpr int kWidestByDefault = 1024;  // pixels

}  // namespace

Eigen::Vector2i SizeFor(int width_px, int height_px, const Eigen::Vector2i& own) {
  if (width_px == 0 && height_px == 0) return own;
  const double aspect = static_cast<double>(own.y()) / own.x();
  const int width = width_px > 0 ? width_px : std::max(1, static_cast<int>(std::lround(height_px / aspect)));
  const int height = height_px > 0 ? height_px : std::max(1, static_cast<int>(std::lround(width * aspect)));
  return {width, height};
}

std::vector<RenderView> FramesOfPath(const Scene& scene, const CameraPath& path, int width_px, int height_px) {
  const Eigen::Vector2i film = FilmSize(scene);
  int width = width_px, height = height_px;
  if (width == 0 && height == 0) width = path.width_px, height = path.height_px;
  if (width == 0 && height == 0) width = std::min(kWidestByDefault, film.x());
  // A path's vertical field of view is meant for the path's own shape, where it has one.
  const bool sized = path.width_px > 0 && path.height_px > 0;
  const Eigen::Vector2i size = SizeFor(width, height, sized ? Eigen::Vector2i(path.width_px, path.height_px) : film);
  std::vector<RenderView> views = SamplePath(path, size.x(), size.y());
  const std::optional<double> first_time = FirstTime(scene);
  for (RenderView& v : views)
    v.time_s = first_time ? std::optional(*first_time + (*v.time_s - path.keys.front().time_s)) : std::nullopt;
  return views;
}

std::vector<RenderView> FramesOfPath(const Scene& scene, const MatrixPath& path, int width_px, int height_px) {
  const Eigen::Vector2i size = SizeFor(width_px, height_px, path.size_px());
  return MatrixViews(scene, path, size.x(), size.y());
}

}  // namespace lumi
