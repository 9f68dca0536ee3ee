// Memory of pictures. A new picture of 4K in floats is 130 MB that the kernel hands over page by page: with pages of
// 4 KB that takes longer than drawing it on a graphics processor. Large pictures ask for pages of 2 MB.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <new>

namespace lumi {

constexpr std::size_t kLargePage = std::size_t(2) << 20;
// Smaller ones do not: photos are many, and each would cost the kernel an area of its own, of which it has 65,530.
constexpr std::size_t kLargePicture = 8 * kLargePage;

// An allocator for std::vector.
template <typename T>
struct PictureMemory {
  using value_type = T;
  PictureMemory() = default;
  template <typename U>
  PictureMemory(const PictureMemory<U>&) {}

  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    if (bytes < kLargePicture) return static_cast<T*>(::operator new(bytes));
    void* memory = ::operator new(bytes, std::align_val_t(kLargePage));
    // Whole pages only: the last one would take up to 2 MB more than the picture. Advice: nothing happens where the
    // kernel has no such pages.
    madvise(memory, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t n) {
    if (n * sizeof(T) < kLargePicture)
      ::operator delete(memory);
    else
      ::operator delete(memory, std::align_val_t(kLargePage));
  }
  template <typename U>
  bool operator==(const PictureMemory<U>&) const {
    return true;
  }
};

}  // namespace lumi
