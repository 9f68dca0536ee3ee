// Memory of pictures. A new picture of 4K in floats is 130 MB that the kernel hands over page by page: with pages of
// 4 KB that takes longer than drawing it on a graphics processor. Large pictures ask for pages of 2 MB.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace lumi {

constexpr std::size_t kLargePage = std::size_t(2) << 20;
// Smaller ones do not: photos are many, and each would cost the kernel an area of its own, of which it has 65,530.
constexpr std::size_t kLargePicture = 8 * kLargePage;

// Asks for large pages for memory that is reserved and not yet written: for those that lie within it, because others
// would take up to 2 MB more than the picture. Nothing happens where the kernel has none. No allocator, because a
// std::vector with an allocator of its own writes, copies and destroys value by value, three times as slow at -O1.
inline void WantLargePages(void* memory, std::size_t bytes) {
  if (bytes < kLargePicture) return;
  const auto begin = reinterpret_cast<std::uintptr_t>(memory), first = (begin + kLargePage - 1) / kLargePage,
             last = (begin + bytes) / kLargePage;
  madvise(reinterpret_cast<void*>(first * kLargePage), (last - first) * kLargePage, MADV_HUGEPAGE);
}

}  // namespace lumi
