// Real photos, where they are: ../shared/data beside the project. Not part of it.
#include <gtest/gtest.h>

#include <filesystem>

#include "calibrate/calibrate.h"
#include "scene/files/temporary_folder.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;

// Empty where it is not there.
fs::path Data(const std::string& name) {
  const fs::path folder = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data" / name;
  return fs::exists(folder) ? folder : fs::path();
}

class RealBoards : public testing::Test {
 protected:
  // The photos of `data` whose names begin with `prefix`, linked into a folder of their own.
  fs::path Photos(const fs::path& data, const std::string& prefix) {
    fs::create_directories(folder_ / "photos");
    for (const fs::directory_entry& entry : fs::directory_iterator(data))
      if (entry.path().filename().string().starts_with(prefix) && entry.path().extension() == ".jpg")
        fs::create_symlink(fs::absolute(entry.path()), folder_ / "photos" / entry.path().filename().string());
    return folder_ / "photos";
  }
  CalibrateSummary Run(const fs::path& photos, CalibrateOptions options) {
    options.input = photos;
    options.output = folder_ / "camera.yaml";
    return Calibrate(options, SilentProgress());
  }
  const TemporaryFolder folder_;
};

constexpr double kPublishedFocalPx = 535.9157;  // left_intrinsics.yml: flags 2 (fixed aspect), five coefficients

// The published fit is OpenCV's least squares over all 13 views, one of which (left02, RMS 1.18 px in its own file) has
// corners spoiled by a window of 11 pixels that reaches their neighbours. Done the same way, the same comes out.
TEST_F(RealBoards, StereoLeftReproducesThePublishedFitWhenDoneItsWay) {
  const fs::path data = Data("boards-stereo");
  if (data.empty()) GTEST_SKIP() << "../shared/data/boards-stereo is not there";
  CalibrateOptions options;
  options.fit.model = "square-k1k2pk3";
  options.fit.fix_aspect = true;
  options.fit.keep_outliers = true;
  options.gather.corner_window_px = 11;
  const CalibrateSummary s = Run(Photos(data, "left"), options);
  EXPECT_EQ(s.fit.views.size(), 13U);
  EXPECT_NEAR(s.fit.calibration.intrinsics[kFx] / kPublishedFocalPx, 1, 0.003);
}

// By default the window fits the board: the error is less than half, and the focal length is another one by six of its
// standard deviations.
TEST_F(RealBoards, StereoLeftIsFittedBetterThanPublished) {
  const fs::path data = Data("boards-stereo");
  if (data.empty()) GTEST_SKIP() << "../shared/data/boards-stereo is not there";
  CalibrateOptions options;
  options.fit.fix_aspect = true;
  const CalibrateSummary s = Run(Photos(data, "left"), options);
  EXPECT_EQ(s.fit.views.size(), 13U);
  EXPECT_LT(s.fit.calibration.rms_px, 0.2);
  EXPECT_LT(*s.fit.cross_validated_rms_px, 0.2);
  EXPECT_NEAR(s.fit.calibration.intrinsics[kFx] / kPublishedFocalPx, 1, 0.006);
}

// fx 560.23, fy 561.28: OpenCV's fit of five coefficients over all corners.
TEST_F(RealBoards, WideIsWithinHalfAPercentOfItsReference) {
  const fs::path data = Data("boards-wide");
  if (data.empty()) GTEST_SKIP() << "../shared/data/boards-wide is not there";
  CalibrateOptions options;
  options.board = "8x6";
  for (const bool chosen : {false, true}) {
    options.fit.model = chosen ? "" : "rect-k1k2pk3";
    options.fit.keep_outliers = !chosen;
    const CalibrateSummary s = Run(data, options);
    EXPECT_EQ(s.fit.views.size(), 35U);
    EXPECT_EQ(s.gathered.refused.size(), 1U);
    EXPECT_NEAR(s.fit.calibration.intrinsics[kFx] / 560.23, 1, 0.005) << chosen;
    EXPECT_NEAR(s.fit.calibration.Fy() / 561.28, 1, 0.005) << chosen;
  }
}

}  // namespace
}  // namespace lumi::test
