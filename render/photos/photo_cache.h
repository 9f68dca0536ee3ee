// Photographs of a scene that need not all fit into memory: those that a picture is blended from are read when it is
// wanted, and the ones used longest ago make room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "render/photos/photo_set.h"

namespace lumi {

struct WantedPhoto {
  std::int32_t photo = 0;
  int halvings = 0;  // it is seen from so far away that it may be halved so often (CopyHalvings at most)
};

// How often photos are halved for their small copies: none is longer than kCopySide then. Halving more would save
// nothing.
constexpr int kCopySide = 128;
int CopyHalvings(const Scene& scene);

constexpr int kMostHalvings = 16;
// Halves photos from the last one in `ranked` on, each once before any is halved again, until all of them fit into
// `budget` (or are a pixel). bytes_at(photo, halvings): what one takes. `halvings` begins with what they may be.
void HalveToFit(std::span<const std::size_t> ranked, std::size_t budget,
                const std::function<std::size_t(std::size_t, int)>& bytes_at, std::vector<int>& halvings);

class PhotoCache {
 public:
  // Nothing is read yet. The scene must outlive it; corrections of its views count as they are when a photo is read.
  PhotoCache(const Scene& scene, std::size_t budget_bytes);

  // Bytes of all photos at full size, with their pyramids.
  static std::size_t BytesOf(const Scene& scene);
  static std::size_t BytesOf(const Eigen::Vector2i& size_px);    // of one
  static std::size_t BytesOf(const std::vector<Photo>& photos);  // as they are

  // Photos that may be read at once: files, copies and pyramids in the making take 256 MB then.
  static std::size_t ReadableAtOnce(const Scene& scene);

  // All photos, small (ReadSmallPhotos): they stand in for those that are not in memory, and for what is far away. They
  // count for the budget.
  void SetSmall(std::vector<Photo> small);

  // One a view of the scene, at the same address always; those that are not in memory have no levels, or are small.
  const std::vector<Photo>& photos() const { return photos_; }
  // Brings these photos into memory: reads missing ones in parallel and drops others for them. Each is named once, the
  // most important ones first; if together they exceed the budget, they are halved (HalveToFit). A photo may be held
  // larger than it is wanted. Throws InputError for a photo that cannot be read; not thread-safe.
  // Returns how often photos were halved at most, beyond what they may be.
  int Bring(std::span<const WantedPhoto> wanted);

  struct Counts {
    long read = 0;         // photos, from their files
    int most_halved = 0;   // the most often that photos were halved in any Bring, beyond what they may be
    std::size_t most = 0;  // bytes held at once
  };
  const Counts& counts() const { return counts_; }

 private:
  std::size_t Bytes(std::size_t photo, int shift) const;
  void Drop(std::size_t photo);
  void MakeRoom(std::size_t bytes, long keep_from);
  bool IsSmall(std::size_t photo) const;
  std::size_t Held(std::size_t photo) const;
  std::vector<int> HalvingsOf(std::span<const WantedPhoto> wanted) const;
  void Read(std::span<const WantedPhoto> wanted, const std::vector<std::size_t>& absent,
            const std::vector<int>& halvings);

  const Scene& scene_;
  std::size_t budget_, held_ = 0;  // of photos that are not small
  int coarsest_;                   // halvings that are of use
  std::optional<int> small_;       // halvings of small photos
  std::size_t small_bytes_ = 0;
  std::vector<Photo> photos_;
  std::vector<long> used_;  // the number of the Bring that wanted it last
  long number_ = 0;
  Counts counts_;
};

}  // namespace lumi
