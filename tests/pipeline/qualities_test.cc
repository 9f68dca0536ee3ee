#include "pipeline/qualities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> NamesFor(const PipelineOptions& options, bool has_cameras) {
  std::vector<std::string> names;
  for (const PipelineQuality& q : QualitiesFor(options, has_cameras)) names.push_back(q.name);
  return names;
}

TEST(Qualities, PhotosHaveFive) {
  EXPECT_THAT(NamesFor({}, false), ElementsAre("draft", "quick", "standard", "full", "careful"));
}

TEST(Qualities, WhereCamerasAreGivenOnlyTheProxyDiffers) {
  EXPECT_THAT(NamesFor({}, true), ElementsAre("draft", "standard", "full"));
  EXPECT_THAT(WithQuality({}, PipelineQualities().back(), true).reconstruct_arguments, IsEmpty());
}

TEST(Qualities, AProxyThatIsGivenIsNotTurned) {
  PipelineOptions options;
  options.proxy = "plane";
  EXPECT_THAT(NamesFor(options, false), ElementsAre("draft", "quick", "careful"));
  EXPECT_THAT(NamesFor(options, true), ElementsAre("draft"));
  options.proxy = "auto";
  options.proxy_minutes = 3;
  EXPECT_THAT(NamesFor(options, false), ElementsAre("draft", "quick", "careful"));
  EXPECT_FALSE(WithQuality(options, PipelineQualities().back(), false).depth_width_px);
  options.proxy_minutes.reset();
  options.depth_width_px = 256;
  EXPECT_THAT(NamesFor(options, false), ElementsAre("draft", "quick", "careful"));
  EXPECT_EQ(WithQuality(options, PipelineQualities().front(), false).depth_width_px, 256);
}

TEST(Qualities, DepthMapsAreExpectedToTakeAsLongAsTheirPixels) {
  const double usual = ExpectedDepthSeconds({}, 20, 2);
  EXPECT_DOUBLE_EQ(usual, ExpectedDepthSeconds(640, 20, 2)) << "of few photos";
  EXPECT_DOUBLE_EQ(ExpectedDepthSeconds(320, 20, 2), usual / 4);
  EXPECT_DOUBLE_EQ(ExpectedDepthSeconds({}, 20, 4), usual / 2);
  EXPECT_DOUBLE_EQ(ExpectedDepthSeconds({}, 300, 2), 20 * 60) << "of many photos they are smaller";
  EXPECT_DOUBLE_EQ(ExpectedDepthSeconds({}, 1000, 2), ExpectedDepthSeconds(320, 1000, 2));
  EXPECT_EQ(ExpectedDepthSeconds({}, 1001, 2), 0);
  EXPECT_EQ(ExpectedDepthSeconds(0, 20, 2), 0);
}

TEST(Qualities, TheirDepthMapsAreNoneOrHaveAWidthOrTheUsualOne) {
  const auto with = [](std::size_t quality) { return WithQuality({}, PipelineQualities()[quality], false); };
  EXPECT_EQ(with(0).proxy_minutes, 0.0);
  EXPECT_FALSE(with(0).depth_width_px);
  EXPECT_EQ(with(2).depth_width_px, 320);
  EXPECT_FALSE(with(2).proxy_minutes);
  EXPECT_FALSE(with(3).depth_width_px || with(3).proxy_minutes) << "as a run without a quality";
  EXPECT_EQ(with(4).depth_width_px, 640);
  EXPECT_EQ(InWords(PipelineQualities()[2], {}, false), "depth maps 320 px wide");
  EXPECT_EQ(InWords(PipelineQualities()[3], {}, false), "as by default");
}

TEST(Qualities, WhatTheUserSetStays) {
  PipelineOptions options;
  options.reconstruct_arguments = {"--quality", "medium"};
  EXPECT_THAT(WithQuality(options, PipelineQualities().back(), false).reconstruct_arguments,
              ElementsAre("--quality", "medium", "--mapper", "careful"));
  options.reconstruct_arguments = {"--quality=medium", "--backend", "factorization"};
  EXPECT_THAT(WithQuality(options, PipelineQualities().back(), false).reconstruct_arguments,
              ElementsAre("--quality=medium", "--backend", "factorization"));
  options.reconstruct_arguments = {"--backend", "colmap"};
  EXPECT_THAT(WithQuality(options, PipelineQualities().back(), false).reconstruct_arguments,
              ElementsAre("--backend", "colmap", "--quality", "high", "--mapper", "careful"));
}

TEST(Qualities, SayWhatOfThemCounts) {
  const PipelineQuality &draft = PipelineQualities().front(), &quick = PipelineQualities()[1];
  EXPECT_EQ(InWords(draft, {}, false), "few features in small photos, no depth maps");
  EXPECT_EQ(InWords(draft, {}, true), "no depth maps");
  PipelineOptions hull;
  hull.proxy = "hull";
  EXPECT_EQ(InWords(draft, hull, false), "few features in small photos");
  EXPECT_EQ(InWords(quick, hull, false), "as by default");
}

TEST(Qualities, CamerasAreGivenByTheInputOrByAnOption) {
  const TemporaryFolder folder;
  const auto given = [&](const fs::path& input, std::vector<std::string> arguments) {
    PipelineOptions options;
    options.input = input;
    options.reconstruct_arguments = std::move(arguments);
    return CamerasAreGiven(options);
  };
  const fs::path photos = folder / "photos", beside = folder / "beside", scene = folder / "scene";
  for (const char* file :
       {"a.jpg", "B.JPEG", "sub/c.png", "raw.NEF", "raw.jpg", ".hidden.jpg", ".thumbnails/d.jpg", "notes.txt"})
    WriteTextAtomically(photos / file, "x");
  WriteTextAtomically(beside / "transforms.json", "{}");
  WriteTextAtomically(scene / "lumigraph.json", "{}");
  EXPECT_FALSE(given(photos, {}));
  EXPECT_FALSE(given(photos, {"--poses", "none"}));
  EXPECT_TRUE(given(photos, {"--poses", "p.txt"}));
  EXPECT_TRUE(given(photos, {"--poses=p.txt"}));
  EXPECT_TRUE(given(photos, {"--rig", "grid"}));
  EXPECT_TRUE(given(beside, {}));
  EXPECT_TRUE(given(beside / "transforms.json", {}));
  EXPECT_FALSE(given(beside, {"--poses", "none"}));
  EXPECT_TRUE(given(scene, {}));
  EXPECT_EQ(CountPhotos(photos), 4);
  EXPECT_EQ(CountPhotos(photos / "a.jpg"), 0);
}

TEST(Qualities, MoreMinutesNeverChooseLess) {
  const auto rank = [](const PipelineQuality& q) { return &q - PipelineQualities().data(); };
  for (const int photos : {1, 10, 100, 1000, 5000})
    for (const int threads : {1, 2, 16}) {
      std::ptrdiff_t before = 0;
      for (double minutes = 0.01; minutes < 1e6; minutes *= 1.5) {
        const PipelineQuality& q = QualityForMinutes(minutes, photos, threads);
        EXPECT_GE(rank(q), before);
        before = rank(q);
        if (&q != PipelineQualities().data()) {
          EXPECT_LE(ExpectedCameraSeconds(q, photos, threads), 0.4 * 60 * minutes);
        }
      }
      EXPECT_EQ(before, 4) << photos;  // two years are enough for anything
    }
  EXPECT_EQ(QualityForMinutes(1e-3, 1000, 2).name, "draft");
  EXPECT_EQ(QualityForMinutes(10, 0, 2).name, "full");  // a video, or cameras that are given
}

TEST(Qualities, TwiceTheCoresTakeHalfTheTime) {
  for (const PipelineQuality& q : PipelineQualities())
    EXPECT_DOUBLE_EQ(ExpectedCameraSeconds(q, 100, 4), 0.5 * ExpectedCameraSeconds(q, 100, 2));
}

}  // namespace
}  // namespace lumi
