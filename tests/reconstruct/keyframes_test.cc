#include "reconstruct/keyframes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumi {
namespace {

std::vector<FrameStatistics> EvenWalk(int n, double step) {
  std::vector<FrameStatistics> frames(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    frames[static_cast<std::size_t>(i)].sharpness = 100;
    frames[static_cast<std::size_t>(i)].step = i == 0 ? 0 : step;
  }
  return frames;
}

TEST(Keyframes, AreSpacedByMovementAndCoverAllOfIt) {
  KeyframeOptions options;
  const auto keyframes = SelectKeyframes(EvenWalk(201, 0.006), options);  // 1.2 widths in all: one every ten frames
  ASSERT_GE(keyframes.size(), 20u);
  ASSERT_LE(keyframes.size(), 22u);
  EXPECT_LE(keyframes.front(), 4);
  EXPECT_GE(keyframes.back(), 196);
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    EXPECT_GT(keyframes[i], keyframes[i - 1]);
    EXPECT_LE(keyframes[i] - keyframes[i - 1], 18);
  }
}

TEST(Keyframes, TheSharpestNeighbourIsTaken) {
  auto frames = EvenWalk(101, 0.006);
  for (auto& frame : frames) frame.sharpness = 10;
  for (std::size_t i = 2; i < frames.size(); i += 10) frames[i].sharpness = 200;  // two frames after each regular place
  const auto keyframes = SelectKeyframes(frames, KeyframeOptions{});
  int sharp = 0;
  for (const int k : keyframes) sharp += frames[static_cast<std::size_t>(k)].sharpness > 100;
  EXPECT_GE(sharp, static_cast<int>(keyframes.size()) - 1);
}

TEST(Keyframes, AStandingCameraGivesOneFrameOnly) {
  EXPECT_EQ(SelectKeyframes(EvenWalk(300, 0.0), KeyframeOptions{}).size(), 1u);
  EXPECT_EQ(SelectKeyframes(EvenWalk(300, 1e-4), KeyframeOptions{}).size(), 1u);  // the tracker's noise is no movement
  EXPECT_TRUE(SelectKeyframes({}, KeyframeOptions{}).empty());
}

TEST(Keyframes, AWantedNumberAndALimitAreKept) {
  KeyframeOptions options;
  options.count = 12;
  EXPECT_EQ(SelectKeyframes(EvenWalk(500, 0.01), options).size(), 12u);
  options.count = 0;
  options.max_count = options.usual_count = 40;
  const auto limited = SelectKeyframes(EvenWalk(2000, 0.02), options);
  EXPECT_LE(limited.size(), 41u);
  EXPECT_GE(limited.size(), 38u);
}

// 240 photos of a long walk would share nothing: there are more, as far apart as neighbours still can be.
TEST(Keyframes, OfALongVideoStandNoFartherApartThanNeighboursCan) {
  const auto count = [](int frames) { return static_cast<int>(SelectKeyframes(EvenWalk(frames, 0.02), {}).size()); };
  EXPECT_NEAR(count(2001), 240, 2);    // 40 widths: 0.17 apart
  EXPECT_NEAR(count(5001), 501, 2);    // 100 widths: 0.2 apart
  EXPECT_NEAR(count(20001), 1000, 2);  // 400 widths: 0.4 apart, since there are enough
}

TEST(Keyframes, ALeapIsNotSkippedOver) {
  auto frames = EvenWalk(21, 0.0);
  frames[10].step = 0.5;  // the camera jumps
  const auto keyframes = SelectKeyframes(frames, KeyframeOptions{});
  ASSERT_GE(keyframes.size(), 2u);
  EXPECT_LT(keyframes.front(), 10);
  EXPECT_GE(keyframes.back(), 10);
}

}  // namespace
}  // namespace lumi
