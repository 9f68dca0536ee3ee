// Memory of pictures. A new picture of 4K in floats is 130 MB that the kernel hands over page by page: with pages of
// 4 KB that takes longer than drawing it on a graphics processor. Large pictures ask for pages of 2 MB.
#pragma once

#include <cstddef>
#include <new>

namespace lumi {

constexpr std::size_t kLargePage = std::size_t(2) << 20;
// From this size on, what is lost at the last page's end is an eighth of it at most.
constexpr std::size_t kLargePicture = 8 * kLargePage;

// Advice to the kernel: nothing happens where it has no such pages.
void WantLargePages(void* begin, std::size_t bytes);

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
    WantLargePages(memory, bytes);
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
