#include "render/lumigraph/view_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "render/cpu/pixels.h"
#include "render/radiance/reconstruct.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr double kNoPlace = std::numeric_limits<double>::quiet_NaN();

bool IsMet(float t) { return t > 0 && std::isfinite(t); }

// Copies a tile of the picture to its place in the whole.
void CopyTile(const FramePlan& tile, ViewPlan& whole) {
  const auto k = static_cast<std::size_t>(whole.k), tile_k = static_cast<std::size_t>(tile.k);
  std::size_t s = 0;
  for (int y = 0; y < tile.window.height; ++y)
    for (int x = 0; x < tile.window.width; ++x, ++s) {
      const auto pixel = static_cast<std::size_t>(tile.window.y + y) * static_cast<std::size_t>(whole.width) +
                         static_cast<std::size_t>(tile.window.x + x);
      std::copy_n(tile.camera.data() + s * tile_k, tile_k, whole.photo.data() + pixel * k);
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

void ViewWeights::ForTiles(const std::function<void(const FramePlan&)>& body) const {
  ForPixelTiles(setup_, traced_->tracer, visibility_, InterruptRequested, size_px_, [&](FramePlan& plan) {
    NumberAsViews(plan.camera);
    body(plan);
  });
  CheckInterrupted();
}

// Where the rays of a tile meet the proxy.
void ViewWeights::Place(const FramePlan& tile, ViewPlan& whole) const {
  const PixelWindow& w = tile.window;
  std::vector<Eigen::Vector3f> direction(static_cast<std::size_t>(w.width));
  std::vector<float> t(direction.size());
  const double units = 1 / traced_->sources.normalized_from_world.scale;
  for (int y = 0; y < w.height; ++y) {
    for (int x = 0; x < w.width; ++x)
      direction[static_cast<std::size_t>(x)] =
          (setup_.ray_from_pixel * Eigen::Vector3d(w.x + x + 0.5, w.y + y + 0.5, 1)).normalized().cast<float>();
    traced_->tracer.Trace(setup_.desired.centre.cast<float>(), direction, t);
    for (std::size_t x = 0; x < t.size(); ++x) {
      const std::size_t s = static_cast<std::size_t>(y) * t.size() + x;
      const auto pixel =
          static_cast<std::size_t>(w.y + y) * static_cast<std::size_t>(whole.width) + static_cast<std::size_t>(w.x) + x;
      // A published method may have a surface of its own in place of the proxy.
      const bool seen = tile.alpha[s] > 0;
      if (!seen && !IsMet(t[x])) continue;
      const Eigen::Vector3d offset = (seen ? tile.offset[s] : Eigen::Vector3f(t[x] * direction[x])).cast<double>();
      whole.depth[pixel] = units * setup_.desired.P.row(2).head<3>().dot(offset);
      if (!world_from_normalized_) continue;
      const Eigen::Vector3d point = *world_from_normalized_ * (setup_.desired.centre + offset);
      std::copy_n(point.data(), 3, whole.point.data() + 3 * pixel);
    }
  }
}

ViewPlan ViewWeights::Plan() const {
  ViewPlan whole;
  whole.width = size_px_.x();
  whole.height = size_px_.y();
  std::vector<FramePlan> tiles;
  std::mutex adding;
  ForTiles([&](const FramePlan& tile) {
    const std::lock_guard lock(adding);
    tiles.push_back(tile);
  });
  for (const FramePlan& tile : tiles) whole.k = std::max(whole.k, tile.k);
  const auto k = static_cast<std::size_t>(whole.k),
             n = static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  whole.photo.assign(n * k, -1);
  whole.weight.assign(n * k, 0);
  whole.alpha.assign(n, 0);
  whole.point.assign(3 * n, kNoPlace);
  whole.depth.assign(n, kNoPlace);
  ParallelFor(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      CopyTile(tiles[i], whole);
      Place(tiles[i], whole);
    }
  });
  return whole;
}

std::vector<double> ViewWeights::Shares(std::size_t views) const {
  // Whole numbers: their sum does not depend on which tile comes first.
  constexpr double kUnit = 1 << 20;
  std::vector<long> sums(views, 0);
  std::mutex adding;
  ForTiles([&](const FramePlan& tile) {
    std::vector<long> here(views, 0);
    for (std::size_t i = 0; i < tile.camera.size(); ++i)
      if (tile.camera[i] >= 0)
        here[static_cast<std::size_t>(tile.camera[i])] +=
            std::lround(kUnit * static_cast<double>(tile.alpha[i / static_cast<std::size_t>(tile.k)] * tile.weight[i]));
    const std::lock_guard lock(adding);
    for (std::size_t v = 0; v < views; ++v) sums[v] += here[v];
  });
  std::vector<double> shares;
  for (const long sum : sums) shares.push_back(static_cast<double>(sum) / kUnit / size_px_.x() / size_px_.y());
  return shares;
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

}  // namespace lumi
