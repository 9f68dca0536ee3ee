// Frames from which there is nothing to follow, or too much: tracks end, or do not begin, and it is said.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>

#include "files_test_util.h"
#include "scene/tracks/affine_patch.h"
#include "scene/tracks/match_photos.h"
#include "scene/tracks/track_video.h"
#include "textured_frames.h"

namespace lumi::test {
namespace {

constexpr int kWidth = 240, kHeight = 180;

Motion Still() {
  return [](int, const Eigen::Vector2d& x) -> Eigen::Vector2d { return x; };
}
Motion Sideways(double step) {
  return [step](int frame, const Eigen::Vector2d& x) -> Eigen::Vector2d { return {x.x() - step * frame, x.y()}; };
}

struct Messages : ProgressSink {
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& line) override { text += line + "\n"; }
  std::string text;
};

TEST(TrackVideoHardCase, EqualFramesInARowDoNotMoveATrackByABit) {
  // 0 1 2 2 2 2 3 4 5: the camera waits.
  const Image8 waits = TexturedFrame(kWidth, kHeight, 2, Sideways(1.3), 2);
  const FrameSource frames = Frames(9, [&](int i) {
    return i >= 2 && i <= 5 ? waits : TexturedFrame(kWidth, kHeight, i < 2 ? i : i - 3, Sideways(1.3), 2);
  });
  TrackVideoSummary summary;
  const Tracks tracks = TrackVideo(frames, {}, SilentProgress(), &summary);
  EXPECT_EQ(summary.repeated, (std::vector<int>{3, 4, 5}));
  int compared = 0;
  for (const Track& t : tracks.tracks) {
    std::map<int, Eigen::Vector2d> at;
    for (const TrackObservation& o : t.observations) at[o.frame] = o.x_px;
    for (int i = 3; i <= 5; ++i)
      if (at.count(2)) {
        ASSERT_TRUE(at.count(i));
        EXPECT_EQ(at[i], at[2]);
        ++compared;
      }
  }
  EXPECT_GT(compared, 300);
}

TEST(TrackVideoHardCase, AStillCameraWithNoiseDoesNotDrift) {
  const Tracks tracks = TrackVideo(TexturedFrames(30, kWidth, kHeight, Still(), 3), {}, SilentProgress());
  double sum = 0;
  int count = 0;
  for (const Track& t : tracks.tracks)
    if (t.observations.size() == 30) {
      sum += (t.observations.back().x_px - t.observations.front().x_px).squaredNorm();
      ++count;
    }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(sum / count), 0.1);
}

TEST(TrackVideoHardCase, BlankFramesGiveNoTracksAndAStatement) {
  for (const int noise : {0, 1}) {  // none, and a sensor's own
    Messages messages;
    TrackVideoSummary summary;
    const FrameSource frames = Frames(6, [&](int i) {
      Image8 image(kWidth, kHeight, 3, 128);
      for (std::size_t k = 0; noise > 0 && k < image.data.size(); ++k)
        image.data[k] = static_cast<std::uint8_t>(
            127 + Hash(static_cast<std::uint32_t>(k) * 31 + static_cast<std::uint32_t>(i)) % 3);
      return image;
    });
    const Tracks tracks = TrackVideo(frames, {}, messages, &summary);
    EXPECT_TRUE(tracks.tracks.empty());
    EXPECT_EQ(tracks.frames.size(), 6u);
    EXPECT_EQ(summary.blank_frames, 6);
    EXPECT_NE(messages.text.find("no corner was found in any of the 6 frames"), std::string::npos) << messages.text;
    Messages again;
    EXPECT_TRUE(MatchPhotos(frames, {}, again).tracks.empty());
    EXPECT_NE(again.text.find("6 photos without a feature, frame 0 first"), std::string::npos) << again.text;
  }
}

TEST(TrackVideoHardCase, AFewBlankFramesEndTracksAndNewOnesBegin) {
  Messages messages;
  TrackVideoSummary summary;
  const Tracks tracks = TrackVideo(Frames(14,
                                          [&](int i) {
                                            return i == 6 || i == 7 ? Image8(kWidth, kHeight, 1, 9)
                                                                    : TexturedFrame(kWidth, kHeight, i, Sideways(1));
                                          }),
                                   {}, messages, &summary);
  EXPECT_EQ(summary.alive[6], 0);
  EXPECT_EQ(summary.alive[7], 0);
  EXPECT_GT(summary.alive[5], 100);
  EXPECT_GT(summary.alive[8], 100);
  EXPECT_NE(messages.text.find("2 of 14 frames"), std::string::npos) << messages.text;
}

TEST(TrackVideoHardCase, AFrameOfAnotherSizeIsRefusedByName) {
  const FrameSource frames =
      Frames(6, [&](int i) { return TexturedFrame(i == 4 ? kWidth + 1 : kWidth, kHeight, i, Still()); });
  EXPECT_REFUSED(ExitCode::kDataRefused, "film/frame 4: the frame is 241 x 180 pixels, those before it 240 x 180",
                 TrackVideo(frames, {}, SilentProgress()));
  const FrameSource empty =
      Frames(2, [&](int i) { return i == 1 ? Image8() : TexturedFrame(kWidth, kHeight, i, Still()); });
  EXPECT_REFUSED(ExitCode::kDataRefused, "film/frame 1: the frame has no pixels",
                 TrackVideo(empty, {}, SilentProgress()));
  const FrameSource alpha = Frames(2, [&](int) { return Image8(40, 40, 4); });
  EXPECT_REFUSED(ExitCode::kDataRefused, "4 channels", TrackVideo(alpha, {}, SilentProgress()));
}

TEST(TrackVideoHardCase, APureRotationIsFollowedByItsHomography) {
  // A camera with f = 250 px that turns by 1 degree a frame about an axis off all of its own.
  const double f = 250;
  const auto H = [&](int frame) {
    Eigen::Matrix3d K;
    K << f, 0, kWidth / 2.0, 0, f, kHeight / 2.0, 0, 0, 1;
    return Eigen::Matrix3d(
        K * Eigen::AngleAxisd(-frame * EIGEN_PI / 180, Eigen::Vector3d(0.2, 0.9, 0.4).normalized()).toRotationMatrix() *
        K.inverse());
  };
  const Motion motion = [&](int frame, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    return (H(frame) * x.homogeneous()).hnormalized();
  };
  const Tracks tracks = TrackVideo(TexturedFrames(20, kWidth, kHeight, motion, 1), {}, SilentProgress());
  ASSERT_GT(tracks.tracks.size(), 200u);
  double sum = 0;
  int count = 0, bad = 0;
  for (const Track& t : tracks.tracks) {
    const Eigen::Vector2d start = motion(t.observations.front().frame, t.observations.front().x_px);
    for (const TrackObservation& o : t.observations) {
      const double e = (motion(o.frame, o.x_px) - start).norm();
      bad += e > 1;
      sum += e > 1 ? 0 : e * e;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(sum / count), 0.1);
  EXPECT_LT(bad, count / 1000);
}

TEST(TrackVideoHardCase, TracksEndAtACutRatherThanJump) {
  for (const double step : {0.0, 2.0}) {
    Messages messages;
    TrackVideoSummary summary;
    const FrameSource frames =
        Frames(20, [&](int i) { return TexturedFrame(kWidth, kHeight, i, Sideways(step), 0, i < 10 ? 1 : 77); });
    const Tracks tracks = TrackVideo(frames, {}, messages, &summary);
    EXPECT_EQ(summary.cuts, (std::vector<int>{10}));
    EXPECT_GT(summary.alive[9], 100);
    EXPECT_GT(summary.alive[10], 100);
    for (const Track& t : tracks.tracks)
      EXPECT_TRUE(t.observations.back().frame < 10 || t.observations.front().frame >= 10);
    EXPECT_NE(messages.text.find("1 cut in the video, the first at frame 10"), std::string::npos) << messages.text;
  }
}

TEST(TrackVideoHardCase, MasksThatAreAllBlackLeaveNothing) {
  FrameSource frames = TexturedFrames(6, kWidth, kHeight, Sideways(1));
  frames.mask = [](int) { return Image8(kWidth, kHeight, 1, 0); };
  Messages messages;
  EXPECT_TRUE(TrackVideo(frames, {}, messages).tracks.empty());
  EXPECT_TRUE(MatchPhotos(frames, {}, messages).tracks.empty());
  EXPECT_NE(messages.text.find("masked"), std::string::npos);
}

TEST(TrackVideoHardCase, ImagesOfAPixelsWidth) {
  for (const auto& [width, height] : {std::pair{1, 200}, {200, 1}, {1, 1}, {2, 2}, {15, 200}, {24, 24}, {26, 26}}) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
    const FrameSource frames = TexturedFrames(6, width, height, Sideways(0.3));
    const Tracks tracks = TrackVideo(frames, {}, SilentProgress());
    EXPECT_EQ(tracks.frames.size(), 6u);
    EXPECT_TRUE(tracks.tracks.empty() || std::min(width, height) > 25);
    EXPECT_EQ(MatchPhotos(frames, {}, SilentProgress()).frames.size(), 6u);
  }
}

TEST(TrackVideoHardCase, OneFrameAndNone) {
  EXPECT_TRUE(TrackVideo(TexturedFrames(1, kWidth, kHeight, Still()), {}, SilentProgress()).tracks.empty());
  EXPECT_TRUE(TrackVideo(TexturedFrames(0, kWidth, kHeight, Still()), {}, SilentProgress()).frames.empty());
  EXPECT_TRUE(MatchPhotos(TexturedFrames(1, kWidth, kHeight, Still()), {}, SilentProgress()).tracks.empty());
  EXPECT_TRUE(MatchPhotos(TexturedFrames(0, kWidth, kHeight, Still()), {}, SilentProgress()).frames.empty());
}

TEST(MatchPhotosHardCase, EqualPhotosMatchPointForPoint) {
  const Image8 photo = TexturedFrame(kWidth, kHeight, 0, Still());
  const Tracks tracks = MatchPhotos(Frames(3, [&](int) { return photo; }), {}, SilentProgress());
  ASSERT_GT(tracks.tracks.size(), 50u);
  for (const Track& t : tracks.tracks)
    for (const TrackObservation& o : t.observations) EXPECT_EQ(o.x_px, t.observations.front().x_px);
}

TEST(MatchPhotosHardCase, UnrelatedPhotosHaveNoTracks) {
  MatchPhotosSummary summary;
  const Tracks tracks = MatchPhotos(
      Frames(3,
             [&](int i) { return TexturedFrame(kWidth, kHeight, 0, Still(), 0, static_cast<std::uint32_t>(100 + i)); }),
      {}, SilentProgress(), &summary);
  EXPECT_TRUE(tracks.tracks.empty());
  for (const MatchedPair& p : summary.pairs) EXPECT_EQ(p.verified, 0);
}

TEST(MatchPhotosHardCase, ARepeatedPatternIsNotMatchedAcrossItself) {
  // Tiles all alike: no match passes the ratio test, or those that do agree with one geometry.
  const auto tiles = [](int frame, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    return {std::fmod(x.x() + 3 * frame, 40.0), std::fmod(x.y(), 40.0)};
  };
  const Tracks tracks = MatchPhotos(TexturedFrames(3, kWidth, kHeight, tiles), {}, SilentProgress());
  for (const Track& t : tracks.tracks)
    for (std::size_t k = 1; k < t.observations.size(); ++k)
      EXPECT_NE(t.observations[k].frame, t.observations[k - 1].frame);
}

// ---- a patch next to its degenerate neighbours, step by step

constexpr int kPatchRadius = 10;

// Waves of the given heights along x and y, moved; in floats, as frames are when patches are taken.
ImageF Waves(double height_x, double height_y, const Eigen::Vector2d& moved = {0, 0}) {
  ImageF image(64, 64, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.At(x, y, 0) = static_cast<float>(128 + height_x * std::sin(0.35 * (x - moved.x())) +
                                             height_y * std::sin(0.29 * (y - moved.y()) + 1));
  return image;
}

// What a patch of such waves, taken at the middle, finds itself moved by; nothing where it is refused.
std::optional<double> OffByPx(double height_x, double height_y) {
  const Eigen::Vector2d middle(32, 32), moved(0.4, -0.3);
  const auto patch = TakePatch(Waves(height_x, height_y), middle, kPatchRadius);
  if (!patch) return std::nullopt;
  EXPECT_TRUE(patch->inverse_hessian.allFinite());
  const auto match = AlignPatch(*patch, Waves(height_x, height_y, moved), {middle, Eigen::Matrix2d::Identity()});
  return match ? (match->pose.x_px - middle - moved).norm() : 1e300;
}

TEST(PatchHardCase, OneThatBecomesAnEdgeIsFoundOrRefused) {
  constexpr double kFoundPx = 0.03;  // steps settle at 0.003; bilinear samples of a wave of 18 px
  bool refused = false;
  int found = 0;
  std::vector<double> heights{60, 30};
  for (double share = 1e-1; share >= 1e-15; share /= 10) heights.push_back(60 * share), heights.push_back(30 * share);
  for (const double height : heights) {
    const auto off_px = OffByPx(60, height);
    EXPECT_FALSE(refused && off_px) << height << ": refused once, an edge stays refused";
    refused = refused || !off_px;
    if (!off_px) continue;
    ++found;
    EXPECT_LT(*off_px, kFoundPx) << height;
  }
  EXPECT_GE(found, 3);
  EXPECT_TRUE(refused);
}

TEST(PatchHardCase, OneThatLosesItsContrastIsFoundOrRefused) {
  constexpr double kFoundPx = 0.03;
  int found = 0, refused = 0;
  for (double share = 1; share >= 1e-15; share /= 10) {
    const auto off_px = OffByPx(60 * share, 60 * share);
    found += off_px.has_value();
    refused += !off_px;
    EXPECT_FALSE(refused > 0 && off_px) << share;
    if (off_px) {
      EXPECT_LT(*off_px, kFoundPx) << share;
    }
  }
  EXPECT_EQ(found, 2);  // 60 and 6 code values: 0.6 are noise
}

TEST(PatchHardCase, TheFramesBorderIsWhereAPatchEnds) {
  const ImageF image = Waves(60, 60);
  const double border = kPatchRadius + 1.5;
  EXPECT_TRUE(TakePatch(image, {border, 32}, kPatchRadius));
  for (double d = 1e-2; d >= 1e-15; d /= 10) {
    EXPECT_TRUE(TakePatch(image, {border + d, 32}, kPatchRadius)) << d;
    EXPECT_FALSE(TakePatch(image, {border - d, 32}, kPatchRadius)) << d;
    EXPECT_FALSE(TakePatch(image, {32, border - d}, kPatchRadius)) << d;
  }
}

TEST(TrackVideoHardCase, AMovementThatVanishesIsFollowedOrIsNone) {
  constexpr int kFrames = 6;
  for (double step = 1e-2; step >= 1e-15; step /= 10) {
    const Tracks tracks = TrackVideo(TexturedFrames(kFrames, kWidth, kHeight, Sideways(step)), {}, SilentProgress());
    ASSERT_GT(tracks.tracks.size(), 100u) << step;
    double sum = 0;
    int count = 0;
    for (const Track& t : tracks.tracks)
      if (t.observations.size() == kFrames) {
        sum += (t.observations.back().x_px - t.observations.front().x_px - Eigen::Vector2d(step * (kFrames - 1), 0))
                   .squaredNorm();
        ++count;
      }
    ASSERT_GT(count, 100) << step;
    EXPECT_LT(std::sqrt(sum / count), 0.02) << step;  // 8 bits a pixel tell no less
  }
}

}  // namespace
}  // namespace lumi::test
