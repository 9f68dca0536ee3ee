#include "render/photos/photo_cache.h"

#include <algorithm>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Of a pyramid on an RGB image.
std::size_t PyramidBytes(Eigen::Vector2i size) {
  std::size_t bytes = 0;
  for (;;) {
    bytes += 3 * static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    if (size.maxCoeff() <= 1) return bytes;
    size = (size / 2).cwiseMax(1);
  }
}

Eigen::Vector2i SizeOf(const Scene& scene, std::size_t view) {
  const Camera& camera = scene.CameraOf(scene.views[view]);
  return {camera.width_px, camera.height_px};
}

std::size_t HeldBy(const Photo& photo) {
  std::size_t bytes = 0;
  for (const Image8& level : photo.levels) bytes += level.data.size();
  return bytes;
}

constexpr int kMostHalvings = 16;
// Of a photo that is being read: its file's picture, a copy and the pyramid. So much of it at once beside the budget.
constexpr std::size_t kReadingBytesAPixel = 7, kReadingBytes = std::size_t{256} << 20;

}  // namespace

PhotoCache::PhotoCache(const Scene& scene, std::size_t budget_bytes)
    : scene_(scene), budget_(budget_bytes), photos_(scene.views.size()), used_(scene.views.size(), 0) {}

std::size_t PhotoCache::BytesOf(const Scene& scene) {
  std::size_t bytes = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) bytes += PyramidBytes(SizeOf(scene, v));
  return bytes;
}

std::size_t PhotoCache::Bytes(std::size_t photo, int shift) const {
  Eigen::Vector2i size = SizeOf(scene_, photo);
  for (int i = 0; i < shift; ++i) size = (size / 2).cwiseMax(1);
  return PyramidBytes(size);
}

void PhotoCache::Drop(std::size_t photo) {
  held_ -= HeldBy(photos_[photo]);
  photos_[photo] = {};
}

// Gives up photos that no Bring from `keep_from` on wanted, the ones used longest ago first, until so many bytes more
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

void PhotoCache::Bring(std::span<const std::int32_t> wanted) {
  ++number_;
  // A photo that is there halved comes as if it mattered half as much: else those about the limit would be read anew
  // for picture after picture.
  std::vector<std::pair<std::size_t, std::size_t>> order;  // rank, place in `wanted`
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Photo& photo = photos_[static_cast<std::size_t>(wanted[i])];
    order.emplace_back(!photo.levels.empty() && photo.level0_shift > 0 ? 2 * i + 1 : i, i);
  }
  std::ranges::sort(order);
  std::vector<int> shift(wanted.size(), 0);
  std::size_t together = 0;
  for (const std::int32_t v : wanted) together += Bytes(static_cast<std::size_t>(v), 0);
  for (int round = 0; round < kMostHalvings && together > budget_; ++round)
    for (std::size_t n = order.size(); n-- > 0 && together > budget_;) {
      const std::size_t i = order[n].second;
      const auto v = static_cast<std::size_t>(wanted[i]);
      together += Bytes(v, round + 1);
      together -= Bytes(v, round);
      shift[i] = round + 1;
      counts_.most_halved = std::max(counts_.most_halved, round + 1);
    }

  std::vector<std::size_t> absent;  // into `wanted`
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[i]);
    used_[v] = number_;
    Photo& photo = photos_[v];
    if (!photo.levels.empty() && photo.level0_shift > shift[i]) Drop(v);
    if (photo.levels.empty()) {
      absent.push_back(i);
      bytes += Bytes(v, shift[i]);
      continue;
    }
    // Finer than there is room for.
    const auto finer =
        std::min(static_cast<std::size_t>(std::max(0, shift[i] - photo.level0_shift)), photo.levels.size() - 1);
    if (finer == 0) continue;
    held_ -= HeldBy(photo);
    photo.levels.erase(photo.levels.begin(), photo.levels.begin() + static_cast<std::ptrdiff_t>(finer));
    photo.level0_shift += static_cast<int>(finer);
    held_ += HeldBy(photo);
  }
  MakeRoom(bytes, number_);
  std::size_t largest = 1;
  for (const std::size_t i : absent)
    largest = std::max(largest, static_cast<std::size_t>(
                                    SizeOf(scene_, static_cast<std::size_t>(wanted[i])).cast<std::int64_t>().prod()));
  const std::size_t at_once = std::max<std::size_t>(1, kReadingBytes / (kReadingBytesAPixel * largest));
  for (std::size_t from = 0; from < absent.size(); from += at_once)
    ParallelFor(std::min(at_once, absent.size() - from), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = from + begin; i < from + end; ++i) {
        const std::int32_t view = wanted[absent[i]];
        Photo photo = LoadPhoto(scene_, {view}, {});
        const auto finer = std::min(static_cast<std::size_t>(shift[absent[i]]), photo.levels.size() - 1);
        photo.levels.erase(photo.levels.begin(), photo.levels.begin() + static_cast<std::ptrdiff_t>(finer));
        photo.level0_shift = static_cast<int>(finer);
        photos_[static_cast<std::size_t>(view)] = std::move(photo);
      }
    });
  for (const std::size_t i : absent) held_ += HeldBy(photos_[static_cast<std::size_t>(wanted[i])]);
  counts_.read += static_cast<long>(absent.size());
  counts_.most = std::max(counts_.most, held_);
}

}  // namespace lumi
