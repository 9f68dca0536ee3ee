// Depth maps of a scene's photos: kept on disk, gone on with after a kill, and made in parts.
#include "proxy/dense/stereo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "proxy/dense/depth_store.h"
#include "proxy/leave_out.h"
#include "scene/files/temporary_folder.h"
#include "tests/proxy/photographed_planes.h"

namespace lumi::test {
namespace {

TEST(UsualStereoWidth, FollowsFromThePhotosAlone) {
  const auto usual = [](std::size_t photos, Eigen::Vector2i size_px) {
    Scene scene;
    scene.frame = Frame::kProjective;
    scene.views.resize(photos);
    for (View& view : scene.views) view.size_px = size_px;
    return UsualStereoWidth(scene);
  };
  EXPECT_EQ(usual(1, {4000, 3000}), 640);
  EXPECT_EQ(usual(120, {4000, 3000}), 640);
  EXPECT_EQ(usual(121, {4000, 3000}), 480);
  EXPECT_EQ(usual(213, {3000, 4000}), 480);
  EXPECT_EQ(usual(214, {3000, 4000}), 320);
  EXPECT_EQ(usual(1000, {640, 480}), 320);
  EXPECT_EQ(usual(1001, {640, 480}), 0);
  EXPECT_EQ(usual(160, {1920, 1080}), 640) << "wide photos have fewer pixels";
  EXPECT_EQ(usual(1500, {160, 120}), 640) << "no larger than the photos";
}

TEST(DepthStore, KeepsWhatWasFinishedAndForgetsOtherScenes) {
  const TemporaryFolder folder;
  DepthMap map(4, 3);
  map.w[5] = 0.25F;
  {
    DepthStore store(folder / "maps", "one", 0);
    for (const char* name : {"a", "b", "c", "d"}) store.Store(name, 1, map);
    EXPECT_EQ(store.Load("a", 1)->w, map.w) << "from the disk: two are held";
  }
  {
    DepthStore again(folder / "maps", "one", 1 << 20);
    EXPECT_TRUE(again.Has("a", 1));
    EXPECT_FALSE(again.Has("a", 0));
    again.Remove("a", 1);
    EXPECT_FALSE(again.Has("a", 1));
  }
  DepthStore other(folder / "maps", "two", 1 << 20);
  EXPECT_FALSE(other.Has("b", 1));
}

TEST(DepthStore, APhotoIsAtTheFirstRoundThatIsMissingAfterOneThatAllHave) {
  const auto next = [](const std::vector<std::vector<int>>& rounds_of_photos) {
    const TemporaryFolder folder;
    StoredMaps maps{.rounds = 4};
    for (std::size_t i = 0; i < rounds_of_photos.size(); ++i)
      maps.photos.push_back(std::string(1, static_cast<char>('a' + i)));
    DepthStore store(folder / "maps", "key", 1 << 20, maps);
    for (std::size_t i = 0; i < rounds_of_photos.size(); ++i)
      for (const int round : rounds_of_photos[i]) store.Store(maps.photos[i], round, DepthMap(2, 2));
    return store.NextRounds();
  };
  using testing::ElementsAre;
  EXPECT_THAT(next({{}, {}}), ElementsAre(0, 0));
  EXPECT_THAT(next({{3}, {3}}), ElementsAre(4, 4)) << "finished";
  EXPECT_THAT(next({{1}, {1, 2}}), ElementsAre(2, 3)) << "killed in round 2";
  EXPECT_THAT(next({{1, 2}, {2}}), ElementsAre(3, 3)) << "killed while round 1 was removed";
  EXPECT_THAT(next({{0, 1, 2}, {0}, {}}), ElementsAre(3, 1, 0)) << "parts, one of which has not begun";
  EXPECT_THAT(next({{0, 2, 3}, {0, 1, 2}}), ElementsAre(4, 3)) << "a hole that nobody reads any more";
  EXPECT_THAT(next({{0, 2}, {0}}), ElementsAre(1, 1)) << "a hole is filled";
  // What others were made from is gone: from the beginning.
  EXPECT_THAT(next({{3}, {}}), ElementsAre(0, 0));
  EXPECT_THAT(next({{3}, {2}}), ElementsAre(0, 0));
}

TEST(DepthStore, OnlyPartsOfTheSameKeyFillOneFolder) {
  const TemporaryFolder folder;
  const std::string key = "width 96\ncamera a 1 2\n", file = DepthStore::FileName("a", 0);
  const StoredMaps maps{{"a", "b"}, 1};
  const auto open = [&](const std::string& with, std::optional<Part> part) {
    return DepthStore(folder / "maps", with, 1 << 20, maps, part);
  };
  const auto refused = [&](const std::string& with, std::optional<Part> part) {
    try {
      open(with, part);
    } catch (const PartsDiffer& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::vector<std::optional<Part>> whole_or_part{std::nullopt, Part{1, 2}};
  open(key, Part{0, 2}).Store("a", 0, DepthMap(2, 2));
  for (const std::optional<Part>& part : whole_or_part) {
    EXPECT_THAT(refused("width 64\ncamera a 1 2\n", part), testing::HasSubstr("there width 96, here width 64"));
    EXPECT_THAT(refused("width 96\ncamera a 1 3\n", part), testing::HasSubstr("other cameras"));
    EXPECT_EQ(refused(key, part), "");
    EXPECT_TRUE(std::filesystem::exists(folder / "maps" / file));
  }
  // Maps that are complete are one run's: other options begin anew, whole or in parts.
  for (const std::optional<Part>& part : whole_or_part) {
    DepthStore whole = open(key, std::nullopt);
    for (const char* photo : {"a", "b"}) whole.Store(photo, 0, DepthMap(2, 2));
    whole.ForgetParts();
    for (const auto& entry : std::filesystem::directory_iterator(folder / "maps"))
      EXPECT_FALSE(entry.is_directory()) << entry.path() << " is a part's";
    open(key, Part{1, 2});  // a late one, which has nothing to make
    EXPECT_EQ(refused("width 64\n", part), "");
    EXPECT_FALSE(whole.Has("a", 0));
    open("width 64\n", part).ForgetParts();
  }
}

StereoOptions SmallStereo() {
  StereoOptions options;
  options.width = 96;
  options.iterations = 3;
  return options;
}

TEST(Stereo, FindsDepthFromFilesAndKeepsIt) {
  const TemporaryFolder folder;
  const std::vector<StereoCamera> cameras = RowOfCameras(4);
  const Scene scene = SceneOf({Wall()}, cameras, folder / "images");
  const std::filesystem::path maps = folder / "maps";
  StereoMaps whole(scene, SmallStereo(), maps, SilentProgress());
  EXPECT_EQ(whole.summary().photos, 4u);
  EXPECT_EQ(whole.summary().reused, 0u);
  const Photographed photo = Photograph({Wall()}, whole.CameraOf(1));
  EXPECT_GT(ShareWithin(*whole.Load(1), photo, 0.01), 0.9);

  // All is there: nothing to do. Where a map went missing that others were made from, all begins anew.
  StereoMaps again(scene, SmallStereo(), maps, SilentProgress());
  EXPECT_EQ(again.summary().reused, 16u) << "four rounds of four photos";
  std::filesystem::remove(maps / "photo12.png.3.planes");
  StereoMaps anew(scene, SmallStereo(), maps, SilentProgress());
  EXPECT_EQ(anew.summary().reused, 0u);
  for (std::size_t v = 0; v < 4; ++v) EXPECT_EQ(anew.Load(v)->w, whole.Load(v)->w);
}

TEST(Stereo, GoesOnWhereARunWasKilled) {
  const TemporaryFolder folder;
  const Scene scene = SceneOf({Wall()}, RowOfCameras(4), folder / "images");
  const std::filesystem::path maps = folder / "maps";
  StereoMaps whole(scene, SmallStereo(), maps, SilentProgress());
  // As a kill in the last round leaves it: the round before is there of all photos, the last one of two.
  const std::filesystem::path killed = folder / "killed";
  StereoMaps(scene, SmallStereo(), killed, SilentProgress(), {}, 3);
  for (const char* done : {"photo10.png.3.planes", "photo11.png.3.planes"})
    std::filesystem::copy_file(maps / done, killed / done);
  StereoMaps resumed(scene, SmallStereo(), killed, SilentProgress());
  EXPECT_EQ(resumed.summary().reused, 14u);
  for (std::size_t v = 0; v < 4; ++v) EXPECT_EQ(resumed.Load(v)->w, whole.Load(v)->w);
}

TEST(Stereo, PartsInAnyOrderMakeTheMapsOfTheWhole) {
  const TemporaryFolder folder;
  const Scene scene = SceneOf({Wall()}, RowOfCameras(9), folder / "images");
  StereoOptions options = SmallStereo();
  options.views = 2;
  StereoMaps whole(scene, options, folder / "whole", SilentProgress());
  const std::filesystem::path parts = folder / "parts";
  const auto run = [&](int i) { return StereoMaps(scene, options, parts, Part{i, 3}, SilentProgress()).summary(); };
  // One after the other, and the first one first waits for the others.
  const StereoSummary first = run(2);
  EXPECT_EQ(first.photos, 3u);
  EXPECT_EQ(first.reused, 0u);
  EXPECT_GT(first.unfinished, 0u);
  EXPECT_THAT(first.waits_for, testing::ElementsAre(1));
  run(0);
  int runs = 1;
  for (std::size_t unfinished = 1; unfinished > 0; ++runs) {
    unfinished = 0;
    for (const int i : {1, 2, 0}) unfinished += run(i).unfinished;
    ASSERT_LE(runs, StereoMaps::kRounds);
  }
  EXPECT_EQ(run(1).reused, 12u) << "a part that is finished has nothing to do";
  StereoMaps joined(scene, options, parts, SilentProgress());
  EXPECT_EQ(joined.summary().reused, 36u) << "four rounds of nine photos";
  for (std::size_t v = 0; v < 9; ++v) {
    EXPECT_EQ(joined.Load(v)->w, whole.Load(v)->w) << v;
    EXPECT_EQ(joined.Load(v)->cost, whole.Load(v)->cost) << v;
  }
  EXPECT_FALSE(std::filesystem::exists(parts / "photo10.png.0.planes")) << "what is in between is removed";
  EXPECT_EQ(run(1).reused, 12u) << "also after it was joined";
}

TEST(Stereo, PartsAtTheSameTimeMakeTheMapsOfTheWholeAndAKilledOneIsJoined) {
  const TemporaryFolder folder;
  const Scene scene = SceneOf({Wall()}, RowOfCameras(6), folder / "images");
  StereoMaps whole(scene, SmallStereo(), folder / "whole", SilentProgress());
  const std::filesystem::path parts = folder / "parts";
  for (int runs = 0; runs < 2; ++runs) {
    std::vector<std::jthread> at_once;
    for (int i = 0; i < 3; ++i)
      at_once.emplace_back([&, i] { StereoMaps(scene, SmallStereo(), parts, Part{i, 3}, SilentProgress()); });
  }
  // As a part's kill leaves it: some of its last maps are not there.
  for (const char* name : {"photo12.png.3.planes", "photo13.png.3.planes", "photo13.png.2.planes"})
    std::filesystem::remove(parts / name);
  StereoMaps joined(scene, SmallStereo(), parts, SilentProgress());
  EXPECT_LT(joined.summary().reused, 24u);
  for (std::size_t v = 0; v < 6; ++v) EXPECT_EQ(joined.Load(v)->w, whole.Load(v)->w) << v;
}

TEST(Stereo, TakesGivenMapsAndAddsTheOthers) {
  const TemporaryFolder folder;
  const Scene scene = SceneOf({Wall()}, RowOfCameras(6), folder / "images");
  const Scene less = WithPhotos(scene, {true, true, false, true, true, true});
  const std::filesystem::path few = folder / "few", all = folder / "all";
  StereoMaps evaluated(less, SmallStereo(), few, SilentProgress());
  EXPECT_THAT(evaluated.summary().without, testing::ElementsAre("photo12.png"));
  StereoMaps whole(scene, SmallStereo(), all, SilentProgress(), few);
  EXPECT_EQ(whole.summary().given, 5u);
  EXPECT_EQ(whole.summary().photos, 6u);
  EXPECT_EQ(whole.summary().reused, 0u);
  for (const std::size_t v : {0, 1, 3, 4, 5}) EXPECT_EQ(whole.Load(v)->w, evaluated.Load(v)->w);
  const Photographed photo = Photograph({Wall()}, whole.CameraOf(2));
  EXPECT_GT(ShareWithin(*whole.Load(2), photo, 0.01), 0.9);

  // A second run has nothing to do. One without what was given, or with other options, begins anew.
  StereoMaps again(scene, SmallStereo(), all, SilentProgress(), few);
  EXPECT_EQ(again.summary().reused, 4u) << "four rounds of one photo";
  EXPECT_EQ(again.Load(2)->w, whole.Load(2)->w);
  StereoOptions other = SmallStereo();
  other.seed = 7;
  StereoMaps anew(scene, other, all, SilentProgress(), few);
  EXPECT_EQ(anew.summary().given, 0u);
  EXPECT_EQ(anew.summary().reused, 0u);
}

TEST(Stereo, PhotosThatShareNothingHaveNoMap) {
  const TemporaryFolder folder;
  std::vector<StereoCamera> cameras = RowOfCameras(3);
  cameras.push_back(CameraAt({0, 0, 0}, {0, 0, -4}));
  const Scene scene = SceneOf({Wall()}, cameras, folder / "images");
  StereoMaps maps(scene, SmallStereo(), folder / "maps", SilentProgress());
  EXPECT_THAT(maps.summary().without, testing::ElementsAre("photo13.png"));
  EXPECT_EQ(maps.Load(3), nullptr);
}

}  // namespace
}  // namespace lumi::test
