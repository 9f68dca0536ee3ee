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
  if (times <= 0) return;
  const auto finer = std::min(static_cast<std::size_t>(times), photo.levels.size() - 1);
  photo.levels.erase(photo.levels.begin(), photo.levels.begin() + static_cast<std::ptrdiff_t>(finer));
  photo.level0_shift += static_cast<int>(finer);
}

// Bytes while a photo is being read: the file's picture, a copy and the pyramid. kReadingBytes of them may be used at
// once, beside the budget.
constexpr std::size_t kReadingBytesAPixel = 7, kReadingBytes = std::size_t{256} << 20;

}  // namespace

PhotoCache::PhotoCache(const Scene& scene, std::size_t budget_bytes)
    : scene_(scene),
      budget_(budget_bytes),
      coarsest_(CopyHalvings(scene)),
      photos_(scene.views.size()),
      used_(scene.views.size(), 0) {}

std::size_t PhotoCache::BytesOf(const Eigen::Vector2i& size_px) {
  std::size_t bytes = 0;
  for (Eigen::Vector2i size = size_px;; size = (size / 2).cwiseMax(1)) {
    bytes += 3 * static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    if (size.maxCoeff() <= 1) return bytes;
  }
}

void HalveToFit(std::span<const std::size_t> ranked, std::size_t budget,
                const std::function<std::size_t(std::size_t, int)>& bytes_at, std::vector<int>& halvings) {
  std::size_t together = 0;
  for (const std::size_t i : ranked) together += bytes_at(i, halvings[i]);
  for (int round = 0; round < kMostHalvings && together > budget; ++round)
    for (std::size_t n = ranked.size(); n-- > 0 && together > budget;)
      if (const std::size_t i = ranked[n]; halvings[i] <= round) {
        together += bytes_at(i, round + 1);
        together -= bytes_at(i, halvings[i]);
        halvings[i] = round + 1;
      }
}

int CopyHalvings(const Scene& scene) {
  int longest = 1, halvings = 0;
  for (const Camera& c : scene.cameras) longest = std::max({longest, c.width_px, c.height_px});
  while (longest >> halvings > kCopySide) ++halvings;
  return halvings;
}

std::size_t PhotoCache::ReadableAtOnce(const Scene& scene) {
  std::size_t largest = 1;
  for (const Camera& c : scene.cameras)
    largest = std::max(largest, static_cast<std::size_t>(c.width_px) * static_cast<std::size_t>(c.height_px));
  return std::max<std::size_t>(1, kReadingBytes / (kReadingBytesAPixel * largest));
}

std::size_t PhotoCache::BytesOf(const std::vector<Photo>& photos) {
  std::size_t bytes = 0;
  for (const Photo& photo : photos) bytes += HeldBy(photo);
  return bytes;
}

std::size_t PhotoCache::BytesOf(const Scene& scene) {
  std::size_t bytes = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) bytes += BytesOf(SizeOf(scene, v));
  return bytes;
}

std::size_t PhotoCache::Bytes(std::size_t photo, int shift) const {
  return BytesOf(HalvedSize(SizeOf(scene_, photo), shift));
}

void PhotoCache::SetSmall(std::vector<Photo> small) {
  photos_ = std::move(small);
  held_ = 0;
  const std::size_t bytes = BytesOf(photos_);
  for (const Photo& photo : photos_) small_ = std::max(small_.value_or(0), photo.level0_shift);
  budget_ -= std::min(budget_, bytes);
  counts_.most = bytes;
  small_bytes_ = bytes;
}

bool PhotoCache::IsSmall(std::size_t photo) const { return small_ && photos_[photo].level0_shift >= *small_; }

std::size_t PhotoCache::Held(std::size_t photo) const { return IsSmall(photo) ? 0 : HeldBy(photos_[photo]); }

// The small copy is a level of the photo.
void PhotoCache::Drop(std::size_t photo) {
  held_ -= Held(photo);
  if (!small_) {
    photos_[photo] = {};
    return;
  }
  Halve(photos_[photo], *small_ - photos_[photo].level0_shift);
  photos_[photo].level0_shift = *small_;  // also of a photo that is a pixel before
}

// Drops photos that were last wanted before Bring number `keep_from`, least recently used first, until `bytes` more
// fit.
void PhotoCache::MakeRoom(std::size_t bytes, long keep_from) {
  if (held_ + bytes <= budget_) return;
  std::vector<std::size_t> idle;
  for (std::size_t v = 0; v < photos_.size(); ++v)
    if (!photos_[v].levels.empty() && !IsSmall(v) && used_[v] < keep_from) idle.push_back(v);
  std::ranges::sort(idle, {}, [&](std::size_t v) { return std::pair(used_[v], v); });
  for (const std::size_t v : idle) {
    if (held_ + bytes <= budget_) return;
    Drop(v);
  }
}

// How often each of `wanted` has to be halved for all of them to fit.
std::vector<int> PhotoCache::HalvingsOf(std::span<const WantedPhoto> wanted) const {
  const auto bytes_at = [&](std::size_t v, int halvings) {
    return small_ && halvings >= *small_ ? 0 : Bytes(v, halvings);
  };
  // A photo that is held too small gets twice its rank, as if it mattered less: otherwise photos near the limit would
  // be read again for every picture.
  std::vector<std::pair<std::size_t, std::size_t>> order;  // rank, place in `wanted`
  std::vector<int> halvings, most;
  std::size_t together = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[i].photo);
    const int held = photos_[v].level0_shift;
    const bool there = !photos_[v].levels.empty() && !IsSmall(v);
    most.push_back(std::min(wanted[i].halvings, coarsest_));
    int times = most.back();
    // What is finer than needed stays so, and what is read is finer by one: a camera that moves asks for all sizes in
    // turn, and each would be a whole file to read.
    if (there && held <= times)
      times = held;
    else if (times > 1 && !(small_ && times >= *small_))
      --times;
    order.emplace_back(there && held > times ? 2 * i + 1 : i, i);
    halvings.push_back(times);
    together += bytes_at(v, times);
  }
  std::ranges::sort(order);
  // Where that is too much, those go first that are finest for what they show.
  for (int finer = kMostHalvings; finer > 0 && together > budget_; --finer)
    for (std::size_t n = order.size(); n-- > 0 && together > budget_;)
      if (const std::size_t i = order[n].second; halvings[i] + finer == std::min(most[i], kMostHalvings)) {
        const auto v = static_cast<std::size_t>(wanted[i].photo);
        together += bytes_at(v, halvings[i] + 1);
        together -= bytes_at(v, halvings[i]);
        ++halvings[i];
      }
  std::vector<std::size_t> ranked;
  for (const auto& [rank, i] : order) ranked.push_back(i);
  HalveToFit(
      ranked, budget_,
      [&](std::size_t i, int times) { return bytes_at(static_cast<std::size_t>(wanted[i].photo), times); }, halvings);
  return halvings;
}

// Reads the photos at the places `absent` in `wanted`, and halves them.
void PhotoCache::Read(std::span<const WantedPhoto> wanted, const std::vector<std::size_t>& absent,
                      const std::vector<int>& halvings) {
  const std::size_t at_once = ReadableAtOnce(scene_);
  std::vector<Photo> read(absent.size());
  for (std::size_t from = 0; from < absent.size(); from += at_once)
    ParallelFor(std::min(at_once, absent.size() - from), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = from + begin; i < from + end; ++i) {
        read[i] = LoadPhoto(scene_, {wanted[absent[i]].photo}, {});
        Halve(read[i], halvings[absent[i]]);
      }
    });
  for (std::size_t i = 0; i < absent.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[absent[i]].photo);
    photos_[v] = std::move(read[i]);
    held_ += Held(v);
  }
  counts_.read += static_cast<long>(absent.size());
  counts_.most = std::max(counts_.most, small_bytes_ + held_);
}

int PhotoCache::Bring(std::span<const WantedPhoto> wanted) {
  ++number_;
  int most_halved = 0;
  const std::vector<int> halvings = HalvingsOf(wanted);
  std::vector<std::size_t> absent;  // places in `wanted`
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto v = static_cast<std::size_t>(wanted[i].photo);
    used_[v] = number_;
    if (!(small_ && wanted[i].halvings >= *small_))
      most_halved = std::max(most_halved, halvings[i] - wanted[i].halvings);
    Photo& photo = photos_[v];
    if (small_ && halvings[i] >= *small_) {
      if (!IsSmall(v)) Drop(v);
      continue;
    }
    if (!photo.levels.empty() && photo.level0_shift > halvings[i]) Drop(v);
    if (photo.levels.empty() || IsSmall(v)) {
      absent.push_back(i);
      bytes += Bytes(v, halvings[i]);
    } else {  // halved further if it is finer than there is room for
      held_ -= Held(v);
      Halve(photo, halvings[i] - photo.level0_shift);
      held_ += Held(v);
    }
  }
  MakeRoom(bytes, number_);
  Read(wanted, absent, halvings);
  counts_.most_halved = std::max(counts_.most_halved, most_halved);
  return most_halved;
}

}  // namespace lumi
