// Videos that are easily scored wrongly, and videos that cannot be scored.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"
#include "stabilize/score/jitter.h"
#include "stabilize/score/score.h"
#include "stabilize/score/score_command.h"
#include "stabilize/score/stability.h"
#include "tests/stabilize/score/painted_plane.h"

namespace lumi::score {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
constexpr double kTwoPi = 2 * std::numbers::pi;

Eigen::Matrix3d Shaken(int i) {
  return Shift(4 * std::sin(kTwoPi * i / 9) + 10 * std::sin(kTwoPi * i / 60), 3 * std::cos(kTwoPi * i / 7));
}

class ScoreHardCase : public ::testing::Test {
 protected:
  ScoreHardCase() {
    plane_.frames = 60;
    plane_.frame_from_plane = Shaken;
  }
  ScoreResult Of(const fs::path& input, const std::vector<fs::path>& others = {}) {
    return Score({input, others}, SilentProgress());
  }
  static void ExpectRefused(const std::function<void()>& what, ExitCode code, const std::string& words) {
    try {
      what();
      FAIL() << "was not refused";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), code);
      EXPECT_THAT(e.what(), HasSubstr(words));
      EXPECT_FALSE(e.file().empty());
    }
  }
  TemporaryFolder folder_;
  PaintedPlane plane_;
};

TEST_F(ScoreHardCase, OfATripodIsStable) {
  plane_.frame_from_plane = [](int) { return Shift(0, 0); };
  const ScoreResult result = Of(plane_.Write(folder_ / "still.mp4"));
  EXPECT_EQ(*result.videos[0].stability, 1);
  EXPECT_LT(*result.videos[0].jitter.jitter_px, 0.05);
}

TEST_F(ScoreHardCase, OfAPureZoomMovesNothingButFeatures) {
  plane_.frame_from_plane = [&](int i) {
    return Eigen::Matrix3d(Shift(96, 72) * Eigen::Vector3d(1 + 0.01 * i, 1 + 0.01 * i, 1).asDiagonal() *
                           Shift(-96, -72));
  };
  const ScoreResult result = Of(plane_.Write(folder_ / "zoom.mp4"));
  for (const double x : result.videos[0].path.x_px) EXPECT_LT(std::abs(x), 0.5);
  EXPECT_LT(*result.videos[0].jitter.jitter_px, 0.1);
  EXPECT_EQ(result.videos[0].failed_steps, 0);
}

TEST_F(ScoreHardCase, OfNoiseAloneIsRefused) {
  plane_.contrast = 0;
  plane_.noise = 60;
  const fs::path noise = plane_.Write(folder_ / "noise.mp4");
  ExpectRefused([&] { Of(noise); }, ExitCode::kDataRefused, "nothing to follow");
  plane_.noise = 0;
  const fs::path blank = plane_.Write(folder_ / "blank.mp4");
  ExpectRefused([&] { Of(blank); }, ExitCode::kDataRefused, "nothing to follow");
}

TEST_F(ScoreHardCase, ABlankOutputHasNoFiguresAndOthersStillDo) {
  const fs::path input = plane_.Write(folder_ / "input.mp4");
  plane_.contrast = 0;
  plane_.noise = 0;
  const ScoreResult result = Of(input, {plane_.Write(folder_ / "blank.mp4"), input});
  EXPECT_FALSE(result.videos[1].cropping_ratio || result.videos[1].distortion || result.videos[1].stability ||
               result.videos[1].jitter.jitter_px);
  EXPECT_NEAR(*result.videos[2].cropping_ratio, 1, 1e-3);
  EXPECT_THAT(JsonKeys(result).Text(), HasSubstr(R"("cropping_ratio":null,"distortion":null)"));
  EXPECT_THAT(Describe(result), HasSubstr("-"));
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("not to be found")));
  EXPECT_THAT(ScorePlot(result), HasSubstr("</svg>"));
}

TEST_F(ScoreHardCase, LessStabilityWithLessJitterIsExplainedAndNothingElse) {
  const auto remark = [](std::optional<double> stability, std::optional<double> jitter_px) {
    ScoreResult result;
    result.videos.resize(2);
    result.videos[0].stability = 0.9;
    result.videos[0].jitter.jitter_px = 2;
    result.videos[1].stability = stability;
    result.videos[1].jitter.jitter_px = jitter_px;
    const bool in_json = JsonKeys(result).Has("remark");
    EXPECT_EQ(Describe(result).find("share that slow frequencies") != std::string::npos, in_json);
    return in_json;
  };
  EXPECT_TRUE(remark(0.8, 0.1));
  EXPECT_FALSE(remark(0.95, 0.1));
  EXPECT_FALSE(remark(0.8, 3));
  EXPECT_FALSE(remark(0.8, std::nullopt));
  EXPECT_FALSE(remark(std::nullopt, 0.1));
}

TEST_F(ScoreHardCase, AFewBlankFramesAreBridgedAndReported) {
  const fs::path whole = plane_.Write(folder_ / "whole.mp4");
  PaintedPlane holes = plane_;
  VideoWriter writer(folder_ / "holes.mp4", 30);
  for (int i = 0; i < holes.frames; ++i) {
    PaintedPlane frame = holes;
    if (i == 20 || i == 21) frame.contrast = frame.noise = 0;
    writer.Add(frame.Frame(i));
  }
  writer.Finish();
  const ScoreResult result = Of(whole, {folder_ / "holes.mp4"});
  EXPECT_EQ(result.videos[1].failed_matches, 2);
  EXPECT_EQ(result.videos[1].failed_steps, 3);
  EXPECT_THAT(result.videos[1].cuts, testing::IsEmpty());
  EXPECT_NEAR(*result.videos[1].cropping_ratio, 1, 2e-3);
  EXPECT_NEAR(*result.videos[1].stability_y, *result.videos[0].stability_y, 0.1);
}

TEST_F(ScoreHardCase, ACutIsNoMovement) {
  plane_.frame_from_plane = [](int i) { return Shift(0.5 * i, 0); };
  plane_.world = [](int i) { return i < 25 ? 1U : 7U; };
  const ScoreResult result = Of(plane_.Write(folder_ / "cut.mp4"));
  EXPECT_THAT(result.videos[0].cuts, testing::ElementsAre(25));
  const auto& x = result.videos[0].path.x_px;
  EXPECT_NEAR(x[24], 12, 0.3);
  EXPECT_EQ(x[25], x[24]);
  EXPECT_NEAR(x[59], 12 + 17, 0.6);
}

TEST_F(ScoreHardCase, SomethingLargeThatMovesIsNotTheCamera) {
  plane_.frame_from_plane = [](int i) { return Shift(2 * std::sin(kTwoPi * i / 30), 0); };
  plane_.elsewhere = [](int, double x, double) { return x < 0.4 * 192; };
  // The error of one texture is a matter of luck: 0.6 to 1.5 px over these.
  constexpr double kWorst_px = 2;  // of 180 px that the thing goes
  for (const std::uint32_t texture : {1U, 11U, 21U, 31U}) {
    plane_.world = [texture](int) { return texture; };
    const ScoreResult result = Of(plane_.Write(folder_ / fmt::format("moving-{}.mp4", texture)));
    double worst_px = 0;
    for (int i = 0; i < 60; ++i)
      worst_px = std::max(
          worst_px, std::abs(result.videos[0].path.x_px[static_cast<std::size_t>(i)] - 2 * std::sin(kTwoPi * i / 30)));
    EXPECT_LT(worst_px, kWorst_px) << texture;
  }
}

TEST_F(ScoreHardCase, OddSizesAndOtherSizesAreMeasuredAgainstTheirOwn) {
  plane_.width = 193, plane_.height = 145;
  const fs::path input = plane_.Write(folder_ / "odd.mp4");
  PaintedPlane large = plane_;
  large.width = 2 * 193, large.height = 2 * 145;
  large.frame_from_plane = [](int i) { return Eigen::Matrix3d(Eigen::Vector3d(2, 2, 1).asDiagonal() * Shaken(i)); };
  const ScoreResult result = Of(input, {large.Write(folder_ / "large.mp4")});
  EXPECT_NEAR(*result.videos[1].cropping_ratio, 386 / 2 / 194.0, 2e-3);  // odd sizes are padded by a pixel
  EXPECT_NEAR(*result.videos[1].jitter.jitter_px, 2 * *result.videos[0].jitter.jitter_px, 0.15);
  EXPECT_NEAR(*result.videos[1].stability, *result.videos[0].stability, 0.02);
}

TEST_F(ScoreHardCase, AnotherNumberOfFramesIsComparedWhereBothAre) {
  const fs::path input = plane_.Write(folder_ / "input.mp4");
  PaintedPlane shorter = plane_;
  shorter.frames = 41;
  const ScoreResult result = Of(input, {shorter.Write(folder_ / "shorter.mp4")});
  EXPECT_EQ(result.frames, 41);
  EXPECT_EQ(result.videos[0].path.x_px.size(), 41u);
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("41 frames, the input 60")));
  shorter.frames = 20;
  const fs::path piece = shorter.Write(folder_ / "piece.mp4");
  ExpectRefused([&] { Of(input, {piece}); }, ExitCode::kDataRefused, "20 frames, the input 60");
}

TEST_F(ScoreHardCase, OfAFewFramesIsWhatCanBeSaid) {
  plane_.frames = 2;
  const fs::path two = plane_.Write(folder_ / "two.mp4");
  const ScoreResult result = Of(two, {two});
  EXPECT_NEAR(*result.videos[1].cropping_ratio, 1, 1e-3);
  EXPECT_FALSE(result.videos[1].stability || result.videos[1].jitter.jitter_px);
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("12 frames and more")));
  plane_.frames = 1;
  const fs::path one = plane_.Write(folder_ / "one.mp4");
  ExpectRefused([&] { Of(one); }, ExitCode::kDataRefused, "one frame");
  ExpectRefused([&] { Of(two, {one}); }, ExitCode::kDataRefused, "one frame");
}

TEST_F(ScoreHardCase, WhatIsNoVideoIsRefusedByName) {
  std::ofstream(folder_ / "letter.mp4") << "dear";
  ExpectRefused([&] { Of(folder_ / "letter.mp4"); }, ExitCode::kCorruptInput, "not a video");
  ExpectRefused([&] { Of(folder_ / "absent.mp4"); }, ExitCode::kCorruptInput, "no such video");
  // Sound alone.
  RunSubprocess({"ffmpeg", "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "sine=duration=1",
                 (folder_ / "sound.mp4").string()});
  ExpectRefused([&] { Of(folder_ / "sound.mp4"); }, ExitCode::kCorruptInput, "video");
}

TEST_F(ScoreHardCase, AVariableFrameRateIsPutInTime) {
  // A steady movement with every other frame of a stretch left out: still steady.
  plane_.frames = 110;
  plane_.frame_from_plane = [](int i) { return Shift(0.9 * i, -0.4 * i); };
  const fs::path even = plane_.Write(folder_ / "even.mp4"), uneven = folder_ / "uneven.mp4";
  RunSubprocess({"ffmpeg", "-nostdin", "-loglevel", "error", "-i", even.string(), "-vf",
                 "select=not(between(n\\,40\\,70)*mod(n\\,2))", "-vsync", "vfr", "-crf", "12", uneven.string()});
  const ScoreResult result = Of(uneven);
  EXPECT_TRUE(result.videos[0].uneven_times);
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("evenly")));
  const auto& x = result.videos[0].path.x_px;
  EXPECT_NEAR(static_cast<double>(x.size()), 110, 2);
  double worst_px = 0;
  // The last frames' times are a guess: FFmpeg does not say them.
  for (std::size_t i = 0; i + 8 < x.size(); ++i) worst_px = std::max(worst_px, std::abs(x[i + 1] - x[i] - 0.9));
  EXPECT_LT(worst_px, 0.15);
  EXPECT_LT(*result.videos[0].jitter.jitter_px, 0.15);
}

TEST_F(ScoreHardCase, AsAProgramPrintsATableWritesAPlotAndRefusesInOneLine) {
  plane_.frames = 16;
  const fs::path input = plane_.Write(folder_ / "input.mp4"), plot = folder_ / "plot.svg";
  const auto run = [&](std::vector<std::string> arguments, SubprocessResult* result) {
    arguments.insert(arguments.begin(), {LUMI_BIN_DIR "/lumi-stabilize", "score"});
    SubprocessOptions options;
    options.separate_stdout = true;
    *result = RunSubprocess(arguments, options);
    return result->exit_code;
  };
  SubprocessResult r;
  EXPECT_EQ(run({input.string(), "--plot", plot.string()}, &r), 0);
  EXPECT_THAT(r.out, HasSubstr("stability"));
  EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), 2);
  EXPECT_TRUE(fs::exists(plot));
  EXPECT_EQ(run({}, &r), 2);
  EXPECT_EQ(run({(folder_ / "absent.mp4").string(), "--quiet"}, &r), 3);
  EXPECT_EQ(r.tail.size(), 1u);
}

TEST_F(ScoreHardCase, IsTheSameOnAnyNumberOfThreads) {
  const fs::path input = plane_.Write(folder_ / "input.mp4");
  const auto figures = [&](const char* threads) {
    const std::string program = LUMI_BIN_DIR "/lumi-stabilize";
    SubprocessOptions options;
    options.separate_stdout = true;
    const auto run = RunSubprocess(
        {program, "score", input.string(), input.string(), "--json", "--quiet", "--threads", threads}, options);
    EXPECT_EQ(run.exit_code, 0);
    return run.out.substr(0, run.out.find("\"seconds\""));
  };
  const std::string one = figures("1");
  EXPECT_THAT(one, HasSubstr(R"("schema": "lumi-stabilize")"));
  EXPECT_EQ(one, figures("4"));
}

// ---- the figures next to their degenerate neighbours, step by step

constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kSafety = 10;

TEST(PictureChangeHardCase, APictureThatCollapsesToALineHasItsSharesOrNone) {
  const Eigen::Vector2i size(640, 360);
  int answered = 0;
  for (double e = 1e-2; e >= 1e-15; e /= 10) {
    const Eigen::Matrix3d H = Shift(320, 180) * Eigen::Vector3d(1, e, 1).asDiagonal() * Shift(-320, -180);
    const auto change = ChangeOf(H, size, size);
    if (!change) continue;
    ++answered;
    const double tolerance = kSafety * kEpsilon / e * 180;  // the middle, 180 px away, is what e is told beside
    EXPECT_NEAR(change->distortion / e, 1, tolerance) << e;
    EXPECT_NEAR(change->cropping * std::sqrt(e), 1, tolerance) << e;
    EXPECT_GE(change->kept_area, 0) << e;
    EXPECT_LE(change->kept_area, 1 + tolerance) << e;
  }
  EXPECT_GE(answered, 9);  // down to 1e-10
  EXPECT_FALSE(ChangeOf(Shift(320, 180) * Eigen::Vector3d(1, 0, 1).asDiagonal() * Shift(-320, -180), size, size));
}

TEST(HomographyHardCase, FeaturesThatComeToLieOnALineMoveAsTheyDidOrTellNothing) {
  // A turn of 0.02 about the picture's middle; features across all of its width, and less and less of its height.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(0.02).toRotationMatrix();
  const Eigen::Matrix3d H = Shift(323, 179) * turn * Shift(-320, -180);
  int answered = 0;
  for (double height = 1e-2; height >= 1e-15; height /= 10) {
    std::vector<PointPair> pairs;
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector2d x(20 + 10 * i, 180 + 180 * height * std::sin(1.7 * i));
      pairs.push_back({x, (H * x.homogeneous()).hnormalized()});
    }
    for (const bool step : {true, false}) {
      const auto fit = step ? FitStep(pairs, 1) : FitHomography(pairs, 1);
      if (!fit) continue;
      answered += step;
      EXPECT_TRUE(fit->to_from.allFinite()) << height;
      for (const PointPair& p : pairs)
        ASSERT_LT(((fit->to_from * p.from_px.homogeneous()).hnormalized() - p.to_px).norm(), 1) << height;
    }
  }
  EXPECT_GE(answered, 5);  // fewer: features on a line are refused
}

TEST(StabilityHardCase, AShakeThatVanishesLeavesOneAndAWalkThatVanishesNothing) {
  constexpr int kFrames = 120;
  for (double ratio = 1e-1; ratio >= 1e-15; ratio /= 10) {
    std::vector<double> shaken, walked;
    for (int i = 0; i < kFrames; ++i) {
      const double slow = std::cos(kTwoPi * 3 * i / kFrames), fast = std::cos(kTwoPi * 17 * i / kFrames);
      shaken.push_back(slow + ratio * fast);
      walked.push_back(ratio * slow + fast);
    }
    EXPECT_NEAR(*StabilityOf(shaken, 0), 1 / (1 + ratio * ratio), kSafety * kEpsilon) << ratio;
    EXPECT_NEAR(*StabilityOf(walked, 0), ratio * ratio / (1 + ratio * ratio), kSafety * kEpsilon) << ratio;
  }
  // About the size below which nothing moves: 1 below it, the path's own above.
  std::vector<double> path;
  for (int i = 0; i < kFrames; ++i)
    path.push_back(std::numbers::sqrt2 * std::cos(kTwoPi * 17 * i / kFrames));  // root mean square 1
  for (double d = 1e-2; d >= 1e-14; d /= 10) {
    EXPECT_EQ(*StabilityOf(path, 1 + d), 1) << d;
    EXPECT_LT(*StabilityOf(path, 1 - d), kSafety * kEpsilon) << d;
  }
}

TEST(JitterHardCase, TimesThatFallTogetherStillTellAParabolaOrNothing) {
  constexpr double kReach_s = 0.7 + 1 / 30.0;
  int steps = 0, answered = 0;
  for (double apart_s = 1e-1; apart_s >= 1e-15; apart_s /= 10, ++steps) {
    std::vector<double> times_s;
    for (int i = -6; i <= 6; ++i) times_s.push_back(5 + apart_s * i);
    const std::vector<double> weights = ParabolaWeights(times_s, 5, 1 / 30.0);
    if (weights.empty()) continue;
    ++answered;
    double sum = 0, first = 0, second = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double t = (times_s[i] - 5) / kReach_s;
      sum += weights[i], first += weights[i] * t, second += weights[i] * t * t;
    }
    // Normal equations: the square of what the times' spread is of the window, squared again by the parabola.
    const double tolerance = kSafety * kEpsilon * std::pow(kReach_s / (6 * apart_s), 4) + kSafety * kEpsilon;
    EXPECT_NEAR(sum, 1, tolerance) << apart_s;
    EXPECT_NEAR(first, 0, tolerance) << apart_s;
    EXPECT_NEAR(second, 0, tolerance) << apart_s;
  }
  EXPECT_GE(answered, 3);
  EXPECT_LT(answered, steps);
}

}  // namespace
}  // namespace lumi::score
