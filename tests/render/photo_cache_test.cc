// Photos that do not fit into memory: which are there, and that pictures do not depend on it.
#include "render/photos/photo_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "capture_files.h"
#include "render/world/renderer.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

class PhotosOnDisk : public testing::Test {
 protected:
  static constexpr int kPhotos = 9;
  void SetUp() override {
    capture_ = test::MakeCapture(kPhotos, 64);
    test::WriteAsScene(capture_, folder_.path());
    one_ = PhotoCache::BytesOf(capture_.scene) / kPhotos;
  }
  static std::vector<int> There(const PhotoCache& cache) {
    std::vector<int> there;
    for (std::size_t i = 0; i < cache.photos().size(); ++i)
      if (!cache.photos()[i].levels.empty()) there.push_back(static_cast<int>(i));
    return there;
  }
  TemporaryFolder folder_;
  test::Capture capture_;
  std::size_t one_ = 0;
};

void Bring(PhotoCache& cache, const std::vector<std::int32_t>& photos) {
  std::vector<WantedPhoto> wanted;
  for (const std::int32_t p : photos) wanted.push_back({p, 0});
  cache.Bring(wanted);
}

PhotoSupply Supply(PhotoCache& cache) {
  return {[&](std::span<const WantedPhoto> wanted) { return cache.Bring(wanted); }};
}

TEST_F(PhotosOnDisk, TheOnesUsedLongestAgoMakeRoom) {
  PhotoCache cache(capture_.scene, 4 * one_);
  EXPECT_TRUE(There(cache).empty());
  Bring(cache, {0, 1});
  Bring(cache, {2, 3});
  Bring(cache, {0});
  EXPECT_EQ(There(cache), (std::vector<int>{0, 1, 2, 3}));
  Bring(cache, {0, 4});
  EXPECT_EQ(There(cache), (std::vector<int>{0, 2, 3, 4})) << "1 was wanted longest ago";
  Bring(cache, {5, 6, 7});
  EXPECT_EQ(There(cache), (std::vector<int>{4, 5, 6, 7})) << "0 and 4 alike: the lower number goes";
  EXPECT_EQ(cache.counts().read, 8);
  EXPECT_EQ(cache.counts().most_halved, 0);
  EXPECT_LE(cache.counts().most, 4 * one_);
  // As they are in memory otherwise.
  for (const int i : There(cache)) {
    const auto v = static_cast<std::size_t>(i);
    ASSERT_EQ(cache.photos()[v].levels.size(), capture_.photos[v].levels.size());
    EXPECT_EQ(cache.photos()[v].levels[0].data, capture_.photos[v].levels[0].data);
  }
}

TEST_F(PhotosOnDisk, WhatIsTooMuchAtOnceIsHalvedFromTheLastOnAndComesBackWhole) {
  PhotoCache cache(capture_.scene, 5 * one_);
  Bring(cache, {0, 1});
  Bring(cache, {8, 7, 6, 5, 4, 3, 2, 1, 0});
  EXPECT_EQ(There(cache).size(), 9U);
  // Six at a quarter of their bytes beside three whole ones: 4.5 of 5; five would be 5.25.
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(cache.photos()[i].level0_shift, i < 6 ? 1 : 0) << i;
  EXPECT_EQ(cache.photos()[0].levels[0].data, capture_.photos[0].levels[1].data) << "one that was there";
  EXPECT_EQ(cache.photos()[5].levels[0].data, capture_.photos[5].levels[1].data) << "one that came";
  EXPECT_EQ(cache.photos()[8].levels[0].data, capture_.photos[8].levels[0].data) << "the one that matters most";
  EXPECT_LE(cache.counts().most, 5 * one_);
  EXPECT_EQ(cache.counts().most_halved, 1);
  Bring(cache, {3});
  EXPECT_EQ(cache.photos()[3].level0_shift, 0);
  EXPECT_EQ(cache.photos()[3].levels[0].width, 64);
  // All halved once, and the last ones twice.
  PhotoCache narrow(capture_.scene, 2 * one_);
  Bring(narrow, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(narrow.photos()[0].level0_shift, 1);
  EXPECT_EQ(narrow.photos()[8].level0_shift, 2);
  EXPECT_LE(narrow.counts().most, 2 * one_);
}

TEST_F(PhotosOnDisk, LessThanAPixelEachIsStillSomething) {
  PhotoCache cache(capture_.scene, 1);
  Bring(cache, {0, 4});
  ASSERT_EQ(There(cache), (std::vector<int>{0, 4}));
  EXPECT_EQ(cache.photos()[4].levels.size(), 1U);
  EXPECT_EQ(cache.photos()[4].levels[0].width, 1);
  Bring(cache, {});
  Bring(cache, {8});
  EXPECT_EQ(There(cache), (std::vector<int>{8}));
}

TEST_F(PhotosOnDisk, APhotoThatIsGoneIsNamed) {
  PhotoCache cache(capture_.scene, 4 * one_);
  std::filesystem::remove(capture_.scene.image_folder / capture_.scene.views[2].name);
  try {
    Bring(cache, {1, 2});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.file().filename(), capture_.scene.views[2].name);
  }
}

// Each way of blending reads photos in its own place.
TEST_F(PhotosOnDisk, PicturesAreTheSameAsWithAllPhotosInMemory) {
  RadianceSettings pixel;
  pixel.k = 2;
  RadianceSettings candidates = pixel;
  candidates.grid_columns = candidates.grid_rows = 9;
  RadianceSettings interpolated = candidates;
  interpolated.sampling = Sampling::kInterpolated;
  RadianceSettings cells = candidates;
  cells.correlation = Correlation::kFallingLeaves;
  RadianceSettings optimum = pixel;
  optimum.similarity = Similarity::kFull;
  optimum.correlation = Correlation::kFallingLeaves;
  RadianceSettings published = pixel;
  published.method = Algorithm::kPulli1997;
  const auto all = MakeCpuRenderer(WorldOf(capture_.scene, capture_.proxy), capture_.photos);
  for (const RadianceSettings& settings : {pixel, candidates, interpolated, cells, optimum, published}) {
    PhotoCache cache(capture_.scene, kPhotos * one_);
    const auto some = MakeCpuRenderer(WorldOf(capture_.scene, capture_.proxy), cache.photos(), Supply(cache));
    std::size_t fewest = kPhotos;
    for (const int at : {0, 8, 4}) {
      // Narrow, and nobody's own view: some photos do not see it.
      RenderRequest request;
      request.view = MakeRenderView(capture_.scene, capture_.scene.views[static_cast<std::size_t>(at)]);
      request.view.size_px = {20, 48};
      request.settings = settings;
      EXPECT_EQ(some->Render(request).data, all->Render(request).data);
      fewest = std::min(fewest, There(cache).size());
    }
    EXPECT_LT(fewest, static_cast<std::size_t>(kPhotos)) << Name(settings.sampling) << Name(settings.similarity);
  }
}

TEST_F(PhotosOnDisk, FalseColoursNeedNoPhotos) {
  PhotoCache cache(capture_.scene, one_);
  const auto renderer = MakeCpuRenderer(WorldOf(capture_.scene, capture_.proxy), cache.photos(), Supply(cache));
  RenderRequest request;
  request.view = MakeRenderView(capture_.scene, capture_.scene.views[4]);
  request.show = Show::kFalseColor;
  renderer->Render(request);
  EXPECT_TRUE(There(cache).empty());
}

}  // namespace
}  // namespace lumi
