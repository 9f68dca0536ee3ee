// From tracks to scenes, on simulated tracks like those of the examples: accuracy that is promised, and what comes with
// it.
#include "reconstruct/factorization/reconstruct_from_tracks.h"

#include <gtest/gtest.h>

#include "factorization_errors.h"

namespace lumi {
namespace {

using test::DeskPath;
using test::DeskPoints;
using test::DrivePath;
using test::DrivePoints;
using test::HallwayPath;
using test::HallwayPoints;
using test::Noise;
using test::PlazaPath;
using test::PlazaPoints;
using test::See;
using test::SimulatedTracks;

// What is promised at 0.3 px of noise.
constexpr double kRotationDeg = 0.1;
constexpr double kCentreShareOfScene = 0.003;
constexpr double kProjectiveRmsPx = 0.5;

Noise Tracked() { return test::Tracked(0.3, 40); }

void ExpectTruth(const FactorizationResult& r, const SimulatedTracks& s, double rotation_deg = kRotationDeg,
                 double share = kCentreShareOfScene) {
  ASSERT_EQ(r.upgrade, UpgradeKind::kMetric) << r.upgrade_reason;
  const test::TruthErrors errors = test::ErrorsAgainst(s, r);
  EXPECT_EQ(errors.placed, s.cam_from_world.size());
  EXPECT_LT(errors.rotation_max_deg, rotation_deg);
  EXPECT_LT(errors.centre_max_share, share);
}

class OfAnExample : public testing::TestWithParam<const char*> {};
TEST_P(OfAnExample, TheEuclideanResultIsWithinATenthOfADegreeAndThreePerMille) {
  const std::string name = GetParam();
  const SimulatedTracks s = name == "plaza"     ? See(PlazaPath(60), PlazaPoints(900), Tracked())
                            : name == "hallway" ? See(HallwayPath(60), HallwayPoints(900), Tracked())
                                                : See(DeskPath(60), DeskPoints(300), Tracked());
  const FactorizationResult r = ReconstructFromTracks(s.tracks, s.camera, {}, SilentProgress());
  ExpectTruth(r, s);
  EXPECT_LT(r.projective_rms_px, kProjectiveRmsPx);
  EXPECT_NEAR(r.sigma_px, 0.3, 0.03);
  EXPECT_TRUE(r.missing.empty());
  EXPECT_TRUE(r.warnings.empty()) << r.warnings.front();
  for (const WindowDiagnostics& w : r.windows) EXPECT_EQ(w.outcome, "merged");
}
INSTANTIATE_TEST_SUITE_P(Simulated, OfAnExample, testing::Values("plaza", "hallway", "desk"),
                         [](const auto& p) { return std::string(p.param); });

// Tracks of three to five frames: one plane at infinity for all frames leaves errors of 10 px and more in each of
// these.
TEST(Factorization, ALongDriveInFewFramesIsMetric) {
  struct Drive {
    int track_frames;
    unsigned seed;
  };
  for (const auto& [track_frames, seed] : {Drive{4, 1}, Drive{3, 2}, Drive{5, 3}}) {
    SCOPED_TRACE(testing::Message() << "tracks of " << track_frames << " frames");
    Noise noise = Tracked();
    noise.max_track_frames = track_frames;
    noise.seed = seed;
    const SimulatedTracks s = See(DrivePath(28), DrivePoints(900), noise, test::DriveCamera());
    const FactorizationResult r = ReconstructFromTracks(s.tracks, s.camera, {}, SilentProgress());
    ASSERT_EQ(r.upgrade, UpgradeKind::kMetric) << r.upgrade_reason;
    EXPECT_TRUE(r.missing.empty());
    const PoseErrors errors = ComparePoses(r.cam_from_world, s.cam_from_world);
    EXPECT_LT(errors.rotation_rms_deg, kRotationDeg);
    EXPECT_LT(errors.centre_rms_percent, 100 * kCentreShareOfScene);
  }
}

TEST(Factorization, WithoutIntrinsicsTheSceneIsQuasiAffineAndSaysWhy) {
  const SimulatedTracks s = See(PlazaPath(40), PlazaPoints(500), Tracked());
  const FactorizationResult r = ReconstructFromTracks(s.tracks, std::nullopt, {}, SilentProgress());
  EXPECT_EQ(r.upgrade, UpgradeKind::kQuasiAffine);
  EXPECT_NE(r.upgrade_reason.find("intrinsics are not known"), std::string::npos);
  EXPECT_LT(r.rms_px, kProjectiveRmsPx);
  EXPECT_GT(r.quasi_affine_margin, 0);
  for (const FactorizationPoint& p : r.points) {
    EXPECT_GT(p.X.w(), 0);
    for (const int o : p.observations) {
      const TrackObservation& seen =
          s.tracks.tracks[static_cast<std::size_t>(p.track)].observations[static_cast<std::size_t>(o)];
      const auto x = Project(r.P[static_cast<std::size_t>(seen.frame)], p.X);
      ASSERT_TRUE(x);  // in front
      EXPECT_LT((*x - seen.x_px).norm(), 3);
    }
  }
}

TEST(Factorization, StoppingAtTheQuasiAffineFrameOnPurposeIsNoWarning) {
  const SimulatedTracks s = See(DeskPath(15), DeskPoints(150), Tracked());
  FactorizationOptions options;
  options.projective_only = true;
  const FactorizationResult r = ReconstructFromTracks(s.tracks, s.camera, options, SilentProgress());
  EXPECT_EQ(r.upgrade, UpgradeKind::kQuasiAffine);
  EXPECT_TRUE(r.warnings.empty());
}

TEST(Factorization, AFocalLengthTenPercentOffIsFoundWhereItMayBe) {
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(250), Tracked());
  Camera off = s.camera;
  for (int i = 0; i < 2; ++i) off.params[static_cast<std::size_t>(i)] *= 1.1;
  FactorizationOptions options;
  options.intrinsics = FreeIntrinsics::kFocal;
  const FactorizationResult r = ReconstructFromTracks(s.tracks, off, options, SilentProgress());
  ASSERT_EQ(r.upgrade, UpgradeKind::kMetric) << r.upgrade_reason;
  EXPECT_NEAR(r.camera->FocalPx().x(), 560, 3);
  ExpectTruth(r, s);
}

TEST(Factorization, AFocalLengthFivePercentOffIsNotSwallowedSilently) {
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(250), Tracked());
  Camera off = s.camera;
  for (int i = 0; i < 2; ++i) off.params[static_cast<std::size_t>(i)] *= 1.05;
  const FactorizationResult r = ReconstructFromTracks(s.tracks, off, {}, SilentProgress());
  ASSERT_FALSE(r.warnings.empty());
  if (r.upgrade == UpgradeKind::kMetric) {
    EXPECT_NE(r.warnings.front().find("focal length of 5"), std::string::npos) << r.warnings.front();
  }
}

TEST(Factorization, UnorderedPhotosGoByWhatTheyShare) {
  const SimulatedTracks s = test::InNoOrder(See(DeskPath(30, 120), DeskPoints(300), Tracked()));
  FactorizationOptions options;
  options.windows.ordered = false;
  options.windows.length = 12;
  options.windows.overlap = 6;
  ExpectTruth(ReconstructFromTracks(s.tracks, s.camera, options, SilentProgress()), s);
}

TEST(Factorization, DistortionOfTheCameraIsTakenOutFirst) {
  Camera bent = test::TrueCamera();
  bent.model = CameraModel::kRadial;
  bent.params = {560, 322.5, 238.5, -0.15, 0.03};
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(250), Tracked(), bent);
  const FactorizationResult r = ReconstructFromTracks(s.tracks, bent, {}, SilentProgress());
  ExpectTruth(r, s);
  EXPECT_TRUE(r.camera->IsPinhole());
}

TEST(Factorization, TheSameSeedGivesTheSameNumbers) {
  Noise noise = Tracked();
  noise.outliers = 0.1;
  const SimulatedTracks s = See(PlazaPath(30), PlazaPoints(400), noise);
  const FactorizationResult a = ReconstructFromTracks(s.tracks, s.camera, {}, SilentProgress());
  const FactorizationResult b = ReconstructFromTracks(s.tracks, s.camera, {}, SilentProgress());
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t f = 0; f < a.P.size(); ++f) EXPECT_EQ(a.P[f], b.P[f]);
  for (std::size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(a.points[i].X, b.points[i].X);
}

TEST(Factorization, ASceneHasSortedViewsAndPointsInPixelsOfTheirPhotos) {
  const SimulatedTracks s = See(DeskPath(15), DeskPoints(150), Tracked());
  const FactorizationResult r = ReconstructFromTracks(s.tracks, s.camera, {}, SilentProgress());
  const Scene scene = ToScene(r, s.tracks);
  ASSERT_EQ(scene.frame, Frame::kMetric);
  ASSERT_EQ(scene.views.size(), 15U);
  EXPECT_TRUE(std::is_sorted(scene.views.begin(), scene.views.end(),
                             [](const View& a, const View& b) { return a.name < b.name; }));
  ASSERT_GT(scene.points.size(), 100U);
  for (const Point& p : scene.points)
    for (const Observation& o : p.track) {
      const View& view = scene.views[static_cast<std::size_t>(o.view.value)];
      const auto x = scene.CameraOf(view).Project(view.cam_from_world * p.x_in_world);
      ASSERT_TRUE(x);
      EXPECT_LT((*x - o.x_px).norm(), 3);
    }
  EXPECT_GT(scene.up.dot(Eigen::Vector3d(r.cam_from_world[7].R().transpose() * -Eigen::Vector3d::UnitY())), 0.5);
}

TEST(Factorization, OptionsThatMakeNoSenseAreRefused) {
  const SimulatedTracks s = See(DeskPath(3), DeskPoints(30), {});
  FactorizationOptions options;
  options.windows.overlap = 20;
  EXPECT_THROW(ReconstructFromTracks(s.tracks, s.camera, options, SilentProgress()), UsageError);
  Camera wrong = s.camera;
  wrong.params[0] = NAN;
  EXPECT_THROW(ReconstructFromTracks(s.tracks, wrong, {}, SilentProgress()), UsageError);
}

}  // namespace
}  // namespace lumi
