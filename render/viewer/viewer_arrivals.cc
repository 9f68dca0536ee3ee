// What reaches the viewer from other threads: photos, their exposures, proxies.
#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "render/viewer/viewer_app.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kLoadedRefresh_s = 0.35;    // photos that arrive are shown in batches
constexpr double kUploadTime_s = 0.025;      // a frame
constexpr int kExposureSide = 256;           // of the photos whose exposures are compared

}  // namespace

void Viewer::SetProxy(PreparedProxy proxy) {
  gl_.SetProxy(proxy.mesh, std::move(proxy.visibility), proxy.tracer);
  proxy_tracer_ = std::move(proxy.tracer);
  facts_.proxy = proxy.name;
  facts_.faces = static_cast<int>(proxy.mesh.faces.size());
  ++generation_;
}

// A small copy, for the photos' exposures.
void Viewer::KeepForExposure(ViewId view, const Photo& photo) {
  if (!exposures_wanted_) return;
  std::size_t level = 0;
  while (level + 1 < photo.levels.size() && std::max(photo.levels[level].width, photo.levels[level].height) > kExposureSide) ++level;
  Photo& kept = small_photos_[static_cast<std::size_t>(view.value)];
  kept.levels.assign(photo.levels.begin() + static_cast<std::ptrdiff_t>(level), photo.levels.end());
  kept.level0_shift = photo.level0_shift + static_cast<int>(level);
}

// When all photos are there, their exposures are compared: on another thread, then drawn with.
void Viewer::TakeExposures() {
  if (exposures_wanted_ && !exposing_.valid() && loader_.outstanding() == 0) {
    exposures_wanted_ = false;
    exposing_ = std::async(std::launch::async, [this, photos = std::move(small_photos_)] { return EstimateExposures(scene_, photos); });
  }
  facts_.effects_open = exposing_.valid() || exposures_wanted_;
  if (!exposing_.valid() || exposing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const Exposures found = exposing_.get();
  facts_.effects_open = false;
  lumigraph_.SetExposures(found);
  gl_.SetGains(found.gain);
  for (Effect& e : effects_.effects)
    if (e.name == "exposure") {
      e.on = found.Differ();
      e.evidence = e.on ? fmt::format("photos of one point differ by a factor of up to {:.2f}", found.spread) : "photos of one point agree";
    }
  facts_.effects = effects_.effects;
  if (options_.effects == "auto" && decided_.count("exposure") == 0) SwitchEffect(settings_.radiance, "exposure", found.Differ());
  if (settings_.radiance.exposure) ++generation_;
}

void Viewer::TakePhotos() {
  const auto start = Clock::now();
  while (SecondsSince(start) < kUploadTime_s) {
    std::optional<PhotoLoader::Loaded> loaded = loader_.Take();
    if (!loaded) break;
    const Image8* first = loaded->photo.levels.empty() ? nullptr : &loaded->photo.levels.front();
    const Eigen::Vector2i planned = budget_.sizes_px[static_cast<std::size_t>(loaded->view.value)];
    if (first != nullptr && (first->width != planned.x() || first->height != planned.y()))
      loaded->error = scene_.views[static_cast<std::size_t>(loaded->view.value)].name + " is not of its camera's size";
    if (!loaded->error.empty()) {
      ++facts_.photos_failed;
      progress_.Message(loaded->error);
      Say(loaded->error);
      continue;
    }
    gl_.Upload(loaded->view, loaded->photo);
    KeepForExposure(loaded->view, loaded->photo);
    if (settings_.Refines())
      (*photos_)[static_cast<std::size_t>(loaded->view.value)] = std::move(loaded->photo);
    else
      photos_missing_ = true;
    new_photos_ = true;
  }
  if (facts_.photos_failed == facts_.photos_total)
    throw InputError(scene_.image_folder, "none of the photos could be read: " + facts_.message);
  facts_.photos_loaded = gl_.photo_count();
  facts_.photo_mb = static_cast<double>(gl_.photo_bytes()) / kMb;
  if (new_photos_ && (loader_.outstanding() == 0 || SecondsSince(last_refresh_) > kLoadedRefresh_s)) {
    ++generation_;
    new_photos_ = false;
    last_refresh_ = Clock::now();
  }
}

void Viewer::WishProxy(const std::string& name) {
  if (name == facts_.proxy || proxy_loading_.valid()) return;
  proxy_loading_ =
      std::async(std::launch::async, [this, name, sources = gl_.sources()] { return PrepareProxy(name, LoadProxy(scene_, name), sources); });
}

void Viewer::TakeProxy() {
  facts_.proxy_loading = proxy_loading_.valid();
  if (!facts_.proxy_loading || proxy_loading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  try {
    SetProxy(proxy_loading_.get());
  } catch (const Error& e) {
    Complain(e);
  }
}

}  // namespace lumi
