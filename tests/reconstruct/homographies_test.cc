// Frames without structure, related by homographies.
#include <gtest/gtest.h>

#include "scene/files/projective_json.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/parallel.h"
#include "turning_scenes.h"

namespace lumi {
namespace {

using namespace test;

constexpr double kNeighbourPx = 0.15;  // between neighbours, of 0.3 px of noise in each of some 200 sights
constexpr double kFarPx = 0.6;         // thirty frames apart, most tracks having been replaced

FactorizationResult Related(const TurningVideo& turning) {
  const FactorizationResult r = ReconstructByHomographies(turning.sight.tracks, {}, SilentProgress());
  EXPECT_EQ(r.upgrade, UpgradeKind::kQuasiAffine);
  EXPECT_EQ(std::count(r.placed.begin(), r.placed.end(), 1), static_cast<long>(turning.G.size()));
  // One centre, and w > 0 in front: of every point, in every frame that sees it.
  for (const Matrix34d& P : r.P) EXPECT_EQ(P.col(3).norm(), 0);
  for (const FactorizationPoint& p : r.points) {
    EXPECT_GT(p.X.w(), 0);
    for (const int o : p.observations) {
      const int f = turning.sight.tracks.tracks[static_cast<std::size_t>(p.track)]
                        .observations[static_cast<std::size_t>(o)]
                        .frame;
      EXPECT_GT(r.P[static_cast<std::size_t>(f)].row(2).dot(p.X), 0);
    }
  }
  return r;
}

TEST(HardCase, ACameraThatTurnsIsFollowedByHomographies) {
  for (const double pan_deg : {5.0, 30.0, 140.0, 300.0}) {  // beyond 90 degrees nothing seen first is in front any more
    TurningOptions o;
    o.pan_deg = pan_deg;
    o.points = static_cast<int>(400 + 8 * pan_deg);
    const TurningVideo turning = Turn(o);
    const FactorizationResult r = Related(turning);
    EXPECT_TRUE(r.missing.empty());
    EXPECT_LT(TransferErrorPx(turning, r, 1), kNeighbourPx) << pan_deg;
    EXPECT_LT(TransferErrorPx(turning, r, std::min<std::size_t>(30, static_cast<std::size_t>(1500 / pan_deg))), kFarPx)
        << pan_deg;
    EXPECT_NEAR(r.rms_px, 0.3 * std::sqrt(2.0), 0.05);
  }
}

TEST(HardCase, NoiseFreeTurnsAreExact) {
  TurningOptions o;
  o.noise_px = 0;
  o.zoom = 1.5;
  const TurningVideo turning = Turn(o);
  EXPECT_LT(TransferErrorPx(turning, Related(turning), 20), 1e-3);
}

TEST(HardCase, AZoomIsAHomographyToo) {
  TurningOptions o;
  o.pan_deg = 8;
  o.zoom = 2;
  const TurningVideo turning = Turn(o);
  const FactorizationResult r = Related(turning);
  EXPECT_LT(TransferErrorPx(turning, r, 1), 1.5 * kNeighbourPx);  // the noise is zoomed with the picture
  EXPECT_LT(TransferErrorPx(turning, r, 30), 1.5 * kFarPx);
}

TEST(HardCase, FortyPercentOfTheTracksMoveByThemselves) {
  TurningOptions o;
  o.movers = 0.4;
  o.points = 900;
  const TurningVideo turning = Turn(o);
  const FactorizationResult r = Related(turning);
  EXPECT_LT(TransferErrorPx(turning, r, 1), 1.5 * kNeighbourPx);
  EXPECT_LT(TransferErrorPx(turning, r, 30), 1.5 * kFarPx);
  EXPECT_GT(r.culled, 1000);
}

TEST(HardCase, ATripodIsTheIdentity) {
  TurningOptions o;
  o.pan_deg = 0;
  o.shake_rad = 0;
  o.noise_px = 0.1;
  const TurningVideo turning = Turn(o);
  const FactorizationResult r = Related(turning);
  EXPECT_LT(TransferErrorPx(turning, r, 1), 0.1);
  EXPECT_LT(TransferErrorPx(turning, r, 50), 0.2);
}

TEST(HardCase, FramesThatShareNothingStayAndAreNamed) {
  TurningOptions o;
  o.frames = 40;
  TurningVideo turning = Turn(o);
  // Frames 20 to 25 are black: no track lives through them.
  std::vector<Track> cut;
  for (const Track& track : turning.sight.tracks.tracks) {
    Track before = track, after = track;
    std::erase_if(before.observations, [](const TrackObservation& x) { return x.frame >= 20; });
    std::erase_if(after.observations, [](const TrackObservation& x) { return x.frame <= 25; });
    for (const Track& part : {before, after})
      if (part.observations.size() >= 2) cut.push_back(part);
  }
  turning.sight.tracks.tracks = cut;
  FactorizationResult r = Related(turning);
  EXPECT_EQ(r.missing.size(), 7U);  // the six, and the first one after them that has nobody to ask
  for (const MissingFrame& m : r.missing) EXPECT_NE(m.reason.find("too few features"), std::string::npos);
  const std::size_t before = turning.sight.tracks.tracks.size();
  Tracks tracks = turning.sight.tracks;
  EXPECT_GE(AddDirectionsWhereBlank(r, tracks), 24);
  EXPECT_GT(tracks.tracks.size(), before);
  std::vector<int> seen(40, 0);
  for (const FactorizationPoint& p : r.points)
    for (const int k : p.observations) {
      const TrackObservation& x =
          tracks.tracks[static_cast<std::size_t>(p.track)].observations[static_cast<std::size_t>(k)];
      ++seen[static_cast<std::size_t>(x.frame)];
      const Eigen::Vector3d q = r.P[static_cast<std::size_t>(x.frame)] * p.X;
      EXPECT_LT((q.hnormalized() - x.x_px).norm(), 4.01);
    }
  for (const int n : seen) EXPECT_GE(n, 20);
  EXPECT_EQ(AddDirectionsWhereBlank(r, tracks), 0);  // once is enough
}

TEST(HardCase, WithoutASingleTrackFramesPassThrough) {
  for (const int frames : {1, 2, 25}) {
    Tracks tracks;
    for (int f = 0; f < frames; ++f) tracks.frames.push_back({"frame" + std::to_string(100 + f) + ".png", {640, 480}});
    FactorizationResult r = ReconstructByHomographies(tracks, {}, SilentProgress());
    ASSERT_EQ(r.P.size(), static_cast<std::size_t>(frames));
    for (const Matrix34d& P : r.P) EXPECT_TRUE(P.isApprox(r.P[0]));
    AddDirectionsWhereBlank(r, tracks);
    EXPECT_EQ(r.points.empty(), frames == 1);
    const Scene scene = ToScene(r, tracks);
    for (std::size_t v = 0; v < scene.views.size() && frames > 1; ++v)
      EXPECT_GE(std::count_if(scene.points.begin(), scene.points.end(),
                              [&](const Point& p) {
                                return std::any_of(p.track.begin(), p.track.end(), [&](const Observation& o) {
                                  return o.view.value == static_cast<int>(v);
                                });
                              }),
                24);
  }
  EXPECT_THROW(ReconstructByHomographies({}, {}, SilentProgress()), DataError);
}

TEST(HardCase, AResultIsTheSameOnAnyNumberOfThreads) {
  TurningOptions o;
  o.frames = 30;
  const TurningVideo turning = Turn(o);
  const FactorizationResult a = Related(turning);
  SetThreadCount(1);
  const FactorizationResult b = Related(turning);
  SetThreadCount(0);
  for (std::size_t f = 0; f < a.P.size(); ++f) EXPECT_EQ(a.P[f], b.P[f]);
}

TEST(HardCase, HomographiesSurviveTheirFile) {
  TurningOptions o;
  o.frames = 20;
  const TurningVideo turning = Turn(o);
  const FactorizationResult r = Related(turning);
  const Scene scene = ToScene(r, turning.sight.tracks);
  const TemporaryFolder folder;
  WriteProjectiveJson(scene, folder / "projective.json");
  const Scene back = ReadProjectiveJson(folder / "projective.json");
  ASSERT_EQ(back.views.size(), scene.views.size());
  ASSERT_EQ(back.points.size(), scene.points.size());
  for (std::size_t v = 0; v < scene.views.size(); ++v) EXPECT_TRUE(back.views[v].P.isApprox(scene.views[v].P, 0));
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    EXPECT_TRUE(back.points[p].X_in_world.isApprox(scene.points[p].X_in_world, 0));
  EXPECT_TRUE(back.plane_at_infinity->isApprox(Eigen::Vector4d(0, 0, 0, 1)));
}

}  // namespace
}  // namespace lumi
