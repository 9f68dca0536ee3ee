#include "render/lumigraph/view_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/cpu/pixels.h"
#include "render/radiance/reconstruct.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr double kNoPlace = std::numeric_limits<double>::quiet_NaN();

bool IsMet(float t) { return t > 0 && std::isfinite(t); }

// Copies a tile of the picture to its place in the whole.
void CopyTile(const FramePlan& tile, const std::vector<std::int32_t>& photos, ViewPlan& whole) {
  const auto k = static_cast<std::size_t>(whole.k), tile_k = static_cast<std::size_t>(tile.k);
  std::size_t s = 0;
  for (int y = 0; y < tile.window.height; ++y)
    for (int x = 0; x < tile.window.width; ++x, ++s) {
      const auto pixel = static_cast<std::size_t>(tile.window.y + y) * static_cast<std::size_t>(whole.width) +
                         static_cast<std::size_t>(tile.window.x + x);
      std::copy_n(photos.data() + s * tile_k, tile_k, whole.photo.data() + pixel * k);
      std::copy_n(tile.weight.data() + s * tile_k, tile_k, whole.weight.data() + pixel * k);
      whole.alpha[pixel] = tile.alpha[s];
    }
}

}  // namespace

ViewWeights::ViewWeights(const Lumigraph& lumigraph, const RenderView& view, const std::vector<bool>& use,
                         const RadianceSettings& settings, const TracedProxy* traced)
    : size_px_(view.size_px), traced_(traced) {
  RenderView seen_from = view;
  std::vector<bool> of_world = use;
  if (lumigraph.one_mesh()) {
    if (traced_ == nullptr) own_ = std::make_unique<TracedProxy>(lumigraph.scene(), lumigraph.mesh());
  } else {
    const PictureWorld world = lumigraph.For(view);
    own_ = std::make_unique<TracedProxy>(world);
    photos_ = world.photos;
    seen_from = world.view;
    of_world = world.use.empty() ? std::vector<bool>(world.photos.size(), true) : world.use;
    for (std::size_t i = 0; i < of_world.size(); ++i)
      of_world[i] = of_world[i] && (use.empty() || use[static_cast<std::size_t>(world.photos[i])]);
  }
  if (own_) traced_ = own_.get();
  const Sources& sources = traced_->sources;
  if (lumigraph.one_mesh()) world_from_normalized_ = sources.normalized_from_world.Inverse();
  if (settings.visibility && !traced_->maps.empty()) visibility_ = &traced_->maps;
  setup_ = Weighed(sources, MakeViewSetup(sources, seen_from, settings, of_world), traced_->tracer);
}

void ViewWeights::NumberAsViews(std::vector<std::int32_t>& cameras) const {
  if (photos_.empty()) return;
  for (std::int32_t& c : cameras)
    if (c >= 0) c = photos_[static_cast<std::size_t>(c)];
}

ViewPlan ViewWeights::Plan() const {
  ViewPlan whole;
  whole.width = size_px_.x();
  whole.height = size_px_.y();
  const int columns = (whole.width + kPixelTileWidth - 1) / kPixelTileWidth;
  std::vector<FramePlan> tiles(static_cast<std::size_t>(PixelTiles(whole.width, whole.height)));
  ParallelFor(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    WeighScratch scratch;
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x = static_cast<int>(tile) % columns * kPixelTileWidth,
                y = static_cast<int>(tile) / columns * kPixelTileHeight;
      PlanPixels(setup_, traced_->tracer, visibility_,
                 {x, y, std::min(kPixelTileWidth, whole.width - x), std::min(kPixelTileHeight, whole.height - y)},
                 tiles[tile], scratch);
    }
  });
  for (const FramePlan& tile : tiles) whole.k = std::max(whole.k, tile.k);
  const auto k = static_cast<std::size_t>(whole.k),
             n = static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  whole.photo.assign(n * k, -1);
  whole.weight.assign(n * k, 0);
  whole.alpha.assign(n, 0);
  whole.point.assign(3 * n, kNoPlace);
  for (FramePlan& tile : tiles) {
    NumberAsViews(tile.camera);
    CopyTile(tile, tile.camera, whole);
    if (!world_from_normalized_) continue;
    std::size_t s = 0;
    for (int y = tile.window.y; y < tile.window.y + tile.window.height; ++y)
      for (int x = tile.window.x; x < tile.window.x + tile.window.width; ++x, ++s)
        if (tile.alpha[s] > 0) {
          const Eigen::Vector3d point =
              *world_from_normalized_ * (setup_.desired.centre + tile.offset[s].cast<double>());
          std::copy_n(point.data(), 3,
                      whole.point.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(whole.width) +
                                                static_cast<std::size_t>(x)));
        }
  }
  return whole;
}

WeightsAtRays ViewWeights::At(const std::vector<Eigen::Vector2d>& x_px) const {
  RaySamples rays;
  for (const Eigen::Vector2d& x : x_px) {
    rays.exact_direction.push_back((setup_.ray_from_pixel * x.homogeneous()).normalized());
    rays.direction.push_back(rays.exact_direction.back().cast<float>());
  }
  rays.t.resize(x_px.size());
  rays.normal.resize(x_px.size());
  rays.face.resize(x_px.size());
  rays.exact_t.resize(x_px.size());
  const Eigen::Vector3d centre = setup_.desired.centre;
  traced_->tracer.Trace(centre.cast<float>(), rays.direction, rays.t, rays.normal, rays.face);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (IsMet(rays.t[i]))
      rays.exact_t[i] = traced_->tracer.Refined(rays.face[i], centre, rays.exact_direction[i], rays.t[i]);
  if (setup_.method) setup_.method->Meet(rays);
  WeightsAtRays at;
  OptimumCounts counts;
  WeighScratch scratch;
  Reconstruct(setup_, visibility_, rays, at.table, counts, scratch);
  NumberAsViews(at.table.camera);
  at.point.assign(3 * rays.size(), kNoPlace);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!IsMet(rays.t[i]) || !world_from_normalized_) continue;
    const Eigen::Vector3d point = *world_from_normalized_ * (centre + rays.exact_t[i] * rays.exact_direction[i]);
    std::copy_n(point.data(), 3, at.point.data() + 3 * i);
  }
  return at;
}

std::vector<double> SharesOfPhotos(const ViewPlan& plan, std::size_t views) {
  std::vector<double> shares(views, 0.0);
  const auto k = static_cast<std::size_t>(plan.k);
  for (std::size_t pixel = 0; pixel < plan.alpha.size(); ++pixel)
    for (std::size_t i = pixel * k; i < (pixel + 1) * k; ++i)
      if (plan.photo[i] >= 0)
        shares[static_cast<std::size_t>(plan.photo[i])] += static_cast<double>(plan.alpha[pixel] * plan.weight[i]);
  for (double& s : shares) s /= static_cast<double>(std::max<std::size_t>(1, plan.alpha.size()));
  return shares;
}

}  // namespace lumi
