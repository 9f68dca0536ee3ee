#include "scene/files/video_clock.h"

#include <cmath>
#include <numeric>
#include <random>

#include "files_test_util.h"

namespace lumi::test {
namespace {

VideoTimes Timed(std::vector<double> time_s, double fps) {
  VideoTimes times;
  times.time_s = std::move(time_s);
  times.fps = times.average_fps = fps;
  for (std::size_t i = 1; i < times.time_s.size(); ++i)
    times.largest_gap_s = std::max(times.largest_gap_s, times.time_s[i] - times.time_s[i - 1]);
  return times;
}

std::vector<double> EvenTimes(int frames, double fps) {
  std::vector<double> t;
  for (int i = 0; i < frames; ++i) t.push_back(i / fps);
  return t;
}

// 20 to 40 ms from frame to frame.
std::vector<double> Unsteady(int frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(0.02, 0.04);
  std::vector<double> t{0};
  while (static_cast<int>(t.size()) < frames) t.push_back(t.back() + step(random));
  return t;
}

TEST(VideoClock, TakesTheRoundingOfAContainerBackAndNothingElse) {
  for (const double fps : {23.976023976, 25.0, 29.97002997, 30.0, 60.0, 120.0, 240.0}) {
    std::vector<double> rounded = EvenTimes(500, fps);
    for (double& t : rounded) t = std::round(1000 * t) / 1000;
    VideoTimes times = Timed(rounded, fps);
    times.average_fps = 499 / rounded.back();
    const VideoClock stated(times);
    ASSERT_TRUE(stated.constant()) << fps;
    EXPECT_EQ(stated.fps(), fps);
    for (int i = 0; i < 500; ++i)
      EXPECT_NEAR(stated.TimeOf(rounded[static_cast<std::size_t>(i)]), i / fps, 1e-12) << fps << " " << i;
    // A rate that the file does not state: the straight line through 500 times that are rounded to a millisecond.
    const VideoClock found(Timed(rounded, 0));
    ASSERT_TRUE(found.constant()) << fps;
    EXPECT_NEAR(found.fps() / fps, 1, 1e-4) << fps;
  }
}

TEST(VideoClock, ADroppedFrameIsAGapOnTheGrid) {
  std::vector<double> times = EvenTimes(300, 30);
  times.erase(times.begin() + 137);
  const VideoClock clock(Timed(times, 30));
  EXPECT_TRUE(clock.on_grid());
  EXPECT_FALSE(clock.constant());
  EXPECT_EQ(clock.fps(), 30);
  EXPECT_EQ(clock.TimeOf(times[137]), 138 / 30.0);
}

TEST(VideoClock, OfAVariableRateLeavesTimesAsTheyAre) {
  const std::vector<double> times = Unsteady(300, 1);
  const VideoClock clock(Timed(times, 299 / times.back()));
  EXPECT_FALSE(clock.on_grid());
  EXPECT_NEAR(clock.fps(), 1 / 0.03, 2);  // the median of 299 steps
  for (const double t : times) EXPECT_EQ(clock.TimeOf(t), t);
}

TEST(VideoClock, OfNoFrameOrOneHasTheStatedRate) {
  EXPECT_EQ(VideoClock(Timed({}, 25)).fps(), 25);
  EXPECT_EQ(VideoClock(Timed({0}, 24)).fps(), 24);
  EXPECT_EQ(VideoClock(Timed({0}, 0)).fps(), 30);
  EXPECT_TRUE(VideoClock(Timed({0}, 0)).constant());
}

TEST(VideoClock, JitterThatGoesToNothingGivesTheGrid) {
  const std::vector<double> jitter = Unsteady(300, 2);
  for (double share = 1; share >= 1e-15; share /= 10) {
    std::vector<double> times = EvenTimes(300, 30);
    for (std::size_t i = 0; i < times.size(); ++i)
      times[i] += share * (jitter[i] - 0.03 * static_cast<double>(i)) * 0.1;
    const VideoClock clock(Timed(times, 30));
    EXPECT_NEAR(clock.fps(), 30, std::max(1e-9, 3 * share)) << share;
    for (std::size_t i = 0; i < times.size(); ++i)
      EXPECT_NEAR(clock.TimeOf(times[i] - times[0]), static_cast<double>(i) / 30, 0.05 * share + 1e-12) << share;
  }
}

TEST(VideoTimes, ThatAreMissingOrFallAreRefusedByName) {
  VideoTimes times = Timed(EvenTimes(300, 30), 30);
  RequireUsable(times, "clip.mp4");
  times.times_made_up = 6;  // the end of many files
  RequireUsable(times, "clip.mp4");
  times.times_made_up = 299;  // a stream without any times
  RequireUsable(times, "clip.mp4");
  times.times_made_up = 150;
  EXPECT_REFUSED(ExitCode::kDataRefused, "150 of 300 frames", RequireUsable(times, "clip.mp4"));
  try {
    RequireUsable(times, "clip.mp4");
  } catch (const Error& e) {
    EXPECT_EQ(e.file(), "clip.mp4");
    EXPECT_NE(e.hint().find("ffmpeg"), std::string::npos);
  }
  // A clock that jumped: as a pause of ten seconds it is one, as a day it is none.
  times = Timed(EvenTimes(300, 30), 30);
  for (std::size_t i = 150; i < 300; ++i) times.time_s[i] += 10;
  RequireUsable(times, "clip.mp4");
  for (std::size_t i = 150; i < 300; ++i) times.time_s[i] += 86400;
  times.largest_gap_s = 86410;
  EXPECT_REFUSED(ExitCode::kDataRefused, "86410 s between two", RequireUsable(times, "clip.mp4"));
}

TEST(ShownAtRate, IsTheFrameNearestInTime) {
  EXPECT_EQ(ShownAtRate(EvenTimes(5, 30), 5 / 30.0, 30), (std::vector<int>{1, 1, 1, 1, 1}));
  EXPECT_EQ(ShownAtRate(EvenTimes(4, 30), 4 / 30.0, 60), (std::vector<int>{2, 2, 2, 2}));
  EXPECT_EQ(ShownAtRate({0, 0.1, 0.3, 0.4}, 0.5, 10), (std::vector<int>{1, 2, 1, 1}));  // over the gap the one before
  EXPECT_EQ(ShownAtRate({0}, 1 / 30.0, 30), (std::vector<int>{1}));
  const std::vector<double> unsteady = Unsteady(200, 3);
  const std::vector<int> shown = ShownAtRate(unsteady, FilmLength_s(unsteady, 30), 25);
  EXPECT_EQ(std::accumulate(shown.begin(), shown.end(), 0), std::lround(25 * FilmLength_s(unsteady, 30)));
  EXPECT_NEAR(FilmLength_s(EvenTimes(30, 30), 30), 1, 1e-12);
  EXPECT_TRUE(AreEven(EvenTimes(300, 30), 30));
  EXPECT_FALSE(AreEven(unsteady, 30));
}

}  // namespace
}  // namespace lumi::test
