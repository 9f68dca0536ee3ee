// Photographs of a scene that need not all fit into memory: those that a picture is blended from are read when it is
// wanted, and the ones used longest ago make room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render/photos/photo_set.h"

namespace lumi {

class PhotoCache {
 public:
  // Nothing is read yet. The scene must outlive it; corrections of its views count as they are when a photo is read.
  PhotoCache(const Scene& scene, std::size_t budget_bytes);

  // Bytes of all photos at full size, with their pyramids.
  static std::size_t BytesOf(const Scene& scene);
  static std::size_t BytesOf(const Eigen::Vector2i& size_px);  // of one

  // One a view of the scene, at the same address always; those that are not in memory have no levels.
  const std::vector<Photo>& photos() const { return photos_; }
  // Brings these photos into memory (each named once): reads missing ones in parallel and drops others for them. Photos
  // that matter most come first: if all together exceed the budget, they are halved from the last one on, each once
  // before any is halved again, until they fit (or are one pixel). Throws InputError for a photo that cannot be read;
  // not thread-safe.
  void Bring(std::span<const std::int32_t> wanted);

  struct Counts {
    long read = 0;         // photos, from their files
    int most_halved = 0;   // the most often that photos were halved in any Bring
    std::size_t most = 0;  // bytes held at once
  };
  const Counts& counts() const { return counts_; }

 private:
  std::size_t Bytes(std::size_t photo, int shift) const;
  void Drop(std::size_t photo);
  void MakeRoom(std::size_t bytes, long keep_from);
  std::vector<int> HalvingsOf(std::span<const std::int32_t> wanted) const;
  void Read(std::span<const std::int32_t> wanted, const std::vector<std::size_t>& absent,
            const std::vector<int>& halvings);

  const Scene& scene_;
  std::size_t budget_, held_ = 0;
  std::vector<Photo> photos_;
  std::vector<long> used_;  // the number of the Bring that wanted it last
  long number_ = 0;
  Counts counts_;
};

}  // namespace lumi
