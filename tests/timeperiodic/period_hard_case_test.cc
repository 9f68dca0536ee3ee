// Videos whose period is hard to tell, or that have none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/program/error.h"
#include "tests/timeperiodic/painted_video.h"
#include "timeperiodic/align.h"
#include "timeperiodic/harmonic_fit.h"
#include "timeperiodic/period.h"
#include "timeperiodic/signals.h"

namespace lumi {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kAccuracy = 5e-4;

PeriodEstimate PeriodOf(const FrameStack& stack) { return EstimatePeriod(FixedSignals(stack, {}), {}, {}); }
PeriodEstimate PeriodOf(const PaintedVideo& video) { return PeriodOf(video.Stack()); }

const PeriodCandidate* Candidate(const PeriodEstimate& e, const std::string& relation) {
  for (const PeriodCandidate& c : e.candidates)
    if (c.relation == relation) return &c;
  return nullptr;
}

TEST(PeriodHardCase, BelowTwoFramesIsAliasedAndSaysSo) {
  for (const double short_of_two : {1e-2, 1e-5, 1e-9}) {
    try {
      RequireResolved(2 - short_of_two);
      FAIL() << short_of_two;
    } catch (const DataError& e) {
      EXPECT_THAT(e.what(), HasSubstr("aliased"));
    }
  }
  RequireResolved(2);
  EXPECT_THROW(CountedPeriod(0, 15, 10), DataError);
  // Frames alone cannot tell: 1.613 frames look like 2.631, which is what is reported, with the warning and the alias.
  PaintedVideo video;
  video.period = 1.613;
  video.other_blade = 0;
  const PeriodEstimate e = PeriodOf(video);
  EXPECT_NEAR(e.period_frames, 1 / (1 - 1 / 1.613), 1e-3);
  EXPECT_THAT(e.aliases_frames, Contains(::testing::DoubleNear(1.613, 1e-3)));
  EXPECT_THAT(e.warnings, Contains(HasSubstr("aliased")));
}

TEST(PeriodHardCase, TwoLikeBladesHaveHalfThePeriod) {
  PaintedVideo video;
  video.other_blade = 1;
  const PeriodEstimate e = PeriodOf(video);
  EXPECT_NEAR(e.period_frames, 0.5 * video.period, kAccuracy * video.period);
  ASSERT_NE(Candidate(e, "double"), nullptr);  // the whole turn was considered
  EXPECT_NEAR(Candidate(e, "double")->explained, e.explained, 0.02);
}

TEST(PeriodHardCase, NearlyLikeBladesHaveTheWholePeriodAndAreCalledAmbiguous) {
  // Approached step by step: as long as noise lets the blades be told apart.
  for (const double difference : {0.3, 0.1, 0.04}) {
    PaintedVideo video;
    video.other_blade = 1 - difference;
    const PeriodEstimate e = PeriodOf(video);
    EXPECT_NEAR(e.period_frames, video.period, kAccuracy * video.period) << difference;
    EXPECT_TRUE(e.ambiguous) << difference;
    ASSERT_NE(Candidate(e, "half"), nullptr);
    EXPECT_GT(Candidate(e, "half")->explained, 0.8 * e.explained);
    EXPECT_THAT(e.warnings, Contains(HasSubstr("half"))) << difference;
  }
}

TEST(PeriodHardCase, BlackAndNearlyBlackFramesAreLeftOut) {
  for (const double light : {0.0, 1e-3, 0.02, 0.2}) {
    PaintedVideo video;
    video.gain = [&](int frame) { return frame < 4 || frame == 100 ? light : 1.0; };  // a fade-in, and a shutter
    const Signals signals = FixedSignals(video.Stack(), {});
    EXPECT_EQ(signals.values.rows(), 295) << light;
    EXPECT_TRUE(signals.values.allFinite()) << light;
    EXPECT_NEAR(EstimatePeriod(signals, {}, {}).period_frames, video.period, kAccuracy * video.period) << light;
  }
}

TEST(PeriodHardCase, DriftOfOnePercentIsReportedAndTheMeanPeriodKept) {
  for (const double drift : {0.01, -0.01, 0.003}) {
    PaintedVideo video;
    video.frames = 450;
    const double T = video.period, n = video.frames - 1;
    // T(t) = T (1 + drift (t / n - 1/2)): turns = integral of 1 / T(t).
    video.turns = [=](double t) { return n / (drift * T) * std::log1p(drift * (t / n - 0.5) / 1); };
    const PeriodEstimate e = PeriodOf(video);
    EXPECT_TRUE(e.drifts) << drift;
    EXPECT_NEAR(e.drift_percent, 100 * drift, 0.05 + 4 * e.drift_sigma_percent) << drift;
    EXPECT_NEAR(e.period_frames, T, 2 * kAccuracy * T) << drift;
    EXPECT_THAT(e.warnings, Contains(HasSubstr("drifts")));
  }
}

TEST(PeriodHardCase, AStillSceneHasNone) {
  PaintedVideo video;
  video.moves = false;
  for (const bool drifts : {false, true}) {
    if (drifts) video.gain = [](int i) { return 1 + 0.2 * std::sin(i / 9.0); };
    try {
      PeriodOf(video);
      FAIL() << drifts;
    } catch (const DataError& e) {
      EXPECT_THAT(e.what(), HasSubstr("no period"));
    }
  }
}

TEST(PeriodHardCase, WhatMovesWithoutRepeatingHasNone) {
  std::mt19937 random(7);
  std::normal_distribution<double> step(0, 0.07);
  std::vector<double> turns{0};
  for (int i = 1; i < 300; ++i) turns.push_back(turns.back() + step(random));
  PaintedVideo video;
  video.turns = [&](double t) { return turns[static_cast<std::size_t>(t)]; };
  EXPECT_THROW(PeriodOf(video), DataError);
}

TEST(PeriodHardCase, OnePeriodAndAHalfIsEnoughToAboutAFrame) {
  for (const double period : {22.0, 21.4}) {
    PaintedVideo video;
    video.period = period;
    video.frames = 34;
    const PeriodEstimate e = PeriodOf(video);
    EXPECT_NEAR(e.period_frames, period, 0.5) << period;
    EXPECT_TRUE(e.few_cycles);
    EXPECT_GE(e.sigma_frames, 0.1);
    EXPECT_THAT(e.warnings, Contains(HasSubstr("periods were filmed")));
  }
  // One period alone repeats nothing.
  PaintedVideo video;
  video.other_blade = 0;
  video.period = 33;
  video.frames = 34;
  try {
    const PeriodEstimate e = PeriodOf(video);
    FAIL() << e.period_frames << " explains " << e.explained;
  } catch (const DataError&) {
  }
}

// A swing's second harmonic, beyond half the frame rate, is also one of a period of about two frames, which has many
// more cycles to be validated on.
TEST(PeriodHardCase, FewSwingsAreNotTakenForAPeriodThatTheyFoldTo) {
  int found = 0;
  constexpr int kVideos = 10;
  for (int k = 0; k < kVideos; ++k) {
    PaintedVideo video;
    video.seed = static_cast<unsigned>(k + 1);
    video.period = 41.3 + 1.7 * k;
    video.frames = static_cast<int>((1.6 + 0.07 * k) * video.period) + 1;
    video.noise = 2 + 0.5 * k;
    video.other_blade = 0;
    video.turns = [&](double t) { return 0.3 + 0.12 * std::sin(2 * std::numbers::pi * (0.1 * k + t / video.period)); };
    const PeriodEstimate e = PeriodOf(video);
    found += std::abs(e.period_frames - video.period) < 1;
    EXPECT_GT(e.period_frames, 0.4 * video.period) << k;
  }
  EXPECT_GE(found, kVideos - 1);
}

// Frames whose times are uneven disagree about the period: its error says so. Over many such videos the error holds.
TEST(PeriodHardCase, FramesThatDisagreeWidenTheErrorOfAFewCycles) {
  int videos = 0, within = 0;
  double widest = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> uneven(0, 0.7);  // frames
    std::vector<double> late;
    for (int i = 0; i < 34; ++i) late.push_back(uneven(random));
    PaintedVideo video;
    video.frames = 34;
    video.period = 20.5 + 0.2 * seed;
    video.other_blade = 0;
    video.turns = [&](double t) { return (t + late[static_cast<std::size_t>(t)]) / video.period; };
    const PeriodEstimate e = PeriodOf(video);
    if (!e.few_cycles) continue;
    ++videos;
    within += std::abs(e.period_frames - video.period) <= 2 * e.sigma_frames;
    widest = std::max(widest, e.sigma_frames);
  }
  EXPECT_GE(videos, 10);
  EXPECT_GE(within, videos - 1);
  EXPECT_GT(widest, 0.3);  // even times have 0.2
}

TEST(PeriodHardCase, DroppedAndDoubledFramesAreFound) {
  PaintedVideo video;
  video.frames = 400;
  video.period = 23.61;
  const auto all = video.Frames();
  std::vector<Image8> frames;
  for (int i = 0; i < 400; ++i) {
    if (i == 120 || i == 121) continue;  // dropped
    frames.push_back(all[static_cast<std::size_t>(i)]);
    if (i == 300) frames.push_back(all[300]);  // doubled
  }
  const FrameStack stack = StackOf(frames, 30);
  EXPECT_THAT(stack.repeated, ::testing::ElementsAre(299));
  const PeriodEstimate e = PeriodOf(stack);
  EXPECT_NEAR(e.period_frames, video.period, kAccuracy * video.period);
  ASSERT_EQ(e.slips.size(), 2u);
  EXPECT_EQ(e.slips[0].frames, 2);
  EXPECT_NEAR(e.slips[0].frame, 120, 6);
  EXPECT_EQ(e.slips[1].frames, -1);
  EXPECT_NEAR(e.slips[1].frame, 299, 6);
}

TEST(PeriodHardCase, ACameraWavedWithThePeriodIsSaid) {
  PaintedVideo video;
  video.width = 128, video.height = 96;
  video.period = 31.4;
  video.camera = [&](double t) {
    return Eigen::Vector2d(5 * std::sin(6.283185307179586 * t / 31.4), 1 * std::cos(6.283185307179586 * t / 31.4));
  };
  const FrameStack stack = video.Stack();
  const Alignment alignment = AlignFrames(stack, {}, SilentProgress());
  try {
    const PeriodEstimate e = EstimatePeriod(MovingSignals(stack, alignment, {}), alignment.camera, {});
    EXPECT_GT(e.camera_share, 0.8) << e.period_frames << " explains " << e.explained;
    EXPECT_THAT(e.warnings, Contains(HasSubstr("camera's own movement")));
  } catch (const DataError& e) {  // the camera's place explains all there is
    EXPECT_THAT(e.what(), HasSubstr("period"));
  }
}

TEST(PeriodHardCase, TooLittleStillBackgroundIsRefusedByName) {
  PaintedVideo video;
  video.texture = 0;
  video.camera = [](double t) { return Eigen::Vector2d(4 * std::sin(t / 9.1), 0); };
  video.frames = 60;
  try {
    AlignFrames(video.Stack(), {}, SilentProgress());
    FAIL();
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("stands still"));
  }
}

TEST(PeriodHardCase, TimesFarFromZeroGiveTheSamePeriod) {
  PaintedVideo video;
  Signals signals = FixedSignals(video.Stack(), {});
  const double near = EstimatePeriod(signals, {}, {}).period_frames;
  // 1e9 seconds are 3e10 frames: doubles hold 4e-6 of a frame there.
  signals.time.array() += 3e10;
  EXPECT_NEAR(EstimatePeriod(signals, {}, {}).period_frames, near, 1e-5);
}

TEST(PeriodHardCase, ACommensurateFrameRateStillHasOnePeriod) {
  // Frames fall on the same 15 phases in every turn; approached from beside.
  for (const double off : {1e-2, 1e-4, 0.0}) {
    PaintedVideo video;
    video.period = 15 + off;
    EXPECT_NEAR(PeriodOf(video).period_frames, video.period, kAccuracy * video.period) << off;
  }
}

// ---- signals without a film's noise, next to their degenerate neighbours, step by step

Signals SignalsOf(int frames, const std::function<double(double)>& value) {
  Signals signals;
  signals.time = Eigen::VectorXd::LinSpaced(frames, 0, frames - 1);
  signals.values.resize(frames, 1);
  for (int i = 0; i < frames; ++i) signals.values(i, 0) = value(i), signals.frame.push_back(i);
  signals.values.array() -= signals.values.mean();
  signals.nuisance = Eigen::MatrixXd::Constant(frames, 1, 1 / std::sqrt(static_cast<double>(frames)));
  signals.modulation.resize(frames, 0);
  signals.video_frames = frames;
  signals.moving_share = 0.1;
  signals.moving_deviation = 10;
  return signals;
}

// Frames at times of their own, in frames: steps of 2/3 to 4/3 (20 to 40 ms), `share` of that.
std::vector<double> Jittered(int frames, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(2.0 / 3, 4.0 / 3);
  std::vector<double> times{0};
  for (int i = 1; i < frames; ++i) times.push_back(times.back() + 1 + share * (step(random) - 1));
  return times;
}

TEST(PeriodHardCase, AVariableRateTellsThePeriodOnItsOwnTimes) {
  for (const double period : {15.37, 6.283}) {
    PaintedVideo video;
    video.period = period;
    const std::vector<double> times = Jittered(video.frames, 1, 11);
    video.turns = [&](double i) { return times[static_cast<std::size_t>(i)] / period; };
    const PeriodEstimate e = PeriodOf(StackOf(video.Frames(), 30, times));
    EXPECT_NEAR(e.period_frames, period, kAccuracy * period);
    EXPECT_LT(e.sigma_frames, kAccuracy * period);
    EXPECT_TRUE(e.slips.empty()) << period;
    EXPECT_FALSE(e.drifts) << period;
  }
}

TEST(PeriodHardCase, AFrameThatWasDroppedAndSaysSoIsNoSlip) {
  PaintedVideo video;
  auto frames = video.Frames();
  std::vector<double> times;
  for (int i = 0; i < video.frames; ++i)
    if (i != 137) times.push_back(i);
  frames.erase(frames.begin() + 137);
  const PeriodEstimate e = PeriodOf(StackOf(frames, 30, times));
  EXPECT_NEAR(e.period_frames, video.period, kAccuracy * video.period);
  EXPECT_TRUE(e.slips.empty());
}

TEST(PeriodHardCase, OnePeriodAndAHalfOfAVariableRateIsEnoughToAboutAFrame) {
  PaintedVideo video;
  video.period = 22;
  video.frames = 34;
  const std::vector<double> times = Jittered(video.frames, 1, 5);
  video.turns = [&](double i) { return times[static_cast<std::size_t>(i)] / 22; };
  const PeriodEstimate e = PeriodOf(StackOf(video.Frames(), 30, times));
  EXPECT_TRUE(e.few_cycles);
  EXPECT_NEAR(e.period_frames, 22, 0.7);
}

TEST(PeriodHardCase, TimesWhoseJitterGoesToNothingGiveThePeriodOfEvenTimes) {
  constexpr double kTurns = 2 * std::numbers::pi, kPeriod = 15.37;
  constexpr int kFrames = 300;
  const auto value = [](double t) {
    return std::cos(kTurns * t / kPeriod + 0.3) + 0.4 * std::cos(3 * kTurns * t / kPeriod) + 0.05 * std::sin(17.3 * t);
  };
  const PeriodEstimate even = EstimatePeriod(SignalsOf(kFrames, value), {}, {});
  for (double share = 1; share >= 1e-15; share /= 10) {
    const std::vector<double> times = Jittered(kFrames, share, 7);
    Signals signals = SignalsOf(kFrames, [&](double i) { return value(times[static_cast<std::size_t>(i)]); });
    signals.time = Eigen::Map<const Eigen::VectorXd>(times.data(), kFrames);
    const PeriodEstimate e = EstimatePeriod(signals, {}, {});
    // Its own error where jitter is large; then what the search stops at (1e-5 cycles over the video).
    EXPECT_NEAR(e.period_frames, even.period_frames, 2e-2 * share + 1e-5 * kPeriod) << share;
    EXPECT_NEAR(e.explained, even.explained, 0.01 * std::min(1.0, 10 * share) + 1e-6) << share;
    EXPECT_EQ(e.harmonics, even.harmonics) << share;
  }
}

TEST(PeriodHardCase, BladesThatBecomeAlikeHaveTheWholePeriodOrHalfOfItAndNoOther) {
  constexpr double kTurns = 2 * std::numbers::pi, kPeriod = 15.37;
  bool half = false;
  for (double difference = 1e-1; difference >= 1e-15; difference /= 10) {
    const Signals signals = SignalsOf(300, [&](double t) {
      return std::cos(2 * kTurns * t / kPeriod + 0.3) + difference * std::cos(kTurns * t / kPeriod);
    });
    const PeriodEstimate e = EstimatePeriod(signals, {}, {});
    const bool is_half = std::abs(e.period_frames - 0.5 * kPeriod) < kAccuracy * kPeriod;
    EXPECT_TRUE(is_half || std::abs(e.period_frames - kPeriod) < kAccuracy * kPeriod)
        << difference << ": " << e.period_frames;
    EXPECT_FALSE(half && !is_half) << difference << ": alike once, they stay alike";
    half = is_half;
    EXPECT_TRUE(std::isfinite(e.sigma_frames) && e.sigma_frames >= 0) << difference;
    EXPECT_GT(e.explained, 0.9) << difference;
    EXPECT_LE(e.explained, 1) << difference;
  }
  EXPECT_TRUE(half);
}

TEST(PeriodHardCase, APeriodThatComesDownToTwoFramesIsFoundOrRefused) {
  constexpr double kTurns = 2 * std::numbers::pi;
  constexpr int kFrames = 300;
  int answered = 0;
  for (double above = 1; above >= 1e-15; above /= 10) {
    const double period = 2 + above;
    RequireResolved(period);
    try {
      const PeriodEstimate e =
          EstimatePeriod(SignalsOf(kFrames, [&](double t) { return std::cos(kTurns * t / period + 0.4); }), {}, {});
      ++answered;
      // At 2 frames pictures alternate, and a film tells frequencies apart by a quarter of a cycle over all of it.
      EXPECT_NEAR(1 / e.period_frames, 1 / period, 0.25 / kFrames) << above;
      EXPECT_GE(e.period_frames, 2) << above;
      EXPECT_TRUE(std::isfinite(e.sigma_frames)) << above;
      EXPECT_FALSE(e.aliases_frames.empty()) << above;
    } catch (const DataError& e) {
      EXPECT_THAT(e.what(), HasSubstr("period")) << above;
    }
  }
  EXPECT_GE(answered, 10);
}

TEST(PeriodHardCase, AMotionThatVanishesInItsRoundingRepeatsItselfOrHasNoPeriod) {
  // Beside an offset that doubles round the motion to: down to a part in 1e15 of it.
  constexpr double kTurns = 2 * std::numbers::pi, kPeriod = 15.37;
  int answered = 0;
  for (double size = 1e-2; size >= 1e-15; size /= 10) {
    try {
      const PeriodEstimate e =
          EstimatePeriod(SignalsOf(300, [&](double t) { return 1 + size * std::cos(kTurns * t / kPeriod); }), {}, {});
      ++answered;
      EXPECT_TRUE(std::isfinite(e.sigma_frames)) << size;
      if (size > 1e-12) {
        EXPECT_NEAR(e.period_frames, kPeriod, kAccuracy * kPeriod) << size;
      }
    } catch (const DataError& e) {
      EXPECT_LT(size, 1e-12) << e.what();
    }
  }
  EXPECT_GE(answered, 10);
}

}  // namespace
}  // namespace lumi
