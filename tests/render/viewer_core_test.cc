// What the viewer does beside its window: recording, refining, loading photos.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <thread>

#include "render/viewer/photo_loader.h"
#include "render/viewer/recorder.h"
#include "render/viewer/refiner.h"
#include "render/world/visibility_maps.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "tests/render/gl_test_scene.h"
#include "tests/render/viewer_state.h"

namespace lumi {
namespace {

using test::StateAt;
using testing::HasSubstr;

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("lumi_recorder_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }
  // Everything in the folder, hidden files too.
  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& e : std::filesystem::directory_iterator(folder_)) names.insert(e.path().filename());
    return names;
  }
  static void Feed(Recorder& recorder, int frames) {
    for (int i = 0; i < frames; ++i) {
      while (recorder.Full() && !recorder.Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      recorder.Add(Image8(64, 48, 3, static_cast<std::uint8_t>(20 * i)));
    }
  }
  static void Await(const Recorder& recorder) {
    for (int i = 0; i < 20000 && !recorder.Ended(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::filesystem::path folder_;
};

TEST_F(Recording, TheLastPictureLastsUntilThereAreAsManyFramesAsAreWanted) {
  // What a busy machine drew in half a second: three pictures.
  Recorder recorder(folder_ / "clip.mp4", 30);
  Feed(recorder, 3);
  recorder.Finish(15);
  recorder.Finish(90);  // it is finished: nothing is added any more
  Await(recorder);
  ASSERT_EQ(recorder.state(), Recorder::State::kWritten) << recorder.problem();
  EXPECT_EQ(recorder.encoded(), 15);
  VideoReader video(folder_ / "clip.mp4");
  int frames = 0, last = -1;
  while (const auto frame = video.Next()) {
    ++frames;
    last = frame->rgb.At(32, 24, 0);
  }
  EXPECT_EQ(frames, 15);
  EXPECT_NEAR(last, 40, 6);  // the third's grey, after the codec
}

TEST_F(Recording, AFileIsThereWhenAllOfItIsAndNoneIsWrittenOver) {
  std::ofstream(folder_ / "clip.mp4") << "a user's own";
  Recorder recorder(folder_ / "clip.mp4", 25);
  Feed(recorder, 10);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "clip_001.mp4"));
  recorder.Finish();
  Await(recorder);
  ASSERT_EQ(recorder.state(), Recorder::State::kWritten) << recorder.problem();
  EXPECT_EQ(recorder.file(), folder_ / "clip_001.mp4");
  EXPECT_EQ(std::filesystem::file_size(folder_ / "clip.mp4"), 12U);
  EXPECT_EQ(Names(), (std::set<std::string>{"clip.mp4", "clip_001.mp4"}));
  VideoReader video(folder_ / "clip_001.mp4");
  int frames = 0;
  while (video.Next()) ++frames;
  EXPECT_EQ(frames, 10);
  EXPECT_NEAR(video.fps(), 25, 1e-6);
}

TEST_F(Recording, CancelledOrForgottenItLeavesNothing) {
  {
    Recorder recorder(folder_ / "clip.mp4", 25);
    Feed(recorder, 6);
    recorder.Cancel();
    Await(recorder);
    EXPECT_EQ(recorder.state(), Recorder::State::kCancelled);
  }
  {
    Recorder recorder(folder_ / "clip.mp4", 25);
    Feed(recorder, 6);
  }
  EXPECT_TRUE(Names().empty());
}

TEST_F(Recording, SaysWhatWentWrong) {
  Recorder none(folder_ / "none.mp4", 25);
  none.Finish();
  Await(none);
  EXPECT_EQ(none.state(), Recorder::State::kFailed);
  EXPECT_THAT(none.problem(), HasSubstr("no frame"));
  Recorder sizes(folder_ / "sizes.mp4", 25);
  sizes.Add(Image8(64, 48, 3));
  sizes.Add(Image8(32, 48, 3));
  Await(sizes);
  EXPECT_EQ(sizes.state(), Recorder::State::kFailed);
  sizes.Add(Image8(64, 48, 3));  // nobody listens any more: no harm
  EXPECT_TRUE(Names().empty());
  EXPECT_THROW(Recorder(folder_ / "clip.avi", 25), UsageError);
}

constexpr double kPatience_s = 60;  // for a picture of a second on an idle machine

class Refining : public testing::Test {
 protected:
  Refining() {
    test::Photograph(world_);
    const Sources sources = MakeSources(world_.scene);
    tracer_ = std::make_shared<const ProxyTracer>(world_.proxy, world_.scene.normalized_from_world);
    visibility_ = std::make_shared<const VisibilityMaps>(MakeVisibilityMaps(sources, *tracer_));
  }
  Refinement Wanted(int width, int height) const {
    Refinement r;
    r.request.view = MakeWindowView(StateAt({2.6, 0.4, 1.9}, {0, 0, 0.3}), width, height);
    r.request.settings = OptimalSettings({});
    r.sources = MakeSources(world_.scene);
    r.proxy = tracer_;
    r.visibility = visibility_;
    r.photos = std::make_shared<const std::vector<Photo>>(world_.photos);
    return r;
  }
  Refinement Slow() const {
    Refinement r = Wanted(2400, 1800);
    r.request.settings.accuracy = 1e-6;
    return r;
  }
  ImageF ByTheRenderer(const Refinement& r) const {
    return MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(r.request);
  }
  static std::optional<RefinedPicture> Finished(Refiner& refiner) {
    for (const auto start = std::chrono::steady_clock::now(); SecondsSince(start) < kPatience_s;) {
      if (auto picture = refiner.Take()) return picture;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return std::nullopt;
  }
  static bool Drawing(const Refiner& refiner) {
    for (const auto start = std::chrono::steady_clock::now(); SecondsSince(start) < kPatience_s;) {
      if (refiner.fraction() > 0) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  test::World world_ = test::MakeWorld(7, 160);
  std::shared_ptr<const ProxyTracer> tracer_;
  std::shared_ptr<const VisibilityMaps> visibility_;
};

TEST_F(Refining, GivesWhatTheCpuRendererDraws) {
  Refiner refiner;
  Refinement wanted = Wanted(200, 150);
  for (const Show show : {Show::kColor, Show::kFalseColor}) {
    wanted.request.show = show;
    refiner.Start(wanted);
    EXPECT_TRUE(refiner.busy());
    const auto picture = Finished(refiner);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->problem, "");
    EXPECT_GT(picture->seconds, 0);
    EXPECT_EQ(picture->image.data, ByTheRenderer(wanted).data);  // the same tiles
    EXPECT_FALSE(refiner.busy());
    EXPECT_FALSE(refiner.Take());
  }
}

TEST_F(Refining, APhotoThatIsMissingTakesNoPart) {
  auto photos = world_.photos;
  photos[3].levels.clear();
  Refinement wanted = Wanted(160, 120);
  wanted.photos = std::make_shared<const std::vector<Photo>>(photos);
  Refiner refiner;
  refiner.Start(wanted);
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  wanted.request.use.assign(photos.size(), true);
  wanted.request.use[3] = false;
  EXPECT_EQ(picture->image.data, ByTheRenderer(wanted).data);
}

// The window's thread hands its wish over and does not wait for the tile that is being drawn: of the time until the
// next picture is there it spends little. The least of ten: on a busy machine any one may have to wait for a core.
TEST_F(Refining, WhatIsWantedNextTakesThePlaceOfWhatIsBeingDrawn) {
  Refiner refiner;
  double share = 1;
  for (int i = 0; i < 10; ++i) {
    refiner.Start(Slow());
    ASSERT_TRUE(Drawing(refiner));
    const auto start = std::chrono::steady_clock::now();
    refiner.Start(Wanted(64, 48));
    const double handed_over_s = SecondsSince(start);
    const auto picture = Finished(refiner);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->image.width, 64);
    share = std::min(share, handed_over_s / SecondsSince(start));
  }
  EXPECT_LT(share, 0.3);
}

TEST_F(Refining, ACancelledPictureNeverComesAndTheCoresAreFreeAtTheNextTile) {
  auto refiner = std::make_unique<Refiner>();
  refiner->Start(Slow());
  ASSERT_TRUE(Drawing(*refiner));
  refiner->Cancel();
  EXPECT_FALSE(refiner->busy());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(refiner->Take());
  // An end in the middle of a picture waits for its tiles only: 4300 of them make a picture.
  const auto begun = std::chrono::steady_clock::now();
  refiner->Start(Slow());
  ASSERT_TRUE(Drawing(*refiner));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const double fraction = refiner->fraction(), whole_s = SecondsSince(begun) / fraction;
  ASSERT_LT(fraction, 0.9);
  const auto start = std::chrono::steady_clock::now();
  refiner.reset();
  EXPECT_LT(SecondsSince(start), 0.25 * whole_s);
}

TEST_F(Refining, AnyOrderOfCallsEndsWithThePictureThatWasWantedLast) {
  Refiner refiner;
  std::mt19937_64 random(11);
  for (int i = 0; i < 200; ++i) {
    switch (random() % 4) {
      case 0: refiner.Cancel(); break;
      case 1: refiner.Take(); break;
      default: refiner.Start(Wanted(64 + static_cast<int>(random() % 64), 40)); break;
    }
    if (random() % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
  }
  refiner.Start(Wanted(33, 17));
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.width, 33);
}

TEST_F(Refining, SaysWhatCannotBeDrawn) {
  Refinement wanted = Wanted(64, 48);
  wanted.request.view.P.setZero();
  Refiner refiner;
  refiner.Start(wanted);
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  EXPECT_THAT(picture->problem, HasSubstr("singular"));
}

TEST(OptimalSettingsTest, AreValidWhereTheSettingsAreAndKeepWhatTheOptimumReads) {
  RadianceSettings s;
  s.grid_columns = s.grid_rows = 25;
  s.r_max_rad = 0.2;
  s.field_of_view = false;
  const RadianceSettings optimal = OptimalSettings(s);
  EXPECT_EQ(Validate(optimal), "");
  EXPECT_EQ(optimal.similarity, Similarity::kFull);
  EXPECT_FALSE(optimal.Sparse());
  EXPECT_EQ(optimal.r_max_rad, 0.2);
  EXPECT_FALSE(optimal.field_of_view);
}

class Loading : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("lumi_loader_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    world_ = test::MakeWorld(9, 64);
    test::Photograph(world_);
    world_.scene.image_folder = folder_;
    for (std::size_t j = 0; j < 9; ++j) WriteImage(folder_ / world_.scene.views[j].name, world_.photos[j].levels[0]);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<PhotoLoader::Loaded> TakeAll(PhotoLoader& loader) {
    std::vector<PhotoLoader::Loaded> all;
    const auto start = std::chrono::steady_clock::now();
    while (loader.outstanding() > 0 && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
      if (auto loaded = loader.Take())
        all.push_back(std::move(*loaded));
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return all;
  }

  std::filesystem::path folder_;
  test::World world_;
};

TEST_F(Loading, GivesEveryPhotoOnce) {
  PhotoLoader loader(world_.scene, 3);
  EXPECT_EQ(loader.outstanding(), 0);
  loader.Ask(std::vector<std::int32_t>{8, 7, 6, 5, 4, 3, 2, 1, 0});
  std::set<int> seen;
  for (const auto& l : TakeAll(loader)) {
    EXPECT_TRUE(l.error.empty()) << l.error;
    EXPECT_TRUE(seen.insert(l.view.value).second);
    const auto v = static_cast<std::size_t>(l.view.value);
    EXPECT_EQ(l.photo.levels.at(0).data, world_.photos[v].levels[0].data);
    EXPECT_EQ(l.photo.levels.size(), world_.photos[v].levels.size());
  }
  EXPECT_EQ(seen.size(), 9U);
}

TEST_F(Loading, TheLastWishCounts) {
  PhotoLoader loader(world_.scene, 1);
  std::vector<int> order;
  // Some may have been begun before the second wish; on a busy machine even those that it names.
  for (int tries = 0; tries < 50; ++tries) {
    loader.Ask(std::vector<std::int32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8});
    loader.Ask(std::vector<std::int32_t>{5, 3});
    order.clear();
    for (const auto& l : TakeAll(loader)) order.push_back(l.view.value);
    if (order.size() <= 4) break;
  }
  for (int first = 0; order.size() > 2 && order.front() == first; ++first) order.erase(order.begin());
  EXPECT_EQ(order, (std::vector<int>{5, 3}));
  // What was taken can be asked for again.
  loader.Ask(std::vector<std::int32_t>{3});
  EXPECT_EQ(TakeAll(loader).size(), 1U);
}

TEST_F(Loading, NamesAPhotoThatCannotBeRead) {
  std::filesystem::remove(folder_ / world_.scene.views[4].name);
  PhotoLoader loader(world_.scene, 2);
  loader.Ask(std::vector<std::int32_t>{0, 4, 8});
  int failed = 0;
  for (const auto& l : TakeAll(loader)) {
    if (l.error.empty()) continue;
    ++failed;
    EXPECT_EQ(l.view.value, 4);
    EXPECT_TRUE(l.photo.levels.empty());
  }
  EXPECT_EQ(failed, 1);
}

TEST_F(Loading, EndsWhileItLoads) {
  for (int i = 0; i < 5; ++i) {  // destroyed at once: no hang, no crash
    PhotoLoader loader(world_.scene, 2);
    loader.Ask(std::vector<std::int32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8});
  }
  SUCCEED();
}

}  // namespace
}  // namespace lumi
