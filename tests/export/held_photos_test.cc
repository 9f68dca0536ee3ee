// How finely an export holds photos, by what is free.
#include "export/held_photos.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/photos/photo_cache.h"
#include "render/photos/photo_set.h"
#include "scene/program/error.h"
#include "scene/program/memory.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Messages : ProgressSink {
  std::vector<std::string> said;
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& text) override { said.push_back(text); }
};

Scene PhotosOf(int width_px, int height_px, int count) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(width_px, height_px, width_px, width_px, width_px / 2.0, height_px / 2.0));
  for (int i = 0; i < count; ++i) {
    View& view = scene.views.emplace_back();
    view.name = std::to_string(i);
    view.camera = {0};
  }
  return scene;
}

TEST(HeldPhotos, AreWholeWhereTheyFitAndNoLargerThanAPageCouldHave) {
  Messages sink;
  EXPECT_EQ(HalvingsToHold(PhotosOf(640, 480, 5), 0, 1, sink), 0);
  EXPECT_EQ(HalvingsToHold(PhotosOf(4000, 3000, 2), 24e6, 1, sink), 0);
  EXPECT_EQ(HalvingsToHold(PhotosOf(4000, 3000, 3), 24e6, 1, sink), 1);
  EXPECT_EQ(HalvingsToHold(PhotosOf(4000, 3000, 9), 24e6, 2, sink), 2);
  EXPECT_EQ(HalvingsToHold(PhotosOf(1000, 750, 9), 1, 2, sink), 0) << "a smaller photo shows nothing";
  EXPECT_THAT(sink.said, IsEmpty()) << "no page would have more: nothing to say";
}

TEST(HeldPhotos, AreHalvedUntilTheyFit) {
  Messages sink;
  // Four times what is free: twice halved they take a quarter of it, once halved all of it.
  Scene scene = PhotosOf(8000, 6000, 1);
  const double free = static_cast<double>(AvailableMemory()),
               one = static_cast<double>(PhotoCache::BytesOf(Eigen::Vector2i(8000, 6000)));
  scene = PhotosOf(8000, 6000, static_cast<int>(4 * free / one));
  EXPECT_EQ(HalvingsToHold(scene, 0, 1, sink), 2);
  EXPECT_THAT(sink.said, ElementsAre(HasSubstr("they are halved 2 times")));
  const double half = 48e6 / 4 * static_cast<double>(scene.views.size());
  EXPECT_EQ(HalvingsToHold(scene, half, 1, sink), 2) << "once for the page, once for the memory";
  EXPECT_THAT(sink.said.back(), testing::EndsWith("they are halved"));
  EXPECT_EQ(HalvingsToHold(scene, 0, 4, sink), 3) << "four copies";
}

TEST(HeldPhotos, ThatNeverFitAreRefused) {
  Messages sink;
  try {
    HalvingsToHold(PhotosOf(600, 450, 1000), 0, 1e9, sink);
    FAIL() << "some thousand gigabytes";
  } catch (const MachineError& e) {
    EXPECT_THAT(e.what(), HasSubstr("GB of memory"));
    EXPECT_THAT(e.hint(), HasSubstr("fewer photos"));
  }
}

}  // namespace
}  // namespace lumi
