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

// For memory that is reserved and not yet written. Only pages that lie within it: others would take up to 2 MB more
// than the picture. Advice: nothing happens where the kernel has no such pages. (An allocator would do it too, but a
// std::vector with one of its own writes, copies and destroys byte by byte, which unoptimised code is slow at.)
inline void WantLargePages(void* memory, std::size_t bytes) {
  if (bytes < kLargePicture) return;
  const auto begin = reinterpret_cast<std::uintptr_t>(memory), first = (begin + kLargePage - 1) / kLargePage,
             last = (begin + bytes) / kLargePage;
  madvise(reinterpret_cast<void*>(first * kLargePage), (last - first) * kLargePage, MADV_HUGEPAGE);
}

}  // namespace lumi
