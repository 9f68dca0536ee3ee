// Each figure of the score against its closed form.
#include "stabilize/score/score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "scene/files/temporary_folder.h"
#include "stabilize/score/picture_match.h"
#include "tests/stabilize/score/painted_plane.h"

namespace lumi::score {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector2i;
constexpr double kRounding = 1e-9;
constexpr double kTwoPi = 2 * std::numbers::pi;

// A similarity or shear about a picture's middle, to another's.
Matrix3d AboutMiddle(const Eigen::Matrix2d& A, const Vector2i& from, const Vector2i& to) {
  Matrix3d H = Matrix3d::Identity();
  H.topLeftCorner<2, 2>() = A;
  return Shift(0.5 * to.x(), 0.5 * to.y()) * H * Shift(-0.5 * from.x(), -0.5 * from.y());
}
Eigen::Matrix2d Turn(double rad) {
  Eigen::Matrix2d R;
  R << std::cos(rad), -std::sin(rad), std::sin(rad), std::cos(rad);
  return R;
}
// Ratio of the singular values of [1 k; 0 1]: their squares are (k^2 + 2 +- k sqrt(k^2 + 4)) / 2, their product is 1.
double ShearDistortion(double k) { return 0.5 * (k * k + 2 - k * std::sqrt(k * k + 4)); }

TEST(PictureChange, OfACropIsItsShareOfTheSides) {
  const Vector2i size(640, 360);
  const auto crop = ChangeOf(AboutMiddle(Turn(0.3) / 0.8, size, size), size, size);
  ASSERT_TRUE(crop);
  EXPECT_NEAR(crop->cropping, 0.8, kRounding);
  EXPECT_NEAR(crop->distortion, 1, kRounding);  // turned: the eigenvalues are complex
  const auto upright = ChangeOf(AboutMiddle(Eigen::Matrix2d::Identity() / 0.8, size, size), size, size);
  EXPECT_NEAR(upright->kept_area, 0.64, kRounding);
  // The same crop into pictures of half the size, and cut out without scaling.
  const Vector2i half(320, 180), cut(512, 288);
  EXPECT_NEAR(ChangeOf(AboutMiddle(0.5 / 0.8 * Eigen::Matrix2d::Identity(), size, half), size, half)->cropping, 0.8,
              kRounding);
  const auto cut_out = ChangeOf(Shift(-64, -36), size, cut);
  EXPECT_NEAR(cut_out->cropping, 0.8, kRounding);
  EXPECT_NEAR(cut_out->kept_area, 0.64, kRounding);
  // Half beside the picture: nothing scaled, half kept.
  const auto beside = ChangeOf(Shift(320, 0), size, size);
  EXPECT_NEAR(beside->cropping, 1, kRounding);
  EXPECT_NEAR(beside->kept_area, 0.5, kRounding);
  // Edges that nearly coincide.
  for (const double e : {0.0, 1e-12, 1e-7, 1e-4}) {
    Matrix3d near = Shift(e, -e);
    near(0, 1) = e * 1e-3;
    EXPECT_NEAR(ChangeOf(near, size, size)->kept_area, 1, 1e-4) << e;
  }
  EXPECT_NEAR(ChangeOf(Shift(700, 0), size, size)->kept_area, 0, kRounding);
  // Turned by a quarter: a square of the height in the middle of the input.
  EXPECT_NEAR(ChangeOf(AboutMiddle(Turn(0.5 * std::numbers::pi), size, size), size, size)->kept_area, 360.0 / 640,
              kRounding);
}

TEST(PictureChange, OfAShearIsTheRatioOfItsSingularValues) {
  const Vector2i size(640, 360);
  for (const double k : {0.02, 0.1, 0.5}) {
    Eigen::Matrix2d shear;
    shear << 1, k, 0, 1;
    const auto change = ChangeOf(AboutMiddle(Turn(-0.2) * shear, size, size), size, size);
    EXPECT_NEAR(change->distortion, ShearDistortion(k), kRounding);
    EXPECT_NEAR(change->cropping, 1, kRounding);
  }
  EXPECT_NEAR(ChangeOf(Eigen::Vector3d(2, 1, 1).asDiagonal(), size, {1280, 360})->distortion, 0.5, kRounding);
  EXPECT_FALSE(ChangeOf(Eigen::Vector3d(1, 0, 1).asDiagonal(), size, size));
}

TEST(Movement, IsThatOfTheMiddle) {
  const Vector2i size(640, 360);
  const Movement still = MovementOf(AboutMiddle(Turn(0.1) * 1.2, size, size), size);
  EXPECT_NEAR(still.shift_px.norm(), 0, kRounding);
  EXPECT_NEAR(still.rotation_rad, 0.1, kRounding);
  // Perspective: the Jacobian at the middle, not the affine part.
  Matrix3d H = AboutMiddle(Turn(0.1), size, size);
  const Matrix3d keystone =
      Shift(320, 180) * (Matrix3d() << 1, 0, 0, 0, 1, 0, 1e-4, 2e-4, 1).finished() * Shift(-320, -180);
  const Movement moved = MovementOf(Shift(30, -20) * keystone * H, size);
  EXPECT_NEAR((moved.shift_px - Vector2d(30, -20)).norm(), 0, 1e-6);
  EXPECT_NEAR(moved.rotation_rad, 0.1, kRounding);
}

std::vector<double> Cosines(int n, const std::vector<std::pair<int, double>>& waves) {
  std::vector<double> path(static_cast<std::size_t>(n), 3.0);
  for (const auto& [cycles, amplitude] : waves)
    for (int i = 0; i < n; ++i)
      path[static_cast<std::size_t>(i)] += amplitude * std::cos(kTwoPi * cycles * i / n + 0.4 * cycles);
  return path;
}

TEST(Stability, IsTheShareOfSlowWaves) {
  for (const int n : {120, 121, 497}) {
    EXPECT_NEAR(*StabilityOf(Cosines(n, {{3, 10}}), 0), 1, kRounding);
    EXPECT_NEAR(*StabilityOf(Cosines(n, {{5, 4}, {6, 3}}), 0), 16.0 / 25, kRounding);  // the 6th lowest is 5 cycles
    EXPECT_NEAR(*StabilityOf(Cosines(n, {{1, 2}, {2, 1}, {20, 3}, {41, 1}}), 0), 5.0 / 15, kRounding);
  }
  // A constant speed is a saw tooth: energies 1 / sin^2(pi k / N).
  std::vector<double> ramp(500);
  double slow = 0, all = 0;
  for (int i = 0; i < 500; ++i) ramp[static_cast<std::size_t>(i)] = 0.7 * i;
  for (int k = 1; k <= 250; ++k) {
    const double energy = std::pow(std::sin(std::numbers::pi * k / 500), -2);
    all += energy;
    if (k <= 5) slow += energy;
  }
  EXPECT_NEAR(*StabilityOf(ramp, 0), slow / all, kRounding);
  EXPECT_EQ(*StabilityOf(WithoutLine(ramp), 1e-9), 1);
  for (int i = 0; i < 500; ++i)
    ramp[static_cast<std::size_t>(i)] +=
        std::cos(std::numbers::pi * (i - 249.5) / 5);  // even about the middle: no slope
  EXPECT_LT(*StabilityOf(WithoutLine(ramp), 1e-9), 1e-6);
}

TEST(Stability, OfWhatStandsStillIsOneAndOfWhatIsShortIsNone) {
  EXPECT_EQ(*StabilityOf(std::vector<double>(30, 7.0), 0.1), 1);
  EXPECT_EQ(*StabilityOf(Cosines(30, {{9, 0.1}}), 0.1), 1);
  EXPECT_LT(*StabilityOf(Cosines(30, {{9, 0.2}}), 0.1), 1e-9);
  EXPECT_FALSE(StabilityOf(std::vector<double>(11, 7.0), 0.1));
}

TEST(MeasuredPath, GoesOnAcrossCutsAndThroughFramesThatFailed) {
  MeasuredPath path;
  path.Begin(0);
  const auto add = [&](MeasuredPath::Step step, double x) { path.Add(path.frames() / 30.0, step, {{x, -x}, 0.1 * x}); };
  for (int i = 0; i < 4; ++i) add(MeasuredPath::Step::kMeasured, 2);
  add(MeasuredPath::Step::kFailed, 0);
  add(MeasuredPath::Step::kMeasured, 4);
  add(MeasuredPath::Step::kCut, 0);
  add(MeasuredPath::Step::kFailed, 0);
  add(MeasuredPath::Step::kMeasured, 1);
  const MeasuredPath::Path p = path.Result();
  EXPECT_THAT(p.x_px, testing::ElementsAre(0, 2, 4, 6, 8, 11, 15, 15, 16, 17));
  EXPECT_NEAR(p.rotation_rad.back(), 1.7, kRounding);
  EXPECT_FALSE(p.uneven);
  EXPECT_EQ(path.failed(), 2);
}

// G(f) of jitter.h by its moments: at even times the fit at the middle is (S4 - S2 t^2) w(t) / (S0 S4 - S2^2).
double Gain(double hz, double fps) {
  const int m = static_cast<int>(0.7 * fps + 1e-6);
  double s0 = 0, s2 = 0, s4 = 0;
  const auto weight = [&](double t) { return 1 - t * t / std::pow(0.7 + 1 / fps, 2); };
  for (int k = -m; k <= m; ++k) {
    const double t = k / fps, w = weight(t);
    s0 += w, s2 += w * t * t, s4 += w * t * t * t * t;
  }
  double gain = 1;
  for (int k = -m; k <= m; ++k) {
    const double t = k / fps;
    gain -= (s4 - s2 * t * t) * weight(t) / (s0 * s4 - s2 * s2) * std::cos(kTwoPi * hz * t);
  }
  return gain;
}

TEST(Jitter, LetsThroughWhatIsAboveOneHertz) {
  EXPECT_LT(Gain(0.3, 30), 0.01);
  EXPECT_NEAR(Gain(1, 30), 0.5, 0.05);
  for (const double hz : {1.5, 2.0, 3.0, 5.0, 10.0}) EXPECT_NEAR(Gain(hz, 30), 1, 0.1);
  for (const double fps : {10.0, 25.0, 60.0}) EXPECT_NEAR(Gain(1, fps), 0.5, 0.07) << fps;
}

std::vector<FollowedCorner> Corners(long first, int count, const std::function<Vector2d(long)>& x_px) {
  std::vector<FollowedCorner> corners;
  for (long i = first; i < first + count; ++i) corners.push_back({i, x_px(i)});
  return corners;
}

TEST(Jitter, OfASineIsItsRootMeanSquareTimesTheGain) {
  for (const double fps : {15.0, 30.0, 50.0})
    for (const double hz : {0.5, 1.0, 2.0, 5.0}) {
      JitterMeter meter(fps);
      // A whole number of periods of windows' middles.
      const int half = static_cast<int>(0.7 * fps + 1e-6), frames = 2 * half + static_cast<int>(10 * fps);
      for (int i = 0; i < frames; ++i) {
        const double t = i / fps;
        // Speed and acceleration leave nothing.
        const Vector2d moved(40 * t - 3 * t * t + 1.5 * std::cos(kTwoPi * hz * t),
                             20 * t + 1.5 * std::sin(kTwoPi * hz * t));
        meter.Add(t, Corners(0, 12, [&](long k) { return Vector2d(Vector2d(30 * k, 7 * k) + moved); }));
      }
      const JitterResult result = meter.Result();
      EXPECT_EQ(result.frames, frames - 2 * half);
      const double radius = 1.5 * std::abs(Gain(hz, fps));  // both axes together: the same at all times
      EXPECT_NEAR(*result.jitter_px, radius, 1e-6) << fps << " " << hz;
      EXPECT_NEAR(*result.all_px, radius, 1e-6);
      EXPECT_NEAR(*result.step_px, radius * 2 * std::sin(std::numbers::pi * hz / fps), 1e-6);
    }
}

TEST(Jitter, KnowsNoTracksEndsAndNoThingsThatMoveByThemselves) {
  JitterMeter whole(30), pieces(30), moving(30);
  for (int i = 0; i < 300; ++i) {
    const double t = i / 30.0;
    const Vector2d moved(2 * std::sin(kTwoPi * 2 * t), 2 * std::cos(kTwoPi * 2 * t));
    const auto place = [&](long k) {
      return Vector2d(Vector2d(15.0 * static_cast<double>(k % 20), 9.0 * static_cast<double>(k % 7)) + moved);
    };
    whole.Add(t, Corners(0, 20, place));
    // Tracks of 50 frames, of 1.7 s, that do not begin together.
    std::vector<FollowedCorner> some;
    for (long k = 0; k < 800; ++k)
      if (i >= k / 2 && i < k / 2 + 50) some.push_back({k, place(k)});
    pieces.Add(t, some);
    // 4 in 10 shake by 30 px at 4 Hz.
    moving.Add(t, Corners(0, 20, [&](long k) {
                 return Vector2d(place(k) + (k < 8 ? Vector2d(30 * std::sin(kTwoPi * 4 * t), 0) : Vector2d::Zero()));
               }));
  }
  EXPECT_NEAR(*pieces.Result().jitter_px, *whole.Result().jitter_px, 1e-3);  // not all of the same frames
  EXPECT_NEAR(*moving.Result().jitter_px, *whole.Result().jitter_px, kRounding);
  EXPECT_GT(*moving.Result().all_px, 10);
}

TEST(Jitter, AtUnevenTimesKnowsSpeedAndAcceleration) {
  JitterMeter meter(30);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> interval_s(0.015, 0.06);
  double t = 0;
  for (int i = 0; i < 200; ++i, t += interval_s(random))
    meter.Add(t, Corners(0, 10, [&](long k) { return Vector2d(50.0 * static_cast<double>(k) + 60 * t, 5 * t * t); }));
  ASSERT_TRUE(meter.Result().jitter_px);
  EXPECT_LT(*meter.Result().jitter_px, kRounding);
}

TEST(MatchPictures, FindsAScalingATurnAndAShear) {
  PaintedPlane plane;
  plane.width = 320, plane.height = 240;
  const Image8 input = [&] {
    const Image8 rgb = plane.Frame(0);
    Image8 grey(rgb.width, rgb.height, 1);
    for (std::size_t i = 0; i < grey.data.size(); ++i) grey.data[i] = rgb.data[3 * i];
    return grey;
  }();
  const Vector2i size(320, 240), small(256, 200);
  Eigen::Matrix2d shear;
  shear << 1.03, 0.05, 0, 1;
  const std::vector<std::pair<Eigen::Matrix2d, Vector2i>> cases = {{Eigen::Matrix2d::Identity(), size},
                                                                   {Turn(0.08) / 0.8, size},
                                                                   {Turn(-0.05) * 0.64, small},
                                                                   {shear, size},
                                                                   {Eigen::Matrix2d::Identity() / 0.55, size}};
  for (const auto& [A, to] : cases) {
    const Matrix3d H = Shift(6, -4) * AboutMiddle(A, size, to);
    PaintedPlane seen = plane;
    seen.width = to.x(), seen.height = to.y();
    seen.frame_from_plane = [&](int) { return H; };
    const Image8 rgb = seen.Frame(1);
    Image8 output(rgb.width, rgb.height, 1);
    for (std::size_t i = 0; i < output.data.size(); ++i) output.data[i] = rgb.data[3 * i];
    const auto found = MatchPictures(PictureFeatures(input), PictureFeatures(output));
    ASSERT_TRUE(found) << A;
    const auto change = ChangeOf(found->to_from, size, to), truth = ChangeOf(H, size, to);
    EXPECT_NEAR(change->cropping, truth->cropping, 1e-3) << A;
    EXPECT_NEAR(change->distortion, truth->distortion, 2e-3) << A;
    EXPECT_NEAR(change->kept_area, truth->kept_area, 2e-3) << A;
  }
}

TEST(Score, OfVideosThatAreKnownIsTheirClosedForm) {
  const TemporaryFolder folder;
  // Slow: 2 cycles of 12 px; shake: 20 cycles in 4 s, 5 Hz, of 3 px. The second video has a third of the shake, and is
  // cropped to 0.8.
  const auto path = [](int i, double shake) -> Vector2d {
    return Vector2d(12 * std::sin(kTwoPi * 2 * i / 120), 12 * std::cos(kTwoPi * 2 * i / 120)) +
           shake * Vector2d(std::cos(kTwoPi * 20 * i / 120), std::sin(kTwoPi * 20 * i / 120));
  };
  PaintedPlane shaky, calm;
  const Vector2i size(shaky.width, shaky.height);
  shaky.frame_from_plane = [&](int i) { return Shift(path(i, 3).x(), path(i, 3).y()); };
  calm.frame_from_plane = [&](int i) {
    // A shear of one frame, where no window of the jitter gives it weight.
    Eigen::Matrix2d zoom;
    zoom << 1, i == 0 ? 0.04 : 0, 0, 1;
    return Matrix3d(AboutMiddle(zoom / 0.8, size, size) * Shift(path(i, 1).x(), path(i, 1).y()));
  };
  const auto input = shaky.Write(folder / "shaky.mp4"), output = calm.Write(folder / "calm.mp4"),
             copy = folder / "copy.mp4";
  std::filesystem::copy(input, copy);
  const ScoreResult result = Score({input, {output, copy}}, SilentProgress());
  ASSERT_EQ(result.videos.size(), 3u);
  EXPECT_EQ(result.frames, 120);
  EXPECT_THAT(result.warnings, testing::IsEmpty());
  const VideoScore &in = result.videos[0], &out = result.videos[1], &same = result.videos[2];
  // Compression moves corners by a few hundredths of a pixel.
  EXPECT_NEAR(*in.stability, 144.0 / 153, 0.005);
  EXPECT_NEAR(*out.stability_x, 144.0 / 145, 0.005);
  const auto jitter = [](double shake_px) { return std::hypot(shake_px * Gain(5, 30), 12 * Gain(0.5, 30)); };
  EXPECT_NEAR(*in.jitter.jitter_px, jitter(3), 0.05);
  EXPECT_NEAR(*out.jitter.jitter_px, jitter(1) / 0.8, 0.05);
  EXPECT_NEAR(*out.cropping_ratio, 0.8, 0.001);
  EXPECT_NEAR(*out.distortion, ShearDistortion(0.04), 0.004);
  EXPECT_EQ(out.distortion_frame, 0);
  EXPECT_GT(*out.distortion_mean, 0.997);
  EXPECT_EQ(*in.cropping_ratio, 1);
  EXPECT_NEAR(*same.cropping_ratio, 1, 1e-4);
  EXPECT_NEAR(*same.distortion, 1, 1e-3);
  EXPECT_NEAR(*same.kept_area, 1, 1e-3);
  EXPECT_EQ(*same.stability, *in.stability);
  EXPECT_EQ(*same.jitter.jitter_px, *in.jitter.jitter_px);
}

}  // namespace
}  // namespace lumi::score
