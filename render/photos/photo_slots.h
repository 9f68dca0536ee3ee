// Which photos are held where not all of them fit into graphics memory: in a fixed number of slots of each size, the
// most wanted ones as large as they are wanted, those after them smaller. The photo that was wanted longest ago makes
// room. Decides only; who owns the pixels acts on it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lumi {

// How often a photo is halved in its slot, or nothing.
using SlotHalvings = std::optional<int>;
constexpr int kSlotSizes = 3;  // whole, halved once, twice

// Slots for photos of one kind, of each size.
using PhotoRoom = std::array<int, kSlotSizes>;

class PhotoSlots {
 public:
  // kind: of each photo, an index into `room`. Photos of one kind share its slots.
  PhotoSlots(std::vector<int> kind, std::vector<PhotoRoom> room);

  struct Wish {
    std::int32_t photo = 0;
    int halvings = 0;  // less than kSlotSizes
  };
  // From now on these are wanted, each once, the most important ones first, as far as there are slots: where there is
  // none left of a size, a photo is wanted smaller.
  void Want(std::span<const Wish> wishes);

  // What is wanted and not held, or held too small; the most important ones first. Once all of it was placed there may
  // be more: photos that were held larger than wanted, and made room. After kSlotSizes times there is none.
  std::vector<Wish> missing() const;

  struct Placed {
    bool placed = false;        // false: no longer wanted so large, and nothing would make room for it
    std::int32_t dropped = -1;  // the photo that made room; its slot is free now
  };
  // Gives a photo a slot, and frees the one that it had.
  Placed Place(std::int32_t photo, int halvings);
  void Drop(std::int32_t photo);
  // Never missing again: it cannot be read.
  void GiveUp(std::int32_t photo);

  SlotHalvings held(std::int32_t photo) const { return held_[static_cast<std::size_t>(photo)]; }

 private:
  int Free(int kind, int halvings) const;

  std::vector<int> kind_;
  std::vector<PhotoRoom> room_, used_;
  std::vector<SlotHalvings> held_, wanted_;  // of each photo
  std::vector<long> when_;                   // the number of the Want that wanted it last
  std::vector<bool> given_up_;
  std::vector<std::int32_t> order_;  // of the last Want
  long number_ = 0;
};

}  // namespace lumi
