// Where projective factorisation has no answer, or hardly one: each ends in a right answer or a named refusal.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "factorization_errors.h"

namespace lumi {
namespace {

using test::DeskPath;
using test::DeskPoints;
using test::ErrorsAgainst;
using test::HallwayPath;
using test::HallwayPoints;
using test::Noise;
using test::PlazaPath;
using test::PlazaPoints;
using test::See;
using test::SimulatedTracks;
using test::Tracked;

constexpr double kNoisePx = 0.3;      // Tracked()'s
constexpr double kRotationDeg = 0.1;  // what is promised of ordinary scenes
constexpr double kCentreShareOfScene = 0.003;

struct Outcome {
  std::optional<FactorizationResult> result;
  std::optional<FactorizationRefusal> refusal;
  std::string message;
};
Outcome Reconstruct(const SimulatedTracks& s, const std::optional<Camera>& camera,
                    const FactorizationOptions& options = {}) {
  Outcome outcome;
  try {
    outcome.result = ReconstructFromTracks(s.tracks, camera, options, SilentProgress());
  } catch (const FactorizationRefused& e) {
    outcome.refusal = e.refusal;
    outcome.message = e.what();
    EXPECT_EQ(outcome.message.find(Name(e.refusal)), 0U);
    EXPECT_FALSE(e.hint().empty());
  }
  if (outcome.result) {
    const FactorizationResult& r = *outcome.result;
    for (std::size_t f = 0; f < r.placed.size(); ++f)
      if (r.placed[f]) {
        EXPECT_TRUE(r.P[f].allFinite());
      }
    for (const FactorizationPoint& p : r.points) EXPECT_TRUE(p.X.allFinite());
    if (r.upgrade != UpgradeKind::kMetric) {
      EXPECT_FALSE(r.upgrade_reason.empty());
    }
  }
  return outcome;
}

void ExpectTruth(const Outcome& outcome, const SimulatedTracks& s, double rotation_deg = kRotationDeg,
                 double share = kCentreShareOfScene) {
  ASSERT_TRUE(outcome.result) << outcome.message;
  const FactorizationResult& r = *outcome.result;
  ASSERT_EQ(r.upgrade, UpgradeKind::kMetric) << r.upgrade_reason;
  const test::TruthErrors errors = ErrorsAgainst(s, r);
  EXPECT_EQ(errors.placed, s.cam_from_world.size());
  EXPECT_LT(errors.neighbour_rotation_max_deg, rotation_deg);
  EXPECT_LT(errors.centre_max_share, share);
}

void ExpectRefusal(const Outcome& outcome, FactorizationRefusal expected) {
  ASSERT_TRUE(outcome.refusal) << (outcome.result ? std::string(Name(outcome.result->upgrade)) + " " +
                                                        outcome.result->upgrade_reason
                                                  : "");
  EXPECT_EQ(*outcome.refusal, expected) << outcome.message;
}

std::vector<Rigid3> Turning(int frames) {
  std::vector<Rigid3> path = PlazaPath(frames);
  for (Rigid3& pose : path) pose.translation.setZero();
  return path;
}

TEST(HardCase, NoiseFreeTracksGiveTheTruthToRounding) {
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(200), {});
  const Outcome outcome = Reconstruct(s, s.camera);
  ExpectTruth(outcome, s, 1e-5, 1e-7);
  EXPECT_LT(outcome.result->rms_px, 1e-4);
}

TEST(HardCase, TwoPixelsOfNoiseAreAnsweredWithTwoPixelsAccuracy) {
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(300), Tracked(2));
  ExpectTruth(Reconstruct(s, s.camera), s, 7 * kRotationDeg, 7 * kCentreShareOfScene);
}

TEST(HardCase, PureRotationIsRefusedByName) {
  for (const double outliers : {0.0, 0.2}) {
    Noise noise = Tracked();
    noise.outliers = outliers;
    const SimulatedTracks s = See(Turning(30), PlazaPoints(500), noise);
    ExpectRefusal(Reconstruct(s, s.camera), FactorizationRefusal::kPureRotation);
    ExpectRefusal(Reconstruct(s, std::nullopt), FactorizationRefusal::kPureRotation);
  }
}

TEST(HardCase, APlanarSceneIsRefusedByName) {
  auto flat = PlazaPoints(500);
  for (auto& x : flat) x.z() = 8;
  for (const double outliers : {0.0, 0.4}) {
    Noise noise = Tracked();
    noise.outliers = outliers;
    const SimulatedTracks s = See(PlazaPath(30), flat, noise);
    ExpectRefusal(Reconstruct(s, s.camera), FactorizationRefusal::kPlanarScene);
    ExpectRefusal(Reconstruct(s, std::nullopt), FactorizationRefusal::kPlanarScene);
  }
}

TEST(HardCase, ACameraThatDoesNotMoveIsRefusedByName) {
  const SimulatedTracks s = See(std::vector<Rigid3>(10, PlazaPath(1)[0]), PlazaPoints(200), Tracked(0.1));
  ExpectRefusal(Reconstruct(s, s.camera), FactorizationRefusal::kNoMotion);
}

// Thinner and thinner scenes, shorter and shorter baselines: right, or named; nothing between.
TEST(HardCase, TowardsAPlaneStepByStep) {
  for (const double sigma : {0.0, kNoisePx})
    for (const double thickness : {1.0, 1e-1, 1e-2, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
      SCOPED_TRACE(testing::Message() << "thickness " << thickness << " noise " << sigma);
      auto points = PlazaPoints(300);
      for (auto& x : points) x.z() = 8 + thickness * (x.z() - 8);
      const SimulatedTracks s = See(PlazaPath(20), points, Tracked(sigma));
      const Outcome outcome = Reconstruct(s, s.camera);
      if (outcome.refusal) {
        EXPECT_EQ(*outcome.refusal, FactorizationRefusal::kPlanarScene);
        EXPECT_LT(thickness, 0.5);
      } else if (outcome.result->upgrade == UpgradeKind::kMetric) {
        EXPECT_LT(ErrorsAgainst(s, *outcome.result).neighbour_rotation_max_deg,
                  thickness == 1 ? kRotationDeg : 5 * kRotationDeg);
      }
    }
}

TEST(HardCase, TowardsPureRotationStepByStep) {
  for (const double sigma : {0.0, kNoisePx})
    for (const double baseline : {1.0, 1e-1, 1e-2, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
      SCOPED_TRACE(testing::Message() << "baseline " << baseline << " noise " << sigma);
      std::vector<Rigid3> path = PlazaPath(20);
      for (Rigid3& pose : path) pose.translation *= baseline;
      const SimulatedTracks s = See(path, PlazaPoints(300), Tracked(sigma));
      const Outcome outcome = Reconstruct(s, s.camera);
      if (outcome.refusal) {
        EXPECT_TRUE(*outcome.refusal == FactorizationRefusal::kPureRotation ||
                    *outcome.refusal == FactorizationRefusal::kPlanarScene);
        EXPECT_LT(baseline, 0.5);
      } else if (outcome.result->upgrade == UpgradeKind::kMetric) {
        EXPECT_LT(ErrorsAgainst(s, *outcome.result).neighbour_rotation_max_deg,
                  baseline == 1 ? kRotationDeg : 5 * kRotationDeg);
      }
    }
}

TEST(HardCase, ForwardMotionWithTheEpipoleInView) {
  const SimulatedTracks s = See(HallwayPath(40), HallwayPoints(600), Tracked());
  ExpectTruth(Reconstruct(s, s.camera), s);
  // Straight ahead without any turn: the epipole is one and the same pixel throughout.
  std::vector<Rigid3> straight;
  for (int i = 0; i < 30; ++i)
    straight.push_back(LookAt({0, 0, 0.2 * i}, {0, 0, 0.2 * i + 1}, -Eigen::Vector3d::UnitY()));
  const SimulatedTracks t = See(straight, HallwayPoints(600), Tracked());
  ExpectTruth(Reconstruct(t, t.camera), t);
}

TEST(HardCase, TwoFrames) {
  const SimulatedTracks s = See(DeskPath(2, 20), DeskPoints(200), Tracked());
  ExpectTruth(Reconstruct(s, s.camera), s, 5 * kRotationDeg, 5 * kCentreShareOfScene);
}

TEST(HardCase, WindowsOfTwoFrames) {
  const SimulatedTracks s = See(DeskPath(10, 60), DeskPoints(250), Tracked());
  FactorizationOptions options;
  options.windows.length = 2;
  options.windows.overlap = 1;
  ExpectTruth(Reconstruct(s, s.camera, options), s);
}

TEST(HardCase, SeventyPercentMissing) {
  Noise noise = Tracked();
  noise.missing = 0.7;
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(400), noise);
  ExpectTruth(Reconstruct(s, s.camera), s, 2 * kRotationDeg);  // a third of the sights
}

TEST(HardCase, FortyPercentOutliers) {
  Noise noise = Tracked();
  noise.outliers = 0.4;
  const SimulatedTracks desk = See(DeskPath(20), DeskPoints(300), noise);
  ExpectTruth(Reconstruct(desk, desk.camera), desk);
  const SimulatedTracks plaza = See(PlazaPath(30), PlazaPoints(500), noise);
  ExpectTruth(Reconstruct(plaza, plaza.camera), plaza);
}

TEST(HardCase, AFocalLengthWrongByAThousandIsNamedAndTheSceneStaysQuasiAffine) {
  const SimulatedTracks s = See(DeskPath(20), DeskPoints(200), Tracked());
  for (const double factor : {1e-3, 1e3}) {
    Camera wrong = s.camera;
    for (std::size_t i = 0; i < 2; ++i) wrong.params[i] *= factor;
    const Outcome outcome = Reconstruct(s, wrong);
    ASSERT_TRUE(outcome.result) << outcome.message;
    EXPECT_EQ(outcome.result->upgrade, UpgradeKind::kQuasiAffine);
    EXPECT_LT(outcome.result->rms_px, 0.5);
    EXPECT_TRUE(outcome.result->upgrade_reason.find("intrinsics") != std::string::npos ||
                outcome.result->upgrade_reason.find("ill-conditioned") != std::string::npos)
        << outcome.result->upgrade_reason;
    EXPECT_FALSE(outcome.result->warnings.empty());
  }
}

TEST(HardCase, AHugeOffsetOfThePixelsChangesNothing) {
  for (const double offset : {1e4, 1e7, 1e9}) {
    Noise noise = Tracked();
    noise.offset_px = {offset, -2 * offset};
    const SimulatedTracks s = See(DeskPath(15), DeskPoints(200), noise);
    ExpectTruth(Reconstruct(s, s.camera), s);
  }
}

TEST(HardCase, IdenticalFramesInARow) {
  std::vector<Rigid3> path = PlazaPath(60);
  for (std::size_t i = 20; i < 45; ++i) path[i] = path[20];
  const SimulatedTracks s = See(path, PlazaPoints(600), Tracked());
  ExpectTruth(Reconstruct(s, s.camera), s);
  // The very same tracks too, without noise: cameras that coincide to rounding.
  const SimulatedTracks exact = See(path, PlazaPoints(300), {});
  ExpectTruth(Reconstruct(exact, exact.camera), exact);
}

TEST(HardCase, PointsAtInfinityStayThere) {
  auto points = PlazaPoints(300);
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  for (int i = 0; i < 60; ++i) points.emplace_back(uniform(random), 0.5 * uniform(random), 1, 0);
  const SimulatedTracks s = See(PlazaPath(25), points, Tracked());
  const Outcome outcome = Reconstruct(s, s.camera);
  ExpectTruth(outcome, s);
  int at_infinity = 0;
  for (const FactorizationPoint& p : outcome.result->points)
    if (s.x_in_world[static_cast<std::size_t>(p.track)].w() == 0) {
      ++at_infinity;
      // Farther than a hundred times the walk's length, on either side of infinity.
      EXPECT_LT(std::abs(p.X.w()) * (outcome.result->cam_from_world.front().OriginInSource() -
                                     outcome.result->cam_from_world.back().OriginInSource())
                                        .norm(),
                0.01 * p.X.head<3>().norm());
    }
  EXPECT_GT(at_infinity, 50);
  for (const Point& p : ToScene(*outcome.result, s.tracks).points) EXPECT_TRUE(p.x_in_world.allFinite());
}

TEST(HardCase, OnlyPointsAtInfinityAreAPureRotation) {
  std::mt19937_64 random(29);
  std::uniform_real_distribution<double> uniform(-0.6, 0.6);
  std::vector<Eigen::Vector4d> stars;
  for (int i = 0; i < 300; ++i) stars.emplace_back(uniform(random), uniform(random), 1, 0);
  const SimulatedTracks s = See(PlazaPath(20), stars, Tracked());
  ExpectRefusal(Reconstruct(s, s.camera), FactorizationRefusal::kPureRotation);
}

TEST(HardCase, ACameraThatTurnsFullCircle) {
  // Around the things, looking inwards ...
  const SimulatedTracks around = See(DeskPath(60, 360), DeskPoints(250), Tracked());
  ExpectTruth(Reconstruct(around, around.camera), around);
  // ... and around itself on a small circle, looking outwards: points on all sides.
  std::vector<Rigid3> path;
  for (int i = 0; i < 90; ++i) {
    const double a = 2 * M_PI * i / 90;
    const Eigen::Vector3d eye(1.5 * std::sin(a), 0.1 * std::sin(5 * a), -1.5 * std::cos(a));
    path.push_back(LookAt(eye, 4 * eye, -Eigen::Vector3d::UnitY()));
  }
  const SimulatedTracks outwards = See(path, test::PointsInBox({-8, -3, -8}, {8, 3, 8}, 3000, 31), Tracked());
  ExpectTruth(Reconstruct(outwards, outwards.camera), outwards);
}

TEST(HardCase, ConstantOrientationIsSolvedWithKnownIntrinsicsAndNamedWithout) {
  const SimulatedTracks s = See(test::WithoutTurning(PlazaPath(30)), PlazaPoints(500), Tracked());
  ExpectTruth(Reconstruct(s, s.camera), s);
  const Outcome unknown = Reconstruct(s, std::nullopt);
  ASSERT_TRUE(unknown.result) << unknown.message;
  EXPECT_EQ(unknown.result->upgrade, UpgradeKind::kQuasiAffine);
  EXPECT_NE(unknown.result->upgrade_reason.find("constant orientation"), std::string::npos)
      << unknown.result->upgrade_reason;
}

TEST(HardCase, NothingNothingToSeeAndNonsense) {
  const Tracks empty;
  EXPECT_THROW(ReconstructFromTracks(empty, std::nullopt, {}, SilentProgress()), FactorizationRefused);
  SimulatedTracks few = See(DeskPath(5), DeskPoints(10), {});
  ExpectRefusal(Reconstruct(few, few.camera), FactorizationRefusal::kTooFewTracks);
  // Tracks that are noise only: refused, by whatever name; never an answer.
  std::mt19937_64 random(37);
  std::uniform_real_distribution<double> uniform(0, 480);
  SimulatedTracks noise = See(DeskPath(8), DeskPoints(150), {});
  for (Track& track : noise.tracks.tracks)
    for (auto& o : track.observations) o.x_px = {uniform(random), uniform(random)};
  const Outcome outcome = Reconstruct(noise, noise.camera);
  EXPECT_TRUE(outcome.refusal || outcome.result->upgrade != UpgradeKind::kMetric ||
              outcome.result->missing.size() >= 6);
}

// A stroll filmed by hand: neighbours show hardly any parallax, and many tracks last as long as the video.
SimulatedTracks Stroll(int frames) {
  std::vector<Rigid3> path;
  for (int i = 0; i < frames; ++i) {
    const double s = i / static_cast<double>(frames - 1);
    const Eigen::Vector3d eye(0.5 * s, 0.01 * std::sin(1.1 * i), 0.1 * std::sin(4 * s)),
        shake(0.3 * std::sin(0.7 * i), 0.2 * std::cos(0.9 * i), 9);
    path.push_back(LookAt(eye, shake, Eigen::Vector3d(0.02 * std::sin(0.5 * i), -1, 0)));
  }
  return See(path, PlazaPoints(900), Tracked(0.2, 350));
}

TEST(HardCase, AStrollsWindowsLeaveFramesOutAndAllFramesArePlaced) {
  const SimulatedTracks s = Stroll(130);
  FactorizationOptions options;
  options.projective_only = true;
  const Outcome outcome = Reconstruct(s, std::nullopt, options);
  ASSERT_TRUE(outcome.result) << outcome.message;
  const FactorizationResult& r = *outcome.result;
  EXPECT_EQ(r.upgrade, UpgradeKind::kQuasiAffine) << r.upgrade_reason;
  EXPECT_TRUE(r.missing.empty());
  for (const WindowDiagnostics& w : r.windows) EXPECT_LE(w.frames, 61);
  EXPECT_LT(r.sigma_px, 0.22);  // 0.2 px of noise
}

TEST(HardCase, AStrollIsMetricWithItsCamera) {
  const SimulatedTracks s = Stroll(130);
  const Outcome outcome = Reconstruct(s, s.camera);
  ExpectTruth(outcome, s, 0.02, 0.0005);
}

TEST(HardCase, AVideoInTwoPartsGivesTheLargerOneAndNamesTheRest) {
  // A cut after 25 of 40 frames: no track crosses it.
  const SimulatedTracks first = See(PlazaPath(25), PlazaPoints(400), Tracked());
  const SimulatedTracks second = See(DeskPath(15), DeskPoints(150), Tracked());
  SimulatedTracks both = first;
  for (const auto& frame : second.tracks.frames) both.tracks.frames.push_back({"z" + frame.name, frame.size_px});
  for (Track track : second.tracks.tracks) {
    for (auto& o : track.observations) o.frame += 25;
    both.tracks.tracks.push_back(track);
  }
  both.cam_from_world.insert(both.cam_from_world.end(), second.cam_from_world.begin(), second.cam_from_world.end());
  const Outcome outcome = Reconstruct(both, both.camera);
  ASSERT_TRUE(outcome.result) << outcome.message;
  EXPECT_EQ(outcome.result->upgrade, UpgradeKind::kMetric);
  EXPECT_EQ(outcome.result->missing.size(), 15U);
  for (const MissingFrame& m : outcome.result->missing) EXPECT_FALSE(m.reason.empty());
  EXPECT_FALSE(outcome.result->warnings.empty());
}

}  // namespace
}  // namespace lumi
