#include "render/photos/photo_slots.h"

#include <stdexcept>
#include <utility>

namespace lumi {
namespace {

// New photos are read into this share of a size's slots; the others keep photos that are there already. Otherwise
// photos near the limit would be read again and again while a camera moves.
constexpr double kReadShare = 0.8;

}  // namespace

PhotoSlots::PhotoSlots(std::vector<int> kind, std::vector<PhotoRoom> room)
    : kind_(std::move(kind)),
      room_(std::move(room)),
      used_(room_.size(), PhotoRoom{}),
      held_(kind_.size()),
      wanted_(kind_.size()),
      when_(kind_.size(), 0),
      given_up_(kind_.size(), false) {}

int PhotoSlots::Free(int kind, int halvings) const {
  const auto k = static_cast<std::size_t>(kind), h = static_cast<std::size_t>(halvings);
  return room_[k][h] - used_[k][h];
}

void PhotoSlots::Want(std::span<const Wish> wishes) {
  ++number_;
  for (const std::int32_t p : order_) wanted_[static_cast<std::size_t>(p)].reset();
  order_.clear();
  std::vector<PhotoRoom> left = room_, read = room_;
  for (PhotoRoom& r : read)
    for (int& slots : r)
      if (slots > 1) slots = static_cast<int>(kReadShare * slots);
  for (const Wish& wish : wishes) {
    const auto p = static_cast<std::size_t>(wish.photo), kind = static_cast<std::size_t>(kind_[p]);
    for (int halvings = wish.halvings; halvings < kSlotSizes; ++halvings) {
      const auto h = static_cast<std::size_t>(halvings);
      if (left[kind][h] == 0 || (read[kind][h]-- <= 0 && held_[p] != halvings)) continue;
      --left[kind][h];
      wanted_[p] = halvings;
      when_[p] = number_;
      order_.push_back(wish.photo);
      break;
    }
  }
}

std::vector<PhotoSlots::Wish> PhotoSlots::missing() const {
  std::vector<Wish> missing;
  for (const std::int32_t photo : order_) {
    const auto p = static_cast<std::size_t>(photo);
    if ((!held_[p] || *held_[p] > *wanted_[p]) && !given_up_[p]) missing.push_back({photo, *wanted_[p]});
  }
  return missing;
}

PhotoSlots::Placed PhotoSlots::Place(std::int32_t photo, int halvings) {
  if (halvings < 0 || halvings >= kSlotSizes) throw std::invalid_argument("PhotoSlots: there are no such slots");
  const auto i = static_cast<std::size_t>(photo);
  if (held_[i] == halvings) return {true, -1};
  Placed result;
  if (Free(kind_[i], halvings) == 0) {
    // Who is wanted in this size keeps its slot; there are no more of them than slots.
    for (std::size_t p = 0; p < kind_.size(); ++p) {
      if (p == i || kind_[p] != kind_[i] || held_[p] != halvings || wanted_[p] == halvings) continue;
      if (result.dropped < 0 || when_[p] < when_[static_cast<std::size_t>(result.dropped)])
        result.dropped = static_cast<std::int32_t>(p);
    }
    if (result.dropped < 0) return {};
    Drop(result.dropped);
  }
  Drop(photo);
  held_[i] = halvings;
  ++used_[static_cast<std::size_t>(kind_[i])][static_cast<std::size_t>(halvings)];
  result.placed = true;
  return result;
}

void PhotoSlots::Drop(std::int32_t photo) {
  const auto i = static_cast<std::size_t>(photo);
  if (!held_[i]) return;
  --used_[static_cast<std::size_t>(kind_[i])][static_cast<std::size_t>(*held_[i])];
  held_[i].reset();
}

void PhotoSlots::GiveUp(std::int32_t photo) { given_up_[static_cast<std::size_t>(photo)] = true; }

}  // namespace lumi
