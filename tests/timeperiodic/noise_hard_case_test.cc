// Noise and exposure, worse from step to step.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/program/error.h"
#include "tests/timeperiodic/painted_video.h"
#include "timeperiodic/period.h"
#include "timeperiodic/signals.h"

namespace lumi {
namespace {

TEST(NoiseHardCase, ThePeriodIsKeptAndItsErrorSaidUntilThereIsNone) {
  double before = 0;
  for (const double noise : {2.0, 5.0, 9.0, 13.0}) {
    PaintedVideo video;
    video.noise = noise;
    video.gain = [](int i) {
      return 0.7 + 0.001 * i + 0.05 * std::sin(i / 11.0);
    };  // brighter by two fifths, and up and down in 69 frames; nothing clips
    const PeriodEstimate e = EstimatePeriod(FixedSignals(video.Stack(), {}), {}, {});
    EXPECT_NEAR(e.period_frames, video.period, 5e-4 * video.period) << noise;
    EXPECT_LT(std::abs(e.period_frames - video.period), 5 * e.sigma_frames + 1e-5 * video.period) << noise;
    EXPECT_GT(e.sigma_frames, before) << noise;
    before = e.sigma_frames;
  }
  // Where noise is all there is, nothing is found in it.
  PaintedVideo video;
  video.moves = false;
  video.noise = 20;
  video.gain = [](int i) { return 0.7 + 0.001 * i + 0.05 * std::sin(i / 11.0); };
  try {
    FAIL() << EstimatePeriod(FixedSignals(video.Stack(), {}), {}, {}).period_frames;
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("no period"));
  }
}

}  // namespace
}  // namespace lumi
