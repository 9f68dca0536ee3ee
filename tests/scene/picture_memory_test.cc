#include "scene/model/picture_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "scene/model/image.h"

namespace lumi {
namespace {

TEST(PictureMemory, LargePicturesBeginAtALargePageAndBehaveAsSmallOnes) {
  for (const int side : {0, 1, 64, 2000, 2400}) {  // 16 bytes a pixel: the last two are large
    ImageF image(side, side, 4, 0.25F);
    const std::size_t bytes = image.data.size() * sizeof(float);
    if (bytes >= kLargePicture) {
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(image.data.data()) % kLargePage, 0U) << side;
    }
    EXPECT_TRUE(std::ranges::all_of(image.data, [](float v) { return v == 0.25F; }));
    ImageF copy = image;
    EXPECT_EQ(copy.data, image.data);
    // Grows over the limit, and shrinks below it: the new memory is of the other kind.
    copy.data.resize(copy.data.size() + kLargePicture / sizeof(float), 0.5F);
    EXPECT_TRUE(std::equal(image.data.begin(), image.data.end(), copy.data.begin()));
    copy.data.resize(image.data.size());
    copy.data.shrink_to_fit();
    EXPECT_EQ(copy.data, image.data);
    const ImageF moved = std::move(copy);
    EXPECT_EQ(moved.data, image.data);
  }
}

}  // namespace
}  // namespace lumi
