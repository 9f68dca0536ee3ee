// Loads a scene's photos in the background, those near the current view first, halved so that all of them together stay
// within a budget.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/scene.h"

namespace lumi {

struct PhotoBudget {
  int max_side_px = 0;                    // for PhotoOptions; 0: full size
  std::vector<Eigen::Vector2i> sizes_px;  // of each photo's level 0 in memory
  std::size_t bytes = 0;                  // of all of them with their pyramids, four bytes a pixel
};
// The largest halving of the photos that fits into budget_bytes.
PhotoBudget PlanPhotos(const Scene& scene, std::size_t budget_bytes);

class PhotoLoader {
 public:
  // The scene must outlive the loader. threads >= 1.
  PhotoLoader(const Scene& scene, int max_side_px, int threads);
  ~PhotoLoader();  // waits for the photos that are being read
  PhotoLoader(const PhotoLoader&) = delete;
  PhotoLoader& operator=(const PhotoLoader&) = delete;

  // Photos are taken in the order of their distance to this camera from now on.
  void SetFocus(const Rigid3& cam_from_world);

  struct Loaded {
    ViewId view;
    Photo photo;  // levels empty: it could not be read
    std::string error;
  };
  // One that is ready, or nullopt. Thread-safe.
  std::optional<Loaded> Take();
  // Photos that Take has not given yet.
  int outstanding() const;

 private:
  void Work();

  // Decoded photos that wait to be taken: more would fill memory when the taker is slow.
  static constexpr std::size_t kMaxReady = 6;

  const Scene& scene_;
  const PhotoOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable room_;
  std::vector<bool> pending_;
  int untaken_ = 0;
  std::vector<Loaded> ready_;
  Rigid3 focus_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lumi
