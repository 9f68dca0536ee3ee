// Which photos are held where not all of them fit into graphics memory: the most wanted ones whole, those after them
// small, in a fixed number of slots each. The photo that was wanted longest ago makes room. Decides only; who owns the
// pixels acts on it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lumi {

enum class PhotoSize : std::uint8_t { kNone, kSmall, kWhole };

// A small photo is halved so often.
constexpr int kSmallShift = 2;

// Slots for photos of one size.
struct PhotoRoom {
  int whole = 0, small = 0;
};

class PhotoSlots {
 public:
  // kind: of each photo, an index into `room`. Photos of one kind share its slots.
  PhotoSlots(std::vector<int> kind, std::vector<PhotoRoom> room);

  struct Wish {
    std::int32_t photo = 0;
    PhotoSize size = PhotoSize::kWhole;
  };
  // From now on these are wanted, each once, the most important ones first, as far as there are slots: where there is
  // none left for a whole photo, it is wanted small.
  void Want(std::span<const Wish> wishes);

  // What is wanted and not held, or held too small; the most important ones first. Once all of it was placed there may
  // be more: small photos that were still held whole, and made room. After a second time there is none.
  std::vector<Wish> missing() const;

  struct Placed {
    bool placed = false;        // false: no longer wanted so large, and nothing would make room for it
    std::int32_t dropped = -1;  // the photo that made room; its slot is free now
  };
  // Gives a photo a slot, and frees the one that it had.
  Placed Place(std::int32_t photo, PhotoSize size);
  void Drop(std::int32_t photo);
  // Never missing again: it cannot be read.
  void GiveUp(std::int32_t photo);

  PhotoSize held(std::int32_t photo) const { return held_[static_cast<std::size_t>(photo)]; }

 private:
  int Free(int kind, PhotoSize size) const;

  std::vector<int> kind_;
  std::vector<PhotoRoom> room_, used_;
  std::vector<PhotoSize> held_, wanted_;  // of each photo
  std::vector<long> when_;                // the number of the Want that wanted it last
  std::vector<bool> given_up_;
  std::vector<std::int32_t> order_;  // of the last Want
  long number_ = 0;
};

}  // namespace lumi
