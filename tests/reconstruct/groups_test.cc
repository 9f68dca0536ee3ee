// Groups of photos planted as a whole where they do not belong, tied to the rest by few matches: moved back, or named.
#include "reconstruct/groups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>
#include <set>
#include <utility>

#include "reconstruct/mapping.h"
#include "reconstruct/merge_models.h"
#include "reconstruct/reprojection.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/similarity3.h"
#include "watched_world.h"

namespace lumi {
namespace {

using Pixel = std::pair<std::int32_t, std::pair<double, double>>;

// A model of world's photos in which those below `border` hang on the rest by `ties` points, which two photos or more
// on either side see; and the whole group is moved. The mapper left each side its part of every point.
void HangByFew(WatchedWorld& world, int border, int ties, const Similarity3& by) {
  std::set<Pixel> tied;
  std::vector<Point> points;
  int left = ties;
  for (const Point& point : world.scene.points) {
    Point below = point, above = point;
    std::erase_if(below.track, [&](const Observation& o) { return o.view.value >= border; });
    std::erase_if(above.track, [&](const Observation& o) { return o.view.value < border; });
    if (below.track.size() >= 2 && above.track.size() >= 2 && left-- > 0)
      for (const Observation& o : point.track) tied.insert({o.view.value, {o.x_px.x(), o.x_px.y()}});
    below.x_in_world = by * below.x_in_world;
    for (Point* side : {&below, &above})
      if (side->track.size() >= 2) points.push_back(*side);
  }
  world.scene.points = std::move(points);
  for (std::size_t v = 0; v < static_cast<std::size_t>(border); ++v)
    world.scene.views[v].cam_from_world = TransformPose(world.scene.views[v].cam_from_world, by);
  for (ViewMatches& m : world.matches)
    if ((m.a.value < border) != (m.b.value < border))
      std::erase_if(m.px, [&](const auto& px) {
        return !tied.contains({m.a.value, {px.first.x(), px.first.y()}}) ||
               !tied.contains({m.b.value, {px.second.x(), px.second.y()}});
      });
}

// Points that photos on both sides of the border see.
int Crossing(const Scene& scene, int border) {
  return static_cast<int>(std::ranges::count_if(scene.points, [&](const Point& point) {
    const auto below = std::ranges::count_if(point.track, [&](const Observation& o) { return o.view.value < border; });
    return below > 0 && below < std::ssize(point.track);
  }));
}

double WorstCentre(const Scene& scene, const Scene& truth) {
  std::vector<Rigid3> found, wanted;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    EXPECT_EQ(scene.views[v].name, truth.views[v].name);
    found.push_back(scene.views[v].cam_from_world);
    wanted.push_back(truth.views[v].cam_from_world);
  }
  return ComparePoses(found, wanted).centre_max_percent;
}

Similarity3 AnyMove(std::mt19937& random, double extent) {
  std::normal_distribution<double> normal;
  const auto any = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
  const double turn_deg = std::uniform_real_distribution<>(0, 20)(random);
  return {std::exp(0.3 * normal(random)), Eigen::Quaterniond(Eigen::AngleAxisd(turn_deg * kRadPerDeg, any())),
          std::uniform_real_distribution<>(0.05, 0.5)(random) * extent * any()};
}

// Of the extent: sixty points tie a group, and say to this where it lies.
constexpr double kRegroupedPercent = 3;

TEST(Groups, PlantedElsewhereAreMovedBack) {
  int moved = 0;
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    WatchedWorld world = Drive(24, random);
    const Scene truth = world.scene;
    HangByFew(world, 3 + trial % 6, 60, AnyMove(random, 28));
    ASSERT_GT(WorstCentre(world.scene, truth), kRegroupedPercent);
    const VerifiedGroups verified = VerifyGroups(world.scene, world.matches);
    const bool right = verified.changed && WorstCentre(verified.scene, truth) < kRegroupedPercent;
    moved += right;
    if (!right)
      std::cout << "trial " << trial << ": " << verified.groups.size() << " groups, "
                << WorstCentre(verified.scene, truth) << " %\n";
  }
  EXPECT_GE(moved, 0.97 * kTrials);
}

// The points that tie a group which was moved outlast the adjustment's first look at outliers.
TEST(Groups, MovedHangOnTheirPoints) {
  std::mt19937 random(8);
  WatchedWorld world = Drive(24, random);
  constexpr int kBorder = 6, kTies = 60;
  HangByFew(world, kBorder, kTies, AnyMove(random, 28));
  Scene scene = VerifyGroups(world.scene, world.matches).scene;
  UpdatePointErrors(scene);
  EXPECT_GE(Crossing(WithoutOutliers(scene, 20), kBorder), 0.8 * kTies);
}

// A right group, tied by points that one photo of a side sees, and matches of a facade that looks like another: not
// moved.
TEST(Groups, LookAlikesDoNotMoveWhatIsTied) {
  std::mt19937 random(12);
  WatchedWorld world = Drive(24, random);
  constexpr int kBorder = 6, kAlike = 40;
  const Scene truth = world.scene;
  HangByFew(world, kBorder, 0, Similarity3());
  // Again joined, each by one photo of the group.
  int joined = 0;
  for (Point point : truth.points) {
    const auto below = std::ranges::count_if(point.track, [&](const Observation& o) { return o.view.value < kBorder; });
    if (below == 0 || std::ssize(point.track) - below < 2 || joined >= 45) continue;
    ++joined;
    std::erase_if(world.scene.points, [&](const Point& p) { return p.x_in_world == point.x_in_world; });
    bool first = true;
    std::erase_if(point.track, [&](const Observation& o) {
      if (o.view.value >= kBorder) return false;
      return !std::exchange(first, false);
    });
    world.scene.points.push_back(point);
  }
  ASSERT_EQ(joined, 45);
  int alike = 0;
  const Eigen::Vector3d away(0.5, 0, 6);
  for (std::size_t p = 0, n = world.scene.points.size(); p < n && alike < kAlike; ++p) {
    const Point of_group = world.scene.points[p];
    if (std::ranges::any_of(of_group.track, [&](const Observation& o) { return o.view.value >= kBorder; })) continue;
    Point like{.x_in_world = of_group.x_in_world + away};
    for (std::int32_t v = kBorder; v < kBorder + 4; ++v) {
      const View& view = world.scene.views[static_cast<std::size_t>(v)];
      const Eigen::Vector3d x_in_cam = view.cam_from_world * like.x_in_world;
      const auto x = x_in_cam.z() > 1 ? world.scene.CameraOf(view).Project(x_in_cam) : std::nullopt;
      if (x && x->minCoeff() > 0 && x->x() < 640 && x->y() < 480) like.track.push_back({ViewId{v}, *x});
    }
    if (like.track.size() < 2) continue;
    ++alike;
    for (const Observation& o : of_group.track)
      for (const Observation& other : like.track) world.matches.push_back({o.view, other.view, {{o.x_px, other.x_px}}});
    world.scene.points.push_back(like);
  }
  ASSERT_GE(alike, kMinCommonPoints);
  const VerifiedGroups verified = VerifyGroups(world.scene, world.matches);
  EXPECT_FALSE(verified.changed);
  ASSERT_EQ(verified.groups.size(), 1U) << "its matches contradict its place: it is named";
  EXPECT_EQ(verified.groups[0].photos.size(), static_cast<std::size_t>(kBorder));
  EXPECT_EQ(verified.groups[0].points, joined);
}

TEST(Groups, ThatFewPointsTieAreNamed) {
  std::mt19937 random(3);
  WatchedWorld world = Drive(24, random);
  HangByFew(world, 5, 12, AnyMove(random, 28));
  const Scene before = world.scene;
  const VerifiedGroups verified = VerifyGroups(world.scene, world.matches);
  EXPECT_FALSE(verified.changed);
  ASSERT_EQ(verified.groups.size(), 1U);
  EXPECT_EQ(verified.groups[0].photos.size(), 5U);
  EXPECT_EQ(verified.groups[0].photos.front(), before.views.front().name);
  EXPECT_EQ(verified.groups[0].points, 0);
  EXPECT_LT(WorstCentre(verified.scene, before), 1e-9);
}

TEST(Groups, RightModelsStay) {
  std::mt19937 random(4);
  for (WatchedWorld world : {Ring(24, random), Drive(30, random)}) {
    const VerifiedGroups verified = VerifyGroups(world.scene, world.matches);
    EXPECT_FALSE(verified.changed);
    EXPECT_TRUE(verified.groups.empty());
    // Thin, but right.
    HangByFew(world, 6, 60, Similarity3());
    const VerifiedGroups thin = VerifyGroups(world.scene, world.matches);
    EXPECT_FALSE(thin.changed);
    EXPECT_TRUE(thin.groups.empty());
  }
}

TEST(Groups, OfModelsTooSmallNothingIsSaid) {
  EXPECT_FALSE(VerifyGroups(Scene(), {}).changed);
  for (const int views : {1, 2, 3}) {
    std::mt19937 random(6);
    WatchedWorld world = Ring(30, random);
    world.scene.views.resize(static_cast<std::size_t>(views));
    for (Point& point : world.scene.points)
      std::erase_if(point.track, [&](const Observation& o) { return o.view.value >= views; });
    std::erase_if(world.matches, [&](const ViewMatches& m) { return m.a.value >= views || m.b.value >= views; });
    const VerifiedGroups verified = VerifyGroups(world.scene, world.matches);
    EXPECT_FALSE(verified.changed);
    EXPECT_TRUE(verified.groups.empty());
  }
}

}  // namespace
}  // namespace lumi
