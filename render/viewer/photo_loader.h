// Reads a scene's photos in the background, in the order that they are asked for.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/scene.h"

namespace lumi {

class PhotoLoader {
 public:
  // The scene must outlive the loader. threads >= 1, fewer for large photos.
  PhotoLoader(const Scene& scene, int threads);
  ~PhotoLoader();  // waits for the photos that are being read
  PhotoLoader(const PhotoLoader&) = delete;
  PhotoLoader& operator=(const PhotoLoader&) = delete;

  // From now on these are read, each named once, the first ones first; earlier wishes are forgotten. A photo that is
  // being read, or waits to be taken, is not read again.
  void Ask(std::span<const std::int32_t> views);

  struct Loaded {
    ViewId view;
    Photo photo;  // levels empty: it could not be read
    std::string error;
  };
  // One that is ready, or nullopt. Thread-safe.
  std::optional<Loaded> Take();
  // Photos that were asked for, or are being read, and that Take has not given yet.
  int outstanding() const;

 private:
  void Work();

  const Scene& scene_;
  const std::size_t max_ready_;  // decoded photos that wait to be taken: more would fill memory when the taker is slow
  mutable std::mutex mutex_;
  std::condition_variable more_;
  std::vector<std::int32_t> queue_;  // the next one last
  std::vector<bool> under_way_;      // being read or ready
  int reading_ = 0;
  std::vector<Loaded> ready_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lumi
