#include "render/viewer/photo_loader.h"

#include <algorithm>
#include <exception>

#include "render/viewer/navigation.h"
#include "scene/program/out_of_memory.h"

namespace lumi {

PhotoBudget PlanPhotos(const Scene& scene, std::size_t budget_bytes) {
  int largest = 1;
  for (const View& v : scene.views)
    largest = std::max({largest, scene.CameraOf(v).width_px, scene.CameraOf(v).height_px});
  PhotoBudget plan;
  for (int halvings = 0;; ++halvings) {
    plan.max_side_px = std::max(1, largest >> halvings);
    plan.sizes_px.clear();
    plan.bytes = 0;
    for (const View& v : scene.views) {
      Eigen::Vector2i size(scene.CameraOf(v).width_px, scene.CameraOf(v).height_px);
      while (size.maxCoeff() > plan.max_side_px) size = (size / 2).cwiseMax(1);
      plan.sizes_px.push_back(size);
      plan.bytes += static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * 16 / 3;
    }
    if (plan.bytes <= budget_bytes || plan.max_side_px == 1) return plan;
  }
}

PhotoLoader::PhotoLoader(const Scene& scene, int max_side_px, int threads)
    : scene_(scene),
      options_{max_side_px, true},
      pending_(scene.views.size(), true),
      untaken_(static_cast<int>(scene.views.size())) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
}

PhotoLoader::~PhotoLoader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  room_.notify_all();
  for (std::thread& t : threads_) t.join();
}

void PhotoLoader::SetFocus(const Rigid3& cam_from_world) {
  const std::lock_guard lock(mutex_);
  focus_ = cam_from_world;
}

void PhotoLoader::Work() {
  for (;;) {
    Loaded loaded;
    {
      std::unique_lock lock(mutex_);
      room_.wait(lock, [this] { return stop_ || ready_.size() < kMaxReady; });
      if (stop_) return;
      const int next = NearestView(scene_, focus_, pending_);
      if (next < 0) return;
      pending_[static_cast<std::size_t>(next)] = false;
      loaded.view = ViewId{next};
    }
    try {
      loaded.photo = LoadPhoto(scene_, loaded.view, options_);
    } catch (const std::exception& e) {
      MemoryIsBack();
      loaded.photo = {};
      loaded.error = e.what();
    }
    const std::lock_guard lock(mutex_);
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
    --untaken_;
  }
  room_.notify_one();
  return taken;
}

int PhotoLoader::outstanding() const {
  const std::lock_guard lock(mutex_);
  return untaken_;
}

}  // namespace lumi
