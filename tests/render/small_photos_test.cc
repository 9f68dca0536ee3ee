// Small copies of all photos, and photos that are read no finer than they are seen.
#include "render/photos/small_photos.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "capture_files.h"
#include "render/photos/photo_cache.h"
#include "render/radiance/sparse/sparse_proxy.h"
#include "render/world/photos_wanted.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

class SmallPhotos : public testing::Test {
 protected:
  static constexpr int kPhotos = 5;
  void SetUp() override {
    capture_ = test::MakeCapture(kPhotos, 300);
    test::WriteAsScene(capture_, folder_.path());
    capture_.scene.folder = folder_.path();
    one_ = PhotoCache::BytesOf(capture_.scene) / kPhotos;
  }
  fs::path Kept() const { return capture_.scene.folder / "small-photos" / "2"; }
  std::vector<Photo> Read() { return ReadSmallPhotos(capture_.scene, 2, SilentProgress()); }

  TemporaryFolder folder_;
  test::Capture capture_;
  std::size_t one_ = 0;
};

TEST_F(SmallPhotos, AreLevelsOfThePhotosAndAreKept) {
  for (int time = 0; time < 2; ++time) {
    const std::vector<Photo> small = Read();
    ASSERT_EQ(small.size(), static_cast<std::size_t>(kPhotos));
    for (std::size_t v = 0; v < small.size(); ++v) {
      EXPECT_EQ(small[v].level0_shift, 2);
      ASSERT_EQ(small[v].levels.size(), capture_.photos[v].levels.size() - 2);
      for (std::size_t l = 0; l < small[v].levels.size(); ++l)
        EXPECT_EQ(small[v].levels[l].data, capture_.photos[v].levels[l + 2].data);
    }
    EXPECT_TRUE(fs::exists(Kept()));
    // The second time they come from the file: the photos themselves are not read.
    for (const View& view : capture_.scene.views) {
      const fs::path photo = capture_.scene.ImagePath(view);
      const auto time_of = fs::last_write_time(photo);
      const auto bytes = fs::file_size(photo);
      std::ofstream(photo, std::ios::binary) << std::string(bytes, 'x');
      fs::last_write_time(photo, time_of);
    }
  }
}

TEST_F(SmallPhotos, OfOtherPhotosAreMadeAnew) {
  Read();
  const fs::path changed = capture_.scene.ImagePath(capture_.scene.views[3]);
  const Eigen::Vector2i size(capture_.photos[3].levels[0].width, capture_.photos[3].levels[0].height);
  WriteImage(changed, Image8(size.x(), size.y(), 3));
  fs::last_write_time(changed, fs::last_write_time(changed) + std::chrono::seconds(5));
  const std::vector<Photo> small = Read();
  for (const std::uint8_t value : small[3].levels[0].data) ASSERT_EQ(value, 0);
  EXPECT_EQ(small[4].levels[0].data, capture_.photos[4].levels[2].data);
}

// Halved after they were corrected, as the photos' own levels are; kept ones are those of one correction.
TEST_F(SmallPhotos, AreCorrectedAsThePhotosAre) {
  Read();
  for (View& view : capture_.scene.views) {
    PhotoCorrection correction;
    correction.channel = {1, 0.8, 0.6};
    correction.falloff = {-0.2, -0.1};
    view.correction = std::make_shared<const PhotoCorrection>(correction);
  }
  for (int time = 0; time < 2; ++time) {
    const std::vector<Photo> small = Read();
    for (std::int32_t v = 0; v < kPhotos; ++v)
      EXPECT_EQ(small[static_cast<std::size_t>(v)].levels[0].data, LoadPhoto(capture_.scene, {v}, {}).levels[2].data);
  }
  EXPECT_NE(Read()[1].levels[0].data, capture_.photos[1].levels[2].data);
}

TEST_F(SmallPhotos, ACutOffOrForeignFileIsMadeAnew) {
  Read();
  const auto whole = fs::file_size(Kept());
  fs::resize_file(Kept(), whole - 7);
  EXPECT_EQ(Read()[4].levels[0].data, capture_.photos[4].levels[2].data);
  EXPECT_EQ(fs::file_size(Kept()), whole);
  std::ofstream(Kept()) << "something else";
  EXPECT_EQ(Read()[4].levels[0].data, capture_.photos[4].levels[2].data);
  EXPECT_EQ(fs::file_size(Kept()), whole);
}

TEST_F(SmallPhotos, WhereNothingCanBeKeptTheyAreMadeAllTheSame) {
  std::ofstream(capture_.scene.folder / "small-photos") << "a file where the folder should be";
  EXPECT_EQ(Read()[4].levels[0].data, capture_.photos[4].levels[2].data);
  fs::remove(capture_.scene.folder / "lumigraph.json");
  EXPECT_FALSE(KeepsSmallPhotos(capture_.scene));
}

TEST_F(SmallPhotos, APhotoThatIsGoneIsNamed) {
  const fs::path gone = capture_.scene.ImagePath(capture_.scene.views[3]);
  fs::remove(gone);
  try {
    Read();
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.file().filename(), gone.filename());
  }
  EXPECT_FALSE(fs::exists(Kept()));
}

TEST_F(SmallPhotos, AreAtMostSoLong) {
  EXPECT_EQ(CopyHalvings(capture_.scene), 2);
  capture_.scene.cameras.back().width_px = 4 * kCopySide + 4;
  EXPECT_EQ(CopyHalvings(capture_.scene), 3);
}

TEST_F(SmallPhotos, StandInForPhotosThatAreNotThere) {
  PhotoCache cache(capture_.scene, 3 * one_);
  cache.SetSmall(Read());
  cache.Bring(std::vector<WantedPhoto>{{0, 0}, {1, 5}, {2, 2}});
  EXPECT_EQ(cache.counts().read, 1) << "far away, the copies serve";
  EXPECT_EQ(cache.photos()[0].level0_shift, 0);
  for (std::size_t v = 1; v < kPhotos; ++v) EXPECT_EQ(cache.photos()[v].level0_shift, 2) << v;
  // What goes leaves its copy.
  cache.Bring(std::vector<WantedPhoto>{{3, 0}});
  cache.Bring(std::vector<WantedPhoto>{{4, 0}});
  EXPECT_EQ(cache.photos()[0].level0_shift, 2);
  EXPECT_EQ(cache.photos()[0].levels[0].data, capture_.photos[0].levels[2].data);
  EXPECT_EQ(cache.counts().most_halved, 0);
  EXPECT_LE(cache.counts().most, 3 * one_);
}

TEST_F(SmallPhotos, PhotosAreReadNoFinerThanTheyAreSeenAndStayWhileThereIsRoom) {
  PhotoCache cache(capture_.scene, 4 * one_);
  cache.Bring(std::vector<WantedPhoto>{{0, 0}, {1, 1}, {2, 2}});
  EXPECT_EQ(cache.photos()[1].level0_shift, 1);
  EXPECT_EQ(cache.photos()[2].level0_shift, 1) << "finer by one, for a camera that comes near";
  cache.Bring(std::vector<WantedPhoto>{{0, 2}, {1, 1}, {2, 2}});
  EXPECT_EQ(cache.counts().read, 3);
  EXPECT_EQ(cache.photos()[0].level0_shift, 0) << "there is room";
  // Those that are finest for what they show make room.
  cache.Bring(std::vector<WantedPhoto>{{0, 0}, {1, 4}, {2, 1}, {3, 0}, {4, 0}});
  EXPECT_EQ(cache.photos()[0].level0_shift, 0);
  EXPECT_GT(cache.photos()[1].level0_shift, 0);
  EXPECT_EQ(cache.photos()[4].level0_shift, 0);
  EXPECT_EQ(cache.counts().most_halved, 0);
}

// From afar a photo has many pixels for one of the view's, and pictures do not depend on how many are in memory.
TEST_F(SmallPhotos, WhatIsSeenFromAfarMayBeHalved) {
  RadianceSettings settings;
  settings.grid_columns = settings.grid_rows = 9;
  settings.prefilter = true;
  const Sources sources = MakeSources(capture_.scene);
  const ProxyTracer tracer(capture_.proxy, sources.normalized_from_world);
  const SparseProxy proxy(capture_.proxy, sources.normalized_from_world);
  const auto wanted = [&](int side) {
    RenderView view = MakeRenderView(capture_.scene, capture_.scene.views[2]);
    const double scale = static_cast<double>(side) / view.size_px.x();
    view.P.topRows<2>() *= scale;
    view.size_px = (view.size_px.cast<double>() * scale).cast<int>();
    const ViewSetup setup = MakeViewSetup(sources, view, settings);
    CandidatePlan plan;
    PlanCandidates(setup, proxy, tracer, nullptr, ParallelFor, plan);
    return PhotosWanted(plan, setup, tracer);
  };
  EXPECT_EQ(wanted(300).front().halvings, 0);
  for (const WantedPhoto& w : wanted(48)) EXPECT_GE(w.halvings, 1);
  PhotoCache cache(capture_.scene, kPhotos * one_);
  const auto all = MakeCpuRenderer(WorldOf(capture_.scene, capture_.proxy), capture_.photos);
  const auto some = MakeCpuRenderer(
      WorldOf(capture_.scene, capture_.proxy), cache.photos(),
      {[&](std::span<const WantedPhoto> photos) { return cache.Bring(photos); }, CopyHalvings(capture_.scene)});
  RenderRequest request;
  request.settings = settings;
  request.view = MakeRenderView(capture_.scene, capture_.scene.views[2]);
  request.view.P.topRows<2>() /= 6;
  request.view.size_px /= 6;
  EXPECT_EQ(some->Render(request).data, all->Render(request).data);
  EXPECT_LT(cache.counts().most, kPhotos * one_ / 2);
}

// A run that goes on, a part of a path, more memory: what else is held does not show.
TEST_F(SmallPhotos, APictureDoesNotDependOnWhatElseIsHeld) {
  RadianceSettings candidates;
  candidates.grid_columns = candidates.grid_rows = 9;
  RadianceSettings cells = candidates;
  cells.correlation = Correlation::kFallingLeaves;
  RadianceSettings aliased = candidates;
  aliased.prefilter = !candidates.prefilter;
  RenderRequest afar, near;
  near.view = MakeRenderView(capture_.scene, capture_.scene.views[2]);
  afar.view = near.view;
  afar.view.P.topRows<2>() /= 5;
  afar.view.size_px /= 5;
  for (const RadianceSettings& settings : {candidates, cells, aliased}) {
    afar.settings = near.settings = settings;
    std::vector<ImageF> pictures;
    for (const bool with_copies : {false, true})
      for (const bool near_first : {false, true}) {
        PhotoCache cache(capture_.scene, 2 * kPhotos * one_);
        if (with_copies) cache.SetSmall(Read());
        const auto renderer = MakeCpuRenderer(
            WorldOf(capture_.scene, capture_.proxy), cache.photos(),
            {[&](std::span<const WantedPhoto> photos) { return cache.Bring(photos); }, CopyHalvings(capture_.scene)});
        if (near_first) renderer->Render(near);
        pictures.push_back(renderer->Render(afar));
        EXPECT_EQ(renderer->Statistics().halved, 0);
      }
    for (const ImageF& picture : pictures) EXPECT_EQ(picture.data, pictures[0].data);
  }
}

}  // namespace
}  // namespace lumi
