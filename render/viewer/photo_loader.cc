#include "render/viewer/photo_loader.h"

#include <algorithm>
#include <exception>

#include "render/photos/photo_cache.h"
#include "scene/program/out_of_memory.h"

namespace lumi {

namespace {

constexpr std::size_t kMostReady = 6, kMostReading = 6;

}  // namespace

PhotoLoader::PhotoLoader(const Scene& scene, int threads)
    : scene_(scene),
      max_ready_(std::min(kMostReady, PhotoCache::ReadableAtOnce(scene))),
      under_way_(scene.views.size(), false) {
  const std::size_t reading =
      std::min({static_cast<std::size_t>(threads), kMostReading, PhotoCache::ReadableAtOnce(scene)});
  for (std::size_t i = 0; i < reading; ++i) threads_.emplace_back([this] { Work(); });
}

PhotoLoader::~PhotoLoader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  more_.notify_all();
  for (std::thread& t : threads_) t.join();
}

void PhotoLoader::Ask(std::span<const std::int32_t> views) {
  {
    const std::lock_guard lock(mutex_);
    queue_.clear();
    for (const std::int32_t v : views)
      if (!under_way_[static_cast<std::size_t>(v)]) queue_.push_back(v);
    std::ranges::reverse(queue_);
  }
  more_.notify_all();
}

void PhotoLoader::Work() {
  for (;;) {
    Loaded loaded;
    {
      std::unique_lock lock(mutex_);
      more_.wait(lock, [this] { return stop_ || (!queue_.empty() && ready_.size() < max_ready_); });
      if (stop_) return;
      loaded.view = ViewId{queue_.back()};
      queue_.pop_back();
      under_way_[static_cast<std::size_t>(loaded.view.value)] = true;
      ++reading_;
    }
    try {
      loaded.photo = LoadPhoto(scene_, loaded.view, {});
    } catch (const std::exception& e) {
      MemoryIsBack();
      loaded.photo = {};
      loaded.error = e.what();
    }
    const std::lock_guard lock(mutex_);
    --reading_;
    ready_.push_back(std::move(loaded));
  }
}

std::optional<PhotoLoader::Loaded> PhotoLoader::Take() {
  std::optional<Loaded> taken;
  {
    const std::lock_guard lock(mutex_);
    if (ready_.empty()) return taken;
    taken = std::move(ready_.front());
    ready_.erase(ready_.begin());
    under_way_[static_cast<std::size_t>(taken->view.value)] = false;
  }
  more_.notify_one();
  return taken;
}

int PhotoLoader::outstanding() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(queue_.size() + ready_.size()) + reading_;
}

}  // namespace lumi
