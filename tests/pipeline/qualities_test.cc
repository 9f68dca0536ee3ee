#include "pipeline/qualities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lumi {
namespace {

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
  EXPECT_THAT(NamesFor({}, true), ElementsAre("draft", "standard", "full", "careful"));
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
  EXPECT_FALSE(WithQuality(options, PipelineQualities().back(), false).depth_seconds_a_photo);
}

TEST(Qualities, WhatTheUserSetStays) {
  PipelineOptions options;
  options.reconstruct_arguments = {"--quality", "medium"};
  EXPECT_THAT(WithQuality(options, PipelineQualities().back(), false).reconstruct_arguments,
              ElementsAre("--quality", "medium", "--mapper", "careful"));
  options.reconstruct_arguments = {"--quality=medium", "--backend", "factorization"};
  EXPECT_THAT(WithQuality(options, PipelineQualities().back(), false).reconstruct_arguments,
              ElementsAre("--quality=medium", "--backend", "factorization"));
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
