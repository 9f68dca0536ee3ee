#include "render/photos/photo_slots.h"

#include <stdexcept>
#include <utility>

namespace lumi {
namespace {

// Photos are made whole up to this share of the slots; up to all of them, those that are whole stay so. Otherwise
// photos at the limit would be read again and again while a camera moves.
constexpr double kReadShare = 0.8;

int& Count(PhotoRoom& room, PhotoSize size) { return size == PhotoSize::kWhole ? room.whole : room.small; }

}  // namespace

PhotoSlots::PhotoSlots(std::vector<int> kind, std::vector<PhotoRoom> room)
    : kind_(std::move(kind)),
      room_(std::move(room)),
      used_(room_.size()),
      held_(kind_.size(), PhotoSize::kNone),
      wanted_(kind_.size(), PhotoSize::kNone),
      when_(kind_.size(), 0),
      given_up_(kind_.size(), false) {}

int PhotoSlots::Free(int kind, PhotoSize size) const {
  PhotoRoom room = room_[static_cast<std::size_t>(kind)], used = used_[static_cast<std::size_t>(kind)];
  return Count(room, size) - Count(used, size);
}

void PhotoSlots::Want(std::span<const Wish> wishes) {
  ++number_;
  for (const std::int32_t p : order_) wanted_[static_cast<std::size_t>(p)] = PhotoSize::kNone;
  order_.clear();
  std::vector<PhotoRoom> left = room_, read = room_;
  for (PhotoRoom& r : read)
    if (r.whole > 1) r.whole = static_cast<int>(kReadShare * r.whole);
  for (const auto& [p, size] : wishes) {
    const auto i = static_cast<std::size_t>(p);
    const auto kind = static_cast<std::size_t>(kind_[i]);
    PhotoRoom& room = left[kind];
    const bool whole =
        size == PhotoSize::kWhole && room.whole > 0 && (read[kind].whole > 0 || held_[i] == PhotoSize::kWhole);
    if (size == PhotoSize::kWhole) --read[kind].whole;
    if (!whole && room.small == 0) continue;
    wanted_[i] = whole ? PhotoSize::kWhole : PhotoSize::kSmall;
    --Count(room, wanted_[i]);
    when_[i] = number_;
    order_.push_back(p);
  }
}

std::vector<PhotoSlots::Wish> PhotoSlots::missing() const {
  std::vector<Wish> missing;
  for (const std::int32_t p : order_) {
    const auto i = static_cast<std::size_t>(p);
    if (held_[i] < wanted_[i] && !given_up_[i]) missing.push_back({p, wanted_[i]});
  }
  return missing;
}

PhotoSlots::Placed PhotoSlots::Place(std::int32_t photo, PhotoSize size) {
  const auto i = static_cast<std::size_t>(photo);
  if (size == PhotoSize::kNone) throw std::invalid_argument("PhotoSlots: a photo has a size");
  if (held_[i] == size) return {true, -1};
  Placed result;
  if (Free(kind_[i], size) == 0) {
    // Who is wanted in this size keeps its slot; there are no more of them than slots.
    for (std::size_t p = 0; p < kind_.size(); ++p) {
      if (p == i || kind_[p] != kind_[i] || held_[p] != size || wanted_[p] == size) continue;
      if (result.dropped < 0 || when_[p] < when_[static_cast<std::size_t>(result.dropped)])
        result.dropped = static_cast<std::int32_t>(p);
    }
    if (result.dropped < 0) return {};
    Drop(result.dropped);
  }
  Drop(photo);
  held_[i] = size;
  ++Count(used_[static_cast<std::size_t>(kind_[i])], size);
  result.placed = true;
  return result;
}

void PhotoSlots::Drop(std::int32_t photo) {
  const auto i = static_cast<std::size_t>(photo);
  if (held_[i] == PhotoSize::kNone) return;
  --Count(used_[static_cast<std::size_t>(kind_[i])], held_[i]);
  held_[i] = PhotoSize::kNone;
}

void PhotoSlots::GiveUp(std::int32_t photo) { given_up_[static_cast<std::size_t>(photo)] = true; }

}  // namespace lumi
