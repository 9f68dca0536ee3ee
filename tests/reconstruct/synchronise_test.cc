#include "reconstruct/synchronise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/program/error.h"

namespace lumi {
namespace {

// What several cameras make of one motion: each its own gain and share of the motion, and noise.
std::vector<MotionSignal> Watch(const std::vector<double>& motion, const std::vector<int>& starts, int frames,
                                double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> n(0, noise);
  std::vector<MotionSignal> signals;
  for (std::size_t c = 0; c < starts.size(); ++c) {
    MotionSignal s;
    s.fps = 30;
    for (int i = 0; i < frames; ++i)
      s.change.push_back((0.6 + 0.2 * static_cast<double>(c)) * motion[static_cast<std::size_t>(starts[c] + i)] -
                         static_cast<double>(c) + n(random));
    signals.push_back(s);
  }
  return signals;
}

std::vector<double> RandomMotion(int n) {
  std::mt19937 random(3);
  std::normal_distribution<double> step(0, 0.4);
  std::vector<double> motion{0};
  for (int i = 1; i < n; ++i) motion.push_back(0.8 * motion.back() + step(random));
  return motion;
}

TEST(Synchronise, FindsWhenEachVideoStarts) {
  const std::vector<int> starts{12, 0, 37, 5};
  const Synchronisation s =
      Synchronise(Watch(RandomMotion(300), starts, 150, 0.2), {"a.mp4", "b.mp4", "c.mp4", "d.mp4"});
  EXPECT_EQ(s.offsets, starts);
  EXPECT_FALSE(s.repeats);
  EXPECT_GT(s.least_correlation, 0.6);
}

TEST(Synchronise, OfAMotionThatRepeatsTheNearestOffsetIsTakenAndSaid) {
  std::vector<double> motion;
  for (int i = 0; i < 400; ++i) motion.push_back(std::sin(2 * M_PI * i / 25.0) + 0.5 * std::cos(4 * M_PI * i / 25.0));
  const Synchronisation s = Synchronise(Watch(motion, {0, 32}, 200, 0.01), {"a.mp4", "b.mp4"});
  EXPECT_EQ(s.offsets, (std::vector<int>{0, 7}));
  EXPECT_TRUE(s.repeats);
}

TEST(Synchronise, AVideoOfSomethingElseIsNamed) {
  std::vector<MotionSignal> signals = Watch(RandomMotion(300), {0, 20}, 200, 0.1);
  std::mt19937 random(77);
  std::normal_distribution<double> n(0, 1);
  signals.emplace_back();
  for (int i = 0; i < 200; ++i) signals.back().change.push_back(n(random));
  try {
    Synchronise(signals, {"a.mp4", "b.mp4", "holiday.mp4"});
    FAIL() << "not refused";
  } catch (const DataError& e) {
    EXPECT_NE(std::string(e.what()).find("holiday.mp4"), std::string::npos) << e.what();
  }
}

TEST(Synchronise, StillScenesAndShortVideosSayNothing) {
  MotionSignal still{std::vector<double>(100, -3.9), 30}, one{{0}, 30};
  EXPECT_EQ(FindLag(still, still).correlation, 0);
  EXPECT_EQ(FindLag(one, one).correlation, 0);
  EXPECT_EQ(FindLag({}, {}).correlation, 0);
  EXPECT_THROW(Synchronise({still, still}, {"a.mp4", "b.mp4"}), DataError);
}

TEST(CommonClock, TakesWhatIsOnItAsItIsAndTheRestByStraightLines) {
  const std::vector<double> values{0, 3, 5, 4, 8};
  EXPECT_EQ(OnCommonClock({0, 1, 2, 3, 4}, values), values);
  EXPECT_EQ(OnCommonClock({0, 1, 2, 4}, {0, 3, 5, 4}), (std::vector<double>{0, 3, 5, 4.5, 4}));
  const std::vector<double> between = OnCommonClock({0, 1.2, 2.4, 3.6}, {0, 3, 5, 4}),
                            expected{0, 3, 3 + 2 * 0.8 / 1.2, 4.5, 4};
  ASSERT_EQ(between.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(between[i], expected[i], 1e-12) << i;
  EXPECT_EQ(OnCommonClock({0}, {7}), (std::vector<double>{7}));
  EXPECT_TRUE(OnCommonClock({}, {}).empty());
}

TEST(Synchronise, AVariableRateFindsItsPlaceOnTheCommonClock) {
  const std::vector<double> motion = RandomMotion(400);
  std::vector<MotionSignal> signals = Watch(motion, {12, 0}, 250, 0.1);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> step(2.0 / 3, 4.0 / 3);
  std::vector<double> frames{0}, change{0};
  while (frames.back() < 250) {
    frames.push_back(frames.back() + step(random));
    const double at = 37 + frames.back(), below = std::floor(at), share = at - below;
    const auto i = static_cast<std::size_t>(below);
    change.push_back((1 - share) * motion[i] + share * motion[i + 1]);
  }
  signals.push_back({OnCommonClock(frames, change), 30});
  EXPECT_EQ(Synchronise(signals, {"a.mp4", "b.mp4", "phone.mp4"}).offsets, (std::vector<int>{12, 0, 37}));
}

}  // namespace
}  // namespace lumi
