// Cameras planted where they do not belong, in models that are right otherwise: each is found, and right ones stay.
#include "reconstruct/standing.h"

#include <gmock/gmock.h>

#include <random>

#include "database_fixture.h"
#include "scene/geometry/angle.h"
#include "watched_world.h"

namespace lumi {
namespace {

double CentreError(const View& a, const View& b) { return (a.CentreInWorld() - b.CentreInWorld()).norm(); }
double TurnErrorDeg(const View& a, const View& b) {
  return a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation) * kDegPerRad;
}

// Named, placed anew near the truth, or left out.
bool Found(const VerifiedCameras& verified, const View& truth, double centre, double turn_deg) {
  if (std::ranges::any_of(verified.left_out, [&](const MissingPhoto& m) { return m.name == truth.name; })) return true;
  for (const CameraStanding& s : verified.standings)
    if (s.name == truth.name && !s.remark.empty()) return true;
  for (const View& view : verified.scene.views)
    if (view.name == truth.name) return CentreError(view, truth) < centre && TurnErrorDeg(view, truth) < turn_deg;
  return false;
}

// Right to the noise: half a pixel of 560 over dozens of points.
constexpr double kRightCentre = 0.04, kRightTurnDeg = 0.3;

TEST(CameraStanding, RightCamerasStay) {
  std::mt19937 random(3);
  for (const WatchedWorld& world : {Ring(24, random), Drive(30, random)}) {
    const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
    EXPECT_FALSE(verified.changed);
    EXPECT_TRUE(verified.left_out.empty());
    ASSERT_EQ(verified.standings.size(), world.scene.views.size());
    for (const CameraStanding& s : verified.standings) {
      EXPECT_EQ(s.remark, "") << s.name;
      EXPECT_GT(s.points, 100) << s.name;
      EXPECT_GE(s.offered, s.points);
      ASSERT_TRUE(s.sigma_percent);
      EXPECT_LT(*s.sigma_percent, 0.5) << s.name;
    }
    for (std::size_t i = 1; i < verified.standings.size(); ++i)
      EXPECT_LE(verified.standings[i].sigma_percent, verified.standings[i - 1].sigma_percent);
  }
}

// The stated standard deviation is that of the centres which noise alone gives: poses found anew from the points.
TEST(CameraStanding, TheUncertaintyIsTheSpreadOverNoise) {
  std::vector<double> ratios;
  double stated = 0, squares = 0;
  constexpr int kDraws = 12;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::mt19937 random(50 + draw);
    WatchedWorld world = Ring(12, random);
    const Rigid3 truth = world.scene.views[5].cam_from_world;
    world.scene.views[5].cam_from_world.translation.x() += 1;
    const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
    ASSERT_TRUE(verified.changed);
    for (const CameraStanding& s : verified.standings)
      if (s.name == world.scene.views[5].name) {
        ASSERT_TRUE(s.sigma_percent);
        stated += *s.sigma_percent / 100 * 8 / kDraws;  // the extent: the ring's diameter
      }
    squares += (verified.scene.views[5].CentreInWorld() - truth.OriginInSource()).squaredNorm() / kDraws;
  }
  // 36 numbers determine a standard deviation to 12 %; the points' own errors, which the figure leaves out, add a
  // third.
  EXPECT_GT(stated / std::sqrt(squares), 0.55);
  EXPECT_LT(stated / std::sqrt(squares), 1.3);
}

enum class Planted { kMoved, kTurned, kMirrored, kSwapped };

TEST(CameraStanding, PlantedCamerasAreFound) {
  int planted = 0, found = 0, wronged = 0;
  for (int trial = 0; trial < 100; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    const bool ring = trial % 2 == 0;
    WatchedWorld world = ring ? Ring(12, random) : Drive(20, random);
    const std::vector<View> truth = world.scene.views;
    const double extent = ring ? 8 : 23;
    const std::size_t v = random() % truth.size();
    std::size_t other = v;
    View& view = world.scene.views[v];
    std::normal_distribution<double> normal;
    const Eigen::Vector3d any = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    switch (static_cast<Planted>(trial / 2 % 4)) {
      case Planted::kMoved: {
        const double by = extent * std::uniform_real_distribution<>(0.02, 1)(random);
        // Half of them along the road, where no epipolar line tells.
        const Eigen::Vector3d where = trial % 3 == 0 ? Eigen::Vector3d::UnitZ() : any;
        view.cam_from_world.translation -= view.cam_from_world.R() * (by * where);
        break;
      }
      case Planted::kTurned: {
        const Eigen::Vector3d centre = view.CentreInWorld();
        const double angle = std::uniform_real_distribution<>(1, 180)(random) * kRadPerDeg;
        view.cam_from_world.rotation = Eigen::AngleAxisd(angle, any) * view.cam_from_world.rotation;
        view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
        break;
      }
      case Planted::kMirrored: {  // on the other side of what it looks at
        const Eigen::Vector3d at =
            ring ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(view.CentreInWorld() + Eigen::Vector3d(0, 0, 10));
        view.cam_from_world = LookAt(2 * at - view.CentreInWorld(), at, -Eigen::Vector3d::UnitY());
        break;
      }
      case Planted::kSwapped:
        other = (v + 1 + random() % (truth.size() - 1)) % truth.size();
        std::swap(view.cam_from_world, world.scene.views[other].cam_from_world);
        break;
    }
    const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
    for (const std::size_t bad : std::set<std::size_t>{v, other}) {
      ++planted;
      const bool was_found = Found(verified, truth[bad], kRightCentre, kRightTurnDeg);
      found += was_found;
      if (!was_found) std::cout << "trial " << trial << ": photo " << bad << " was not found\n";
    }
    for (std::size_t i = 0; i < truth.size(); ++i)
      if (i != v && i != other && (verified.left_out.size() > 1 || [&] {
            for (const View& w : verified.scene.views)
              if (w.name == truth[i].name) return CentreError(w, truth[i]) > kRightCentre;
            return true;
          }()))
        ++wronged;
  }
  std::cout << found << " of " << planted << " planted cameras found, " << wronged << " right ones changed\n";
  EXPECT_GE(found, 0.99 * planted);
  EXPECT_EQ(wronged, 0);
}

// A first photo that shares little: what it shares decides whether it is placed or left out.
TEST(CameraStanding, AFirstPhotoThatSharesLittle) {
  for (const int shared : {11, 60}) {
    std::mt19937 random(9);
    WatchedWorld world = Drive(30, random);
    const View truth = world.scene.views[0];
    // Of its observations only some stay, and it hangs on these 39 m off, as a mapper may leave it.
    int left = shared;
    for (Point& point : world.scene.points)
      std::erase_if(point.track, [&](const Observation& o) { return o.view.value == 0 && --left < 0; });
    left = shared;
    std::set<std::pair<double, double>> stay;
    for (ViewMatches& m : world.matches)
      if (m.a.value == 0)
        std::erase_if(m.px, [&](const auto& px) {
          if (stay.contains({px.first.x(), px.first.y()})) return false;
          if (static_cast<int>(stay.size()) >= shared) return true;
          stay.emplace(px.first.x(), px.first.y());
          return false;
        });
    world.scene.views[0].cam_from_world.translation.z() += 39;
    const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
    EXPECT_TRUE(verified.changed);
    if (shared == 11) {
      ASSERT_EQ(verified.left_out.size(), 1U);
      EXPECT_EQ(verified.left_out[0].name, truth.name);
      EXPECT_THAT(verified.left_out[0].reason, testing::HasSubstr("points that other photos hold"));
      EXPECT_EQ(verified.scene.views.size(), 29U);
      for (const Point& point : verified.scene.points)
        for (const Observation& o : point.track) EXPECT_LT(o.view.value, 29);
    } else {
      EXPECT_TRUE(verified.left_out.empty());
      EXPECT_LT(CentreError(verified.scene.views[0], truth), 10 * kRightCentre);
    }
  }
}

// A photo that shares hundreds of points with one neighbour, and few with any two, is named and stays.
TEST(CameraStanding, APhotoWithTwoViewPointsStaysAndIsNamed) {
  std::mt19937 random(5);
  WatchedWorld world = Drive(24, random);
  const auto last = static_cast<std::int32_t>(world.scene.views.size()) - 1;
  for (Point& point : world.scene.points) {
    const bool held = std::ranges::any_of(point.track, [&](const Observation& o) { return o.view.value == last; });
    if (held) std::erase_if(point.track, [&](const Observation& o) { return o.view.value < last - 1; });
  }
  std::erase_if(world.scene.points, [](const Point& p) { return p.track.size() < 2; });
  const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
  EXPECT_TRUE(verified.left_out.empty());
  EXPECT_EQ(verified.scene.views.size(), world.scene.views.size());
  ASSERT_FALSE(verified.standings.empty());
  EXPECT_EQ(verified.standings.front().name, world.scene.views.back().name);
  EXPECT_NE(verified.standings.front().remark, "");
}

// Two or three photos: no point is held by two others, so nothing can be said, and nothing is.
TEST(CameraStanding, FewPhotosAreLeftAsTheyAre) {
  for (const int views : {2, 3}) {
    std::mt19937 random(5);
    WatchedWorld world = Ring(30, random);
    world.scene.views.resize(static_cast<std::size_t>(views));
    for (Point& point : world.scene.points)
      std::erase_if(point.track, [&](const Observation& o) { return o.view.value >= views; });
    std::erase_if(world.scene.points, [](const Point& p) { return p.track.size() < 2; });
    std::erase_if(world.matches, [&](const ViewMatches& m) { return m.a.value >= views || m.b.value >= views; });
    const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
    EXPECT_FALSE(verified.changed);
    EXPECT_EQ(verified.scene.views.size(), static_cast<std::size_t>(views));
    for (const CameraStanding& s : verified.standings) EXPECT_EQ(s.remark, "") << s.name;
  }
}

// The same camera is found in a world of any size and at any place: 1e-3 to 1e6 metres, far from the origin.
TEST(CameraStanding, AnyScaleAndPlace) {
  for (const double scale : {1e-3, 1.0, 1e6})
    for (const double away : {0.0, 1e3}) {
      std::mt19937 random(11);
      WatchedWorld world = Ring(16, random);
      const Eigen::Vector3d shift = away * scale * Eigen::Vector3d(1, -2, 0.5);
      const auto moved = [&](const Rigid3& pose) {
        Rigid3 other = pose;
        other.translation = scale * pose.translation - pose.rotation * shift;
        return other;
      };
      for (Point& point : world.scene.points) point.x_in_world = scale * point.x_in_world + shift;
      for (View& view : world.scene.views) view.cam_from_world = moved(view.cam_from_world);
      const View truth = world.scene.views[7];
      EXPECT_FALSE(VerifyCameras(world.scene, world.matches).changed) << scale << " " << away;
      world.scene.views[7].cam_from_world.translation.y() += 0.4 * scale;
      const VerifiedCameras verified = VerifyCameras(world.scene, world.matches);
      EXPECT_TRUE(verified.changed);
      EXPECT_LT(CentreError(verified.scene.views[7], truth), kRightCentre * scale) << scale << " " << away;
    }
}

TEST(CameraStanding, MatchesComeFromTheDatabaseByName) {
  const FixtureFolder folder("standing");
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "b.jpg", {{1, 2}, {3, 4}, {5, 6}});
    db.AddImage(2, "a.jpg", {{10, 20}, {30, 40}});
    db.AddImage(3, "elsewhere.jpg", {{1, 1}});
    db.AddMatches(1, 2, {{2, 0}, {0, 1}});
    db.AddMatches(1, 3, {{0, 0}});
  }
  Scene scene;
  scene.views.resize(2);
  scene.views[0].name = "a.jpg";
  scene.views[1].name = "b.jpg";
  const auto matches = VerifiedMatchesOf(scene, ColmapDatabase(folder.path() / "database.db"));
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].a.value, 1);
  EXPECT_EQ(matches[0].b.value, 0);
  ASSERT_EQ(matches[0].px.size(), 2U);
  EXPECT_EQ(matches[0].px[0].first, Eigen::Vector2d(5, 6));
  EXPECT_EQ(matches[0].px[0].second, Eigen::Vector2d(10, 20));
}

}  // namespace
}  // namespace lumi
