#include "scene/model/picture_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>

#include "scene/model/image.h"

namespace lumi {
namespace {

// What the kernel says of the memory at `address`: whether it may have large pages ("hg" among its VmFlags).
bool MayHaveLargePages(const void* address) {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream maps("/proc/self/smaps");
  bool here = false;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::string first, flag;
    words >> first;
    if (const std::size_t dash = first.find('-'); dash != std::string::npos && first.back() != ':')
      here = std::stoull(first.substr(0, dash), nullptr, 16) <= at &&
             at < std::stoull(first.substr(dash + 1), nullptr, 16);
    if (here && first == "VmFlags:")
      while (words >> flag)
        if (flag == "hg") return true;
  }
  return false;
}

// Some sandboxes have neither file.
bool KernelTellsOfLargePages() {
  return std::ifstream("/sys/kernel/mm/transparent_hugepage/enabled").good() &&
         std::ifstream("/proc/self/smaps").good();
}

TEST(PictureMemory, LargePicturesMayHaveLargePagesAndSoMayTheirCopies) {
  if (!KernelTellsOfLargePages()) GTEST_SKIP() << "this kernel has no transparent_hugepage or no smaps";
  // 16 bytes a pixel: 92 MB, which no free memory of earlier tests holds.
  const ImageF large(2400, 2400, 4, 0.25F);
  EXPECT_TRUE(MayHaveLargePages(large.data.data() + large.data.size() / 2));
  const ImageF copy = large;
  EXPECT_TRUE(MayHaveLargePages(copy.data.data() + copy.data.size() / 2));
  ImageF assigned(3, 2, 1);
  assigned = large;
  EXPECT_TRUE(MayHaveLargePages(assigned.data.data() + assigned.data.size() / 2));
  const Image8 small(64, 64, 3);
  EXPECT_FALSE(MayHaveLargePages(small.data.data()));
}

// The advice is for whole pages within the memory: none of it reaches what lies beside it.
TEST(PictureMemory, LargePagesLieWithinThePicture) {
  if (!KernelTellsOfLargePages()) GTEST_SKIP() << "this kernel has no transparent_hugepage or no smaps";
  const ImageF large(2400, 2400, 4);
  const auto begin = reinterpret_cast<std::uintptr_t>(large.data.data()),
             end = reinterpret_cast<std::uintptr_t>(large.data.data() + large.data.size());
  if (begin % kLargePage != 0) {
    EXPECT_FALSE(MayHaveLargePages(large.data.data()));
  }
  if (end % kLargePage != 0) {
    EXPECT_FALSE(MayHaveLargePages(large.data.data() + large.data.size() - 1));
  }
}

TEST(PictureMemory, LargePicturesBehaveAsSmallOnes) {
  for (const int side : {0, 1, 64, 2000, 2400}) {  // the last two are large
    const ImageF image(side, side, 4, 0.25F);
    EXPECT_EQ(image.data.size(), static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 4);
    EXPECT_TRUE(std::ranges::all_of(image.data, [](float v) { return v == 0.25F; }));
    ImageF copy = image;
    EXPECT_EQ(copy.data, image.data);
    EXPECT_EQ(copy.width, side);
    // Of another size, larger and smaller, and itself.
    ImageF other(100, 30, 2, 1.0F);
    other = copy;
    EXPECT_EQ(other.data, image.data);
    EXPECT_EQ(other.channels, 4);
    const ImageF& self = other;
    other = self;
    EXPECT_EQ(other.data, image.data);
    other = ImageF(2, 2, 1, 3.0F);
    EXPECT_EQ(other.data, ImageF::Values(4, 3.0F));
    const ImageF moved = std::move(copy);
    EXPECT_EQ(moved.data, image.data);
  }
}

}  // namespace
}  // namespace lumi
