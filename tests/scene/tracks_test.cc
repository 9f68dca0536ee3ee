// Tracks against motions that are known exactly, and against a real drive with measured poses.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <numeric>
#include <random>

#include "files_test_util.h"
#include "scene/files/image_io.h"
#include "scene/tracks/affine_patch.h"
#include "scene/tracks/match_descriptors.h"
#include "scene/tracks/match_photos.h"
#include "scene/tracks/track_video.h"
#include "textured_frames.h"

namespace lumi::test {
namespace {

constexpr int kWidth = 360, kHeight = 270, kFrames = 30;
constexpr int kWantedAlive = 300;
constexpr double kNoise = 2;  // grey levels
constexpr double kFewOutliers = 0.001;
// A track that is further from the truth than this follows something else.
constexpr double kOutlierPx = 1.0;

Motion Translation(const Eigen::Vector2d& step) {
  return [step](int frame, const Eigen::Vector2d& x) -> Eigen::Vector2d { return x - frame * step; };
}

// About the middle of the frame.
Motion Turning(double radians_a_frame, double zoom_a_frame) {
  return [=](int frame, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    const Eigen::Vector2d middle(kWidth / 2.0, kHeight / 2.0);
    return middle + std::pow(zoom_a_frame, -frame) * (Eigen::Rotation2Dd(-radians_a_frame * frame) * (x - middle));
  };
}

struct Quality {
  double rms_px = 0;       // of those that are no outliers
  double outliers = 0;     // share of observations
  double last_rms_px = 0;  // of the last observations of tracks of ten frames and more
};

// On the plane all observations of a track are one point; its first is the reference.
Quality Compare(
    const Tracks& tracks, const Motion& plane_from_frame,
    const std::function<double(int)>& scale = [](int) { return 1.0; }) {
  Quality q;
  double sum = 0, last = 0;
  int good = 0, bad = 0, ends = 0;
  for (const Track& t : tracks.tracks) {
    const Eigen::Vector2d start = plane_from_frame(t.observations.front().frame, t.observations.front().x_px);
    for (std::size_t k = 1; k < t.observations.size(); ++k) {
      const TrackObservation& o = t.observations[k];
      const double e = (plane_from_frame(o.frame, o.x_px) - start).norm() * scale(o.frame);
      if (e > kOutlierPx) {
        ++bad;
        continue;
      }
      ++good;
      sum += e * e;
      if (k + 1 == t.observations.size() && k >= 9) {
        last += e * e;
        ++ends;
      }
    }
  }
  q.rms_px = std::sqrt(sum / std::max(good, 1));
  q.outliers = static_cast<double>(bad) / std::max(good + bad, 1);
  q.last_rms_px = std::sqrt(last / std::max(ends, 1));
  return q;
}

void ExpectSound(const Tracks& tracks) {
  for (const Track& t : tracks.tracks)
    for (std::size_t k = 0; k < t.observations.size(); ++k) {
      const TrackObservation& o = t.observations[k];
      ASSERT_TRUE(o.frame >= 0 && o.frame < static_cast<int>(tracks.frames.size()));
      ASSERT_TRUE(k == 0 || o.frame > t.observations[k - 1].frame);
      const Eigen::Vector2i size = tracks.frames[static_cast<std::size_t>(o.frame)].size_px;
      ASSERT_TRUE(o.x_px.x() >= 0 && o.x_px.y() >= 0 && o.x_px.x() <= size.x() && o.x_px.y() <= size.y());
    }
}

bool Same(const Tracks& a, const Tracks& b) {
  if (a.tracks.size() != b.tracks.size()) return false;
  for (std::size_t i = 0; i < a.tracks.size(); ++i) {
    const auto &x = a.tracks[i].observations, &y = b.tracks[i].observations;
    if (x.size() != y.size() || a.tracks[i].color != b.tracks[i].color) return false;
    for (std::size_t k = 0; k < x.size(); ++k)
      if (x[k].frame != y[k].frame || x[k].x_px != y[k].x_px) return false;
  }
  return true;
}

TEST(TrackVideo, FollowsATranslationToATenthOfAPixelOverThirtyFrames) {
  const Motion motion = Translation({2.37, -1.19});
  TrackVideoSummary summary;
  const Tracks tracks =
      TrackVideo(TexturedFrames(kFrames, kWidth, kHeight, motion, kNoise), {}, SilentProgress(), &summary);
  ExpectSound(tracks);
  ASSERT_EQ(tracks.frames.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(tracks.frames[3].name, "frame 3");
  EXPECT_EQ(tracks.frames[3].size_px, Eigen::Vector2i(kWidth, kHeight));
  const Quality q = Compare(tracks, motion);
  EXPECT_LT(q.rms_px, 0.1);
  EXPECT_LT(q.last_rms_px, 0.1);
  EXPECT_LT(q.outliers, kFewOutliers);
  EXPECT_GE(*std::min_element(summary.alive.begin(), summary.alive.end()), kWantedAlive);
  // The corners are all over the frame: each sixteenth of it has its share, within a factor of two and a half.
  std::array<int, 16> in_part{};
  for (const Track& t : tracks.tracks)
    if (t.observations.front().frame == 0) {
      const Eigen::Vector2d& x = t.observations.front().x_px;
      ++in_part[static_cast<std::size_t>(4 * static_cast<int>(4 * x.y() / kHeight) +
                                         static_cast<int>(4 * x.x() / kWidth))];
    }
  const int sum = std::accumulate(in_part.begin(), in_part.end(), 0);
  EXPECT_GT(16 * *std::min_element(in_part.begin(), in_part.end()), sum / 2.5);
}

TEST(TrackVideo, FollowsARotationAndAZoom) {
  struct Case {
    double turn_rad, zoom;
  };
  for (const Case& c : {Case{0.03, 1.02}, Case{0.02, 1 / 1.02}}) {
    SCOPED_TRACE(std::to_string(c.turn_rad) + " " + std::to_string(c.zoom));
    const Motion motion = Turning(c.turn_rad, c.zoom);
    TrackVideoSummary summary;
    const Tracks tracks =
        TrackVideo(TexturedFrames(kFrames, kWidth, kHeight, motion, kNoise), {}, SilentProgress(), &summary);
    ExpectSound(tracks);
    const Quality q = Compare(tracks, motion, [&](int frame) { return std::pow(c.zoom, frame); });
    EXPECT_LT(q.rms_px, 0.1);
    EXPECT_LT(q.outliers, kFewOutliers);
    EXPECT_GE(*std::min_element(summary.alive.begin(), summary.alive.end()), kWantedAlive);
  }
}

TEST(TrackVideo, TheFirstPatchKeepsTracksFromDrifting) {
  const Motion motion = Turning(0.02, 1.01);
  const FrameSource frames = TexturedFrames(kFrames, kWidth, kHeight, motion, kNoise);
  TrackVideoOptions steps;
  steps.hold_to_first_patch = false;
  const auto scale = [](int frame) { return std::pow(1.01, frame); };
  const Quality held = Compare(TrackVideo(frames, {}, SilentProgress()), motion, scale),
                free = Compare(TrackVideo(frames, steps, SilentProgress()), motion, scale);
  EXPECT_LT(held.last_rms_px, 0.4 * free.last_rms_px);
}

TEST(TrackVideo, AStrongHalfDoesNotTakeTheWeakOnesCorners) {
  const FrameSource frames = Frames(6, [](int i) {
    Image8 image = TexturedFrame(360, 270, i, Translation({1, 0}));
    for (int y = 0; y < 270; ++y)
      for (int x = 180; x < 360; ++x) image.At(x, y, 0) = static_cast<std::uint8_t>(100 + image.At(x, y, 0) / 5);
    return image;
  });
  TrackVideoOptions options;
  options.features = 150;  // the strong half alone has places for them
  const Tracks tracks = TrackVideo(frames, options, SilentProgress());
  int weak = 0, all = 0;
  for (const Track& t : tracks.tracks) {
    weak += t.observations.front().x_px.x() > 180;
    ++all;
  }
  EXPECT_GT(weak, 0.2 * all);
}

TEST(TrackVideo, SameTracksWhateverTheNumberOfThreads) {
  const FrameSource frames = TexturedFrames(12, 240, 180, Turning(0.02, 1.01), kNoise);
  FrameSource film = frames;
  film.in_order = true;
  SetThreadCount(1);
  const Tracks one = TrackVideo(frames, {}, SilentProgress());
  SetThreadCount(3);
  const Tracks three = TrackVideo(frames, {}, SilentProgress()), in_order = TrackVideo(film, {}, SilentProgress());
  SetThreadCount(0);
  ASSERT_GT(one.tracks.size(), 100u);
  EXPECT_TRUE(Same(one, three));
  EXPECT_TRUE(Same(one, in_order));
}

TEST(TrackVideo, NoTrackEntersAMaskedArea) {
  const Motion motion = Translation({3, 0});
  FrameSource frames = TexturedFrames(12, 240, 180, motion);
  frames.mask = [](int i) {
    Image8 mask(240, 180, 1, 255);
    for (int y = 0; y < 180; ++y)
      for (int x = 100; x < 160; ++x) mask.At(x, y, 0) = 0;
    return i == 3 ? Image8() : i == 4 ? Resize(mask, 120, 90) : mask;  // none, and one of half the size
  };
  TrackVideoSummary summary;
  const Tracks tracks = TrackVideo(frames, {}, SilentProgress(), &summary);
  EXPECT_GT(summary.ended_masked, 0);
  int left = 0, right = 0, inside = 0;
  for (const Track& t : tracks.tracks)
    for (const TrackObservation& o : t.observations) {
      inside += o.frame != 3 && o.x_px.x() >= 100 && o.x_px.x() < 160;
      left += o.x_px.x() < 100;
      right += o.x_px.x() >= 160;
    }
  EXPECT_EQ(inside, 0);
  EXPECT_GT(left, 100);
  EXPECT_GT(right, 100);
}

TEST(TrackVideo, PhotosAndMasksAreFoundByName) {
  const TempFolder folder;
  std::vector<std::string> names;
  for (int i = 0; i < 6; ++i) {
    const Image8 grey = TexturedFrame(160, 120, i, Translation({1, 0}));
    Image8 rgb(160, 120, 3), mask(160, 120, 3, 255);
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        for (int c = 0; c < 3; ++c) rgb.At(x, y, c) = static_cast<std::uint8_t>(grey.At(x, y, 0) / (c + 1));
        if (x < 80) mask.At(x, y, 0) = mask.At(x, y, 1) = mask.At(x, y, 2) = 0;
      }
    names.push_back("f/" + std::to_string(i) + ".png");
    WriteImage(folder / names.back(), rgb);
    if (i != 2) WriteImage(folder / ("masks/" + names.back() + ".png"), mask);
  }
  const Tracks tracks = TrackVideo(PhotoSource(folder.path(), names, folder / "masks"), {}, SilentProgress());
  ASSERT_GT(tracks.tracks.size(), 10u);
  EXPECT_EQ(tracks.frames[5].name, "f/5.png");
  for (const Track& t : tracks.tracks) {
    EXPECT_GT(t.color[0], t.color[2]);
    for (const TrackObservation& o : t.observations) EXPECT_TRUE(o.frame == 2 || o.x_px.x() >= 80);
  }
  fs::remove(folder / names[3]);
  EXPECT_REFUSED(ExitCode::kCorruptInput, "3.png", TrackVideo(PhotoSource(folder.path(), names), {}, SilentProgress()));
}

TEST(TrackVideo, OptionsOutOfRangeAreRefused) {
  const auto refused = [](auto&& change) {
    TrackVideoOptions o;
    change(o);
    EXPECT_REFUSED(ExitCode::kUsage, ":", TrackVideo(Frames(0, {}), o, SilentProgress()));
  };
  refused([](auto& o) { o.features = 7; });
  refused([](auto& o) { o.min_length = 1; });
  refused([](auto& o) { o.window_px = 20; });
  refused([](auto& o) { o.levels = 11; });
  refused([](auto& o) { o.forward_backward_px = std::nan(""); });
  refused([](auto& o) { o.patch_px = 5; });
  refused([](auto& o) { o.min_correlation = 1; });
  refused([](auto& o) { o.cut_share = -0.1; });
  EXPECT_TRUE(TrackVideo(Frames(0, {}), {}, SilentProgress()).tracks.empty());
}

TEST(AffinePatch, IsFoundAgainUnderAnAffineMapAndAnotherExposure) {
  Eigen::Matrix2d A;
  A << 1.1, 0.12, -0.08, 0.93;
  const Eigen::Vector2d x(60.3, 50.7), moved(71.9, 44.2);
  ImageF first(120, 100, 1), second(120, 100, 1);
  for (int v = 0; v < 100; ++v)
    for (int u = 0; u < 120; ++u) {
      const Eigen::Vector2d p(u + 0.5, v + 0.5), q = x + A.inverse() * (p - moved);
      first.At(u, v, 0) = static_cast<float>(Texture(p.x(), p.y()));
      second.At(u, v, 0) = static_cast<float>(0.6 * Texture(q.x(), q.y()) + 30);
    }
  const auto patch = TakePatch(first, x, 10);
  ASSERT_TRUE(patch);
  const auto match = AlignPatch(*patch, second, {moved + Eigen::Vector2d(1.2, -0.9), Eigen::Matrix2d::Identity()});
  ASSERT_TRUE(match);
  // Bilinear samples of a texture with detail of 6 px.
  EXPECT_LT((match->pose.x_px - moved).norm(), 0.03);
  EXPECT_LT((match->pose.A - A).norm(), 0.02);
  EXPECT_GT(match->correlation, 0.995);
  EXPECT_FALSE(TakePatch(first, {5, 50}, 10)) << "not inside";
  EXPECT_FALSE(TakePatch(ImageF(60, 60, 1, 7.0f), {30, 30}, 10)) << "no contrast";
  ImageF edge(60, 60, 1);
  for (int v = 0; v < 60; ++v)
    for (int u = 0; u < 60; ++u) edge.At(u, v, 0) = u < 30 ? 20.0f : 200.0f;
  EXPECT_FALSE(TakePatch(edge, {30, 30}, 10)) << "slides along itself";
}

// --- A real drive ------------------------------------------------------------------------------------------------

constexpr double kRoadFocal = 718.856, kRoadCx = 607.1928 + 0.5, kRoadCy = 185.2157 + 0.5;

std::vector<Rigid3> RoadPoses(const fs::path& file) {
  std::vector<Rigid3> cam_from_world;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream row(line);
    Eigen::Matrix<double, 3, 4> m;
    for (int i = 0; i < 12; ++i) row >> m(i / 4, i % 4);
    if (!row) break;
    cam_from_world.push_back(
        Rigid3{Eigen::Quaterniond(Eigen::Matrix3d(m.leftCols<3>())).normalized(), m.col(3)}.Inverse());
  }
  return cam_from_world;
}

// Distance of x in frame b from the epipolar line of its observation in frame a, mean of both directions.
double EpipolarPx(const Rigid3& a, const Rigid3& b, const Eigen::Vector2d& x, const Eigen::Vector2d& y) {
  Eigen::Matrix3d K;
  K << kRoadFocal, 0, kRoadCx, 0, kRoadFocal, kRoadCy, 0, 0, 1;
  const Rigid3 b_from_a = b * a.Inverse();
  const Eigen::Vector3d t = b_from_a.translation;
  Eigen::Matrix3d T;
  T << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d F = K.inverse().transpose() * T * b_from_a.R() * K.inverse();
  const Eigen::Vector3d l = F * x.homogeneous(), m = F.transpose() * y.homogeneous();
  const double e = std::abs(y.homogeneous().dot(l));
  return 0.5 * (e / l.head<2>().norm() + e / m.head<2>().norm());
}

TEST(TrackVideo, ADriveAgreesWithItsMeasuredPoses) {
  const fs::path road = SharedData("road");
  if (!fs::exists(road)) GTEST_SKIP() << "no " << road;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(road / "images")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  const std::vector<Rigid3> poses = RoadPoses(road / "poses.txt");
  ASSERT_EQ(poses.size(), names.size());
  TrackVideoSummary summary;
  const Tracks tracks = TrackVideo(PhotoSource(road / "images", names), {}, SilentProgress(), &summary);
  ExpectSound(tracks);
  EXPECT_GE(*std::min_element(summary.alive.begin(), summary.alive.end()), kWantedAlive);
  EXPECT_TRUE(summary.cuts.empty());
  // Four frames apart: four metres. Beyond, the poses' own error (0.16 px a frame) is most of what is seen.
  constexpr std::size_t kGap = 4;
  std::vector<double> errors;
  for (const Track& t : tracks.tracks)
    for (std::size_t k = kGap; k < t.observations.size(); ++k) {
      const auto &a = t.observations[k - kGap], &b = t.observations[k];
      errors.push_back(EpipolarPx(poses[static_cast<std::size_t>(a.frame)], poses[static_cast<std::size_t>(b.frame)],
                                  a.x_px, b.x_px));
    }
  ASSERT_GT(errors.size(), 10000u);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.8);
  EXPECT_LT(errors[errors.size() * 95 / 100], 2.0);
  EXPECT_LT(errors.end() - std::lower_bound(errors.begin(), errors.end(), 3.0),
            static_cast<std::ptrdiff_t>(errors.size() / 50))
      << "outliers";
}

// --- Photos in no order ------------------------------------------------------------------------------------------

// Where a point of the textured plane is in photo i: photos of a plane seen from several places.
Motion PlanePhotos() {
  return [](int i, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    const double a = 0.15 * i, s = 1 + 0.06 * i;
    const Eigen::Vector2d y = Eigen::Rotation2Dd(a) * (x - Eigen::Vector2d(160, 120)) / s;
    return Eigen::Vector2d(160 + 9 * i, 120 - 5 * i) + y / (1 + 1e-4 * i * y.x());
  };
}

TEST(MatchPhotos, TracksOfPhotosInNoOrderAreOnePointEach) {
  constexpr int kPhotos = 5;
  const Motion plane = PlanePhotos();
  MatchPhotosSummary summary;
  FrameSource photos = TexturedFrames(kPhotos, 320, 240, plane, kNoise);
  photos.mask = [](int i) { return i == 2 ? Image8(320, 240, 1, 255) : Image8(); };
  const Tracks tracks = MatchPhotos(photos, {}, SilentProgress(), &summary);
  ExpectSound(tracks);
  ASSERT_GT(tracks.tracks.size(), 200u);
  ASSERT_EQ(summary.pairs.size(), 10u);
  for (const MatchedPair& p : summary.pairs) EXPECT_GT(p.verified, 50) << p.first << " " << p.second;
  const Quality q = Compare(tracks, plane);
  EXPECT_LT(q.rms_px, 0.4);  // SIFT's places, two of them, under 2 grey levels of noise
  EXPECT_LT(q.outliers, 0.03);
  int long_ones = 0;
  for (const Track& t : tracks.tracks) long_ones += t.observations.size() >= 4;
  EXPECT_GT(long_ones, 50);
}

TEST(MatchPhotos, WrongMatchesDoNotAgreeWithThePairsGeometry) {
  MatchPhotosOptions options;
  options.ratio = 1;  // what only one photo shows finds something, too
  MatchPhotosSummary summary;
  const Motion motion = Translation({140, 20});
  const FrameSource photos = TexturedFrames(3, 320, 240, motion, kNoise);
  const Tracks tracks = MatchPhotos(photos, options, SilentProgress(), &summary);
  ASSERT_GT(tracks.tracks.size(), 100u);
  int matches = 0, verified = 0;
  for (const MatchedPair& p : summary.pairs) {
    matches += p.matches;
    verified += p.verified;
  }
  EXPECT_LT(verified, 0.75 * matches);
  const Quality q = Compare(tracks, motion);
  EXPECT_LT(q.outliers, 0.15);  // of 40 % wrong ones those along the epipolar lines
}

// One photo shows the scene twice: its left half is what the first photo sees, its right half what the third one does.
// b: a in another order, a little turned, and one that is there twice, which matches nothing.
TEST(MatchDescriptors, EachFindsItsOwnAndTwinsFindNone) {
  constexpr Eigen::Index kCount = 600, kTwin = 5;  // more rows than one block of the product
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const auto any = [&](Eigen::Index rows) {
    Descriptors d(rows, 128);
    for (Eigen::Index i = 0; i < d.size(); ++i) d.data()[i] = normal(random);
    return Descriptors(d.rowwise().normalized());
  };
  const Descriptors a = any(kCount);
  Descriptors b = a.colwise().reverse() + 0.3F * any(kCount);
  b.conservativeResize(kCount + 1, Eigen::NoChange);
  b.row(kCount) = b.row(kCount - 1 - kTwin);
  b.rowwise().normalize();
  const auto matches = MatchDescriptors(a, b, 0.8, kCount + 1);
  ASSERT_EQ(matches.size(), static_cast<std::size_t>(kCount - 1));
  int last = -1;
  for (const DescriptorMatch& m : matches) {
    EXPECT_GT(m.a, last);
    last = m.a;
    EXPECT_NE(m.a, kTwin);
    EXPECT_EQ(m.b, kCount - 1 - m.a);
    EXPECT_NEAR(m.similarity, a.row(m.a).dot(b.row(m.b)), 1e-5);
  }
  // Of the first half of each: theirs are in the other half.
  EXPECT_TRUE(MatchDescriptors(a, b, 0.8, kCount / 2).empty());
  EXPECT_TRUE(MatchDescriptors(a, Descriptors(0, 128), 0.8, kCount).empty());
}

TEST(MatchPhotos, TwoPointsOfOnePhotoDoNotComeIntoOneTrack) {
  const auto scene = [](int noise) { return TexturedFrame(160, 200, noise, Translation({0, 0}), 4); };
  const FrameSource photos = Frames(3, [&](int i) {
    if (i != 1) return scene(i);
    const Image8 a = scene(0), b = scene(2);
    Image8 both(320, 200, 1);
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 320; ++x) both.At(x, y, 0) = x < 160 ? a.At(x, y, 0) : b.At(x - 160, y, 0);
    return both;
  });
  MatchPhotosOptions options;
  options.ratio = 1;
  MatchPhotosSummary summary;
  const Tracks tracks = MatchPhotos(photos, options, SilentProgress(), &summary);
  EXPECT_GT(summary.conflicts, 20);
  ASSERT_GT(tracks.tracks.size(), 50u);
  ExpectSound(tracks);
}

TEST(MatchPhotos, SameTracksWhateverTheNumberOfThreads) {
  const FrameSource photos = TexturedFrames(4, 240, 180, PlanePhotos(), kNoise);
  SetThreadCount(1);
  const Tracks one = MatchPhotos(photos, {}, SilentProgress());
  SetThreadCount(3);
  const Tracks three = MatchPhotos(photos, {}, SilentProgress());
  SetThreadCount(0);
  ASSERT_GT(one.tracks.size(), 50u);
  EXPECT_TRUE(Same(one, three));
}

// OpenCV's SIFT is a quarter of a pixel off; a later one may not be.
TEST(MatchPhotos, ASymmetricSpotIsAtItsMiddle) {
  const auto spots = [](int shift) {
    Image8 image(200, 150, 1, 40);
    for (int y = 0; y < 150; ++y)
      for (int x = 0; x < 200; ++x) {
        double v = 40;
        for (int k = 0; k < 30; ++k) {
          const double cx = 20.5 + 32 * (k % 6) + shift, cy = 15.5 + 28 * (k / 6);
          const double r2 = (x + 0.5 - cx) * (x + 0.5 - cx) + (y + 0.5 - cy) * (y + 0.5 - cy);
          v += (120 + 2 * k) * std::exp(-r2 / (2 * 9.0));
        }
        image.At(x, y, 0) = static_cast<std::uint8_t>(std::clamp(v + 0.5, 0.0, 255.0));
      }
    return image;
  };
  MatchPhotosOptions options;
  options.ratio = 1;  // the spots look alike
  options.min_matches = 8;
  const Tracks tracks = MatchPhotos(Frames(2, [&](int) { return spots(0); }), options, SilentProgress());
  ASSERT_GT(tracks.tracks.size(), 8u);
  std::vector<double> dx, dy;
  for (const Track& t : tracks.tracks) {
    const Eigen::Vector2d x = t.observations[0].x_px;
    const double ex = std::remainder(x.x() - 20.5, 32), ey = std::remainder(x.y() - 15.5, 28);
    if (std::hypot(ex, ey) > 1) continue;
    dx.push_back(ex);
    dy.push_back(ey);
  }
  ASSERT_GT(dx.size(), 8u);
  std::sort(dx.begin(), dx.end());
  std::sort(dy.begin(), dy.end());
  EXPECT_NEAR(dx[dx.size() / 2], 0, 0.05);
  EXPECT_NEAR(dy[dy.size() / 2], 0, 0.05);
}

// A long way over the plane, its photos in no order: each is matched with the few that see what it sees.
TEST(MatchPhotos, PhotosAreMatchedWithTheirBestPartners) {
  constexpr int kPhotos = 12;
  const auto place = [](int i) { return i * 5 % kPhotos; };
  const Motion way = [&](int photo, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    return x + Eigen::Vector2d(110.0 * place(photo), 0);
  };
  const FrameSource photos = TexturedFrames(kPhotos, 320, 240, way, kNoise);
  MatchPhotosOptions options;
  MatchPhotosSummary all, some;
  const Tracks by_all = MatchPhotos(photos, options, SilentProgress(), &all);
  options.partners = 3;
  const Tracks tracks = MatchPhotos(photos, options, SilentProgress(), &some);
  EXPECT_EQ(all.pairs.size(), 66u);
  EXPECT_LE(some.pairs.size(), static_cast<std::size_t>(3 * kPhotos));
  // Neighbours are among the pairs, and hardly a verified match is lost.
  int neighbours = 0, verified = 0, verified_of_all = 0;
  for (const MatchedPair& p : some.pairs) {
    neighbours += std::abs(place(p.first) - place(p.second)) == 1;
    verified += p.verified;
  }
  for (const MatchedPair& p : all.pairs) verified_of_all += p.verified;
  EXPECT_EQ(neighbours, kPhotos - 1);
  EXPECT_GT(verified, 0.9 * verified_of_all);
  EXPECT_GT(static_cast<double>(tracks.tracks.size()), 0.9 * static_cast<double>(by_all.tracks.size()));
  EXPECT_LT(Compare(tracks, way).outliers, 0.03);
  options.partners = -1;
  EXPECT_REFUSED(ExitCode::kUsage, "partners", MatchPhotos(photos, options, SilentProgress()));
}

TEST(MatchPhotos, MasksAreRespectedAndPairsMayBeChosen) {
  FrameSource photos = TexturedFrames(3, 320, 240, PlanePhotos());
  photos.mask = [](int) {
    Image8 mask(320, 240, 1, 255);
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 160; ++x) mask.At(x, y, 0) = 0;
    return mask;
  };
  MatchPhotosOptions options;
  options.pairs = {{1, 2}};
  MatchPhotosSummary summary;
  const Tracks tracks = MatchPhotos(photos, options, SilentProgress(), &summary);
  ASSERT_GT(tracks.tracks.size(), 30u);
  EXPECT_EQ(summary.pairs.size(), 1u);
  for (const Track& t : tracks.tracks)
    for (const TrackObservation& o : t.observations) {
      EXPECT_NE(o.frame, 0);
      EXPECT_GE(o.x_px.x(), 160);
    }
  options.pairs = {{2, 1}};
  EXPECT_REFUSED(ExitCode::kUsage, "no pair", MatchPhotos(photos, options, SilentProgress()));
  options.pairs = {{1, 3}};
  EXPECT_REFUSED(ExitCode::kUsage, "no pair", MatchPhotos(photos, options, SilentProgress()));
  options = {};
  options.ratio = 0;
  EXPECT_REFUSED(ExitCode::kUsage, "ratio", MatchPhotos(photos, options, SilentProgress()));
}

}  // namespace
}  // namespace lumi::test
