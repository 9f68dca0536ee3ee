#include "render/photos/photo_cache.h"

#include <algorithm>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

Eigen::Vector2i SizeOf(const Scene& scene, std::size_t view) {
  const Camera& camera = scene.CameraOf(scene.views[view]);
  return {camera.width_px, camera.height_px};
}

std::size_t HeldBy(const Photo& photo) {
  std::size_t bytes = 0;
  for (const Image8& level : photo.levels) bytes += level.data.size();
  return bytes;
}

// So often, but not to less than a pixel.
void Halve(Photo& photo, int times) {
  const auto finer = std::min(static_cast<std::size_t>(times), photo.levels.size() - 1);
  photo.levels.erase(photo.levels.begin(), photo.levels.begin() + static_cast<std::ptrdiff_t>(finer));
  photo.level0_shift += static_cast<int>(finer);
}

constexpr int kMostHalvings = 16;
// Bytes while a photo is being read: the file's picture, a copy and the pyramid. kReadingBytes of them may be used at
// once, beside the budget.
constexpr std::size_t kReadingBytesAPixel = 7, kReadingBytes = std::size_t{256} << 20;

}  // namespace

PhotoCache::PhotoCache(const Scene& scene, std::size_t budget_bytes)
    : scene_(scene), budget_(budget_bytes), photos_(scene.views.size()), used_(scene.views.size(), 0) {}

std::size_t PhotoCache::BytesOf(const Eigen::Vector2i& size_px) {
  std::size_t bytes = 0;
  for (Eigen::Vector2i size = size_px;; size = (size / 2).cwiseMax(1)) {
    bytes += 3 * static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    if (size.maxCoeff() <= 1) return bytes;
  }
}

std::size_t PhotoCache::BytesOf(const Scene& scene) {
  std::size_t bytes = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) bytes += BytesOf(SizeOf(scene, v));
  return bytes;
}

std::size_t PhotoCache::Bytes(std::size_t photo, int shift) const {
  Eigen::Vector2i size = SizeOf(scene_, photo);
  for (int i = 0; i < shift; ++i) size = (size / 2).cwiseMax(1);
  return BytesOf(size);
}

void PhotoCache::Drop(std::size_t photo) {
  held_ -= HeldBy(photos_[photo]);
  photos_[photo] = {};
}

// Drops photos that were last wanted before Bring number `keep_from`, least recently used first, until `bytes` more
// fit.
void PhotoCache::MakeRoom(std::size_t bytes, long keep_from) {
  if (held_ + bytes <= budget_) return;
  std::vector<std::size_t> idle;
  for (std::size_t v = 0; v < photos_.size(); ++v)
    if (!photos_[v].levels.empty() && used_[v] < keep_from) idle.push_back(v);
  std::ranges::sort(idle, {}, [&](std::size_t v) { return std::pair(used_[v], v); });
  for (const std::size_t v : idle) {
    if (held_ + bytes <= budget_) return;
    Drop(v);
  }
}

// How often each of `wanted` has to be halved for all of them to fit.
std::vector<int> PhotoCache::HalvingsOf(std::span<const std::int32_t> wanted) const {
  // A photo that is held halved gets twice its rank, as if it mattered less: otherwise photos near the limit would be
  // read again for every picture.
  std::vector<std::pair<std::size_t, std::size_t>> order;  // rank, place in `wanted`
  std::size_t together = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[i]);
    order.emplace_back(photos_[v].level0_shift > 0 ? 2 * i + 1 : i, i);
    together += Bytes(v, 0);
  }
  std::ranges::sort(order);
  std::vector<int> halvings(wanted.size(), 0);
  for (int round = 0; round < kMostHalvings && together > budget_; ++round)
    for (std::size_t n = order.size(); n-- > 0 && together > budget_;) {
      const std::size_t i = order[n].second;
      const auto v = static_cast<std::size_t>(wanted[i]);
      together += Bytes(v, round + 1);
      together -= Bytes(v, round);
      halvings[i] = round + 1;
    }
  return halvings;
}

// Reads the photos at the places `absent` in `wanted`, and halves them.
void PhotoCache::Read(std::span<const std::int32_t> wanted, const std::vector<std::size_t>& absent,
                      const std::vector<int>& halvings) {
  std::size_t largest = 1;
  for (const std::size_t i : absent)
    largest = std::max(largest, static_cast<std::size_t>(
                                    SizeOf(scene_, static_cast<std::size_t>(wanted[i])).cast<std::int64_t>().prod()));
  const std::size_t at_once = std::max<std::size_t>(1, kReadingBytes / (kReadingBytesAPixel * largest));
  std::vector<Photo> read(absent.size());
  for (std::size_t from = 0; from < absent.size(); from += at_once)
    ParallelFor(std::min(at_once, absent.size() - from), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = from + begin; i < from + end; ++i) {
        read[i] = LoadPhoto(scene_, {wanted[absent[i]]}, {});
        Halve(read[i], halvings[absent[i]]);
      }
    });
  for (std::size_t i = 0; i < absent.size(); ++i) {
    held_ += HeldBy(read[i]);
    photos_[static_cast<std::size_t>(wanted[absent[i]])] = std::move(read[i]);
  }
  counts_.read += static_cast<long>(absent.size());
  counts_.most = std::max(counts_.most, held_);
}

void PhotoCache::Bring(std::span<const std::int32_t> wanted) {
  ++number_;
  const std::vector<int> halvings = HalvingsOf(wanted);
  std::vector<std::size_t> absent;  // places in `wanted`
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[i]);
    used_[v] = number_;
    counts_.most_halved = std::max(counts_.most_halved, halvings[i]);
    Photo& photo = photos_[v];
    if (!photo.levels.empty() && photo.level0_shift > halvings[i]) Drop(v);
    if (photo.levels.empty()) {
      absent.push_back(i);
      bytes += Bytes(v, halvings[i]);
    } else {  // halved further if it is finer than there is room for
      held_ -= HeldBy(photo);
      Halve(photo, halvings[i] - photo.level0_shift);
      held_ += HeldBy(photo);
    }
  }
  MakeRoom(bytes, number_);
  Read(wanted, absent, halvings);
}

}  // namespace lumi
