// How well space and time are covered.
#include "timeperiodic/sampling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace lumi {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kTwoPi = 6.283185307179586;

std::vector<SampledView> Waved(int frames, double camera_period, double begin = 0) {
  std::vector<SampledView> views;
  for (int i = 0; i < frames; ++i) {
    const double t = begin + i;
    views.push_back(
        {t, Eigen::Vector3d(0.3 * std::sin(kTwoPi * i / camera_period), 0.02 * std::cos(kTwoPi * i / 61.7), 1), i});
  }
  return views;
}

TEST(Sampling, HasTheThesissNumberOfSamplesInAWindow) {
  const SamplingReport r = ReportSampling(Waved(2000, 243.3), 150.37);
  EXPECT_NEAR(r.samples_per_window, 2000 / 150.37, 1e-12);
  EXPECT_GE(r.window_least, 12);
  EXPECT_LE(r.window_most, 15);
  EXPECT_NEAR(std::abs(r.direction.x()), 1, 1e-2);
  EXPECT_NEAR(r.camera_period, 243.3, 5);
  EXPECT_EQ(r.commensurate, 0);
  EXPECT_GT(r.uniformity, 0.8);
  EXPECT_NEAR(r.half_share, 0.5, 0.05);
  EXPECT_THAT(r.warnings, IsEmpty());
}

TEST(Sampling, ACameraInStepWithTheSceneIsWarnedOf) {
  for (const auto& [p, q] : {std::pair{1, 1}, std::pair{1, 2}, std::pair{2, 1}, std::pair{3, 2}}) {
    const double period = 50.3;
    const SamplingReport r = ReportSampling(Waved(1000, period * q / p), period);
    EXPECT_EQ(r.commensurate_p, p);
    EXPECT_EQ(r.commensurate_q, q);
    EXPECT_LT(r.uniformity, 0.7);
    EXPECT_THAT(r.warnings, Contains(HasSubstr("in step")));
    EXPECT_FALSE(r.gaps.empty());
  }
}

TEST(SamplingHardCase, AllViewsInOneHalfOfThePeriod) {
  std::vector<SampledView> views;
  for (const SampledView& v : Waved(2000, 243.3))
    if (std::fmod(v.time, 150.37) < 70) views.push_back(v);
  const SamplingReport r = ReportSampling(views, 150.37);
  EXPECT_GT(r.half_share, 0.99);
  EXPECT_EQ(r.window_least, 0);
  EXPECT_THAT(r.warnings, Contains(HasSubstr("one half")));
  ASSERT_FALSE(r.gaps.empty());
  EXPECT_NEAR(r.gaps[0].phase_from, 0.47, 0.1);
  EXPECT_THAT(r.gaps[0].what_to_film, HasSubstr("film phases"));
}

TEST(SamplingHardCase, TimesAtTheWrapAreAtPhaseZero) {
  // t = k T exactly, and the doubles beside it; a phase is never 1.
  const double period = 150.37;
  std::vector<SampledView> views;
  for (int k = 0; k < 40; ++k) {
    views.push_back({k * period, {k % 7 * 0.1, 0, 0}, 3 * k});
    views.push_back({std::nextafter(k * period, 0), {k % 5 * 0.1, 0, 0}, 3 * k + 1});
    views.push_back({std::nextafter(k * period, 1e9), {k % 3 * 0.1, 0, 0}, 3 * k + 2});
  }
  const SamplingReport r = ReportSampling(views, period);
  EXPECT_EQ(r.window_most, 120);  // all within one window, on both sides of the wrap
  EXPECT_THAT(SamplingPlot(r, views), HasSubstr("svg"));
}

TEST(SamplingHardCase, TimesOfABillionSecondsFoldAsThoseFromZero) {
  const double period = 150.0;
  const SamplingReport near = ReportSampling(Waved(900, 243.3), period),
                       far = ReportSampling(Waved(900, 243.3, 3e10), period);
  EXPECT_EQ(near.covered, far.covered);
  EXPECT_EQ(near.window_least, far.window_least);
  EXPECT_NEAR(near.camera_period, far.camera_period, 1e-3);
}

TEST(SamplingHardCase, ACameraThatStandsIsSaid) {
  std::vector<SampledView> views = Waved(200, 50);
  for (SampledView& v : views) v.centre.setConstant(1e6);
  EXPECT_THAT(ReportSampling(views, 15.37).warnings, Contains(HasSubstr("does not move")));
  EXPECT_THROW(ReportSampling(views, 0), std::invalid_argument);
  views.resize(1);
  EXPECT_THROW(ReportSampling(views, 15.37), std::invalid_argument);
}

}  // namespace
}  // namespace lumi
