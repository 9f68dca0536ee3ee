// Models cut from one simulated world and moved: what they share says how they lie.
#include "reconstruct/merge_models.h"

#include <gtest/gtest.h>

#include <set>

#include "reconstruct/reprojection.h"
#include "scene/geometry/angle.h"
#include "watched_world.h"

namespace lumi {
namespace {

const Similarity3 kPartFromWorld{2.7,
                                 Eigen::Quaterniond(Eigen::AngleAxisd(1.9, Eigen::Vector3d(1, 2, -1).normalized())),
                                 Eigen::Vector3d(30, -4, 11)};
// Of the ring of radius 4: half a pixel of 560 over hundreds of points, and the points' own scatter.
constexpr double kMergedCentre = 0.01, kMergedTurnDeg = 0.1;

// The views that `takes` wants, with the points that two of them see, in a frame of its own.
template <typename Takes>
Scene PartOf(const Scene& scene, const Takes& takes, const Similarity3& part_from_world, std::mt19937& random) {
  std::normal_distribution<double> scatter(0, 0.002);
  Scene part;
  part.cameras = scene.cameras;
  std::map<std::int32_t, std::int32_t> place;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (takes(static_cast<int>(v))) {
      place[static_cast<std::int32_t>(v)] = static_cast<std::int32_t>(part.views.size());
      part.views.push_back(scene.views[v]);
    }
  for (const Point& point : scene.points) {
    Point kept = point;
    kept.track.clear();
    for (const Observation& o : point.track)
      if (const auto it = place.find(o.view.value); it != place.end())
        kept.track.push_back({ViewId{it->second}, o.x_px});
    kept.x_in_world += Eigen::Vector3d(scatter(random), scatter(random), scatter(random));
    if (kept.track.size() >= 2) part.points.push_back(kept);
  }
  Transform(part, part_from_world);
  return part;
}

// The world's matches as those of another scene's views.
std::vector<ViewMatches> MatchesAmong(const WatchedWorld& world, const Scene& joint) {
  std::map<std::string, std::int32_t> named;
  for (std::size_t v = 0; v < joint.views.size(); ++v) named[joint.views[v].name] = static_cast<std::int32_t>(v);
  std::vector<ViewMatches> matches;
  for (ViewMatches m : world.matches) {
    const auto a = named.find(world.scene.views[static_cast<std::size_t>(m.a.value)].name);
    const auto b = named.find(world.scene.views[static_cast<std::size_t>(m.b.value)].name);
    if (a == named.end() || b == named.end()) continue;
    m.a = ViewId{a->second}, m.b = ViewId{b->second};
    matches.push_back(std::move(m));
  }
  return matches;
}

std::optional<MergedModel> Merge(const WatchedWorld& world, const Scene& a, const Scene& b) {
  return MergeModels(
      a, b, [&](const Scene& joint) { return MatchesAmong(world, joint); },
      [](const std::string&, const std::string&) { return true; });
}

// Every camera where the world has it.
void ExpectWhole(const WatchedWorld& world, const Scene& merged) {
  ASSERT_EQ(merged.views.size(), world.scene.views.size());
  EXPECT_EQ(merged.cameras.size(), 1U);
  for (std::size_t v = 0; v < merged.views.size(); ++v) {
    const View &found = merged.views[v], &truth = world.scene.views[v];
    ASSERT_EQ(found.name, truth.name);
    EXPECT_LT((found.CentreInWorld() - truth.CentreInWorld()).norm(), kMergedCentre) << found.name;
    EXPECT_LT(found.cam_from_world.rotation.angularDistance(truth.cam_from_world.rotation) * kDegPerRad,
              kMergedTurnDeg);
  }
  std::set<std::tuple<std::int32_t, double, double>> pixels;
  for (const Point& point : merged.points) {
    std::set<std::int32_t> views;
    for (const Observation& o : point.track) {
      EXPECT_TRUE(views.insert(o.view.value).second) << "a photo twice in a track";
      EXPECT_TRUE(pixels.emplace(o.view.value, o.x_px.x(), o.x_px.y()).second) << "a pixel in two tracks";
    }
    EXPECT_GE(point.track.size(), 2U);
  }
  Scene measured = merged;
  EXPECT_LT(UpdatePointErrors(measured), 1.5);
}

TEST(MergeModels, PartsThatShareThreePhotos) {
  std::mt19937 random(5);
  const WatchedWorld world = Ring(24, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v < 14; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v >= 11; }, kPartFromWorld, random);
  const auto merged = Merge(world, a, b);
  ASSERT_TRUE(merged);
  EXPECT_EQ(merged->tie.common_photos, 3);
  EXPECT_GT(merged->tie.common_points, 100);
  EXPECT_NEAR(merged->tie.a_from_b.scale * kPartFromWorld.scale, 1, 1e-3);
  ExpectWhole(world, merged->scene);
}

TEST(MergeModels, PartsThatShareMatchesOnly) {
  std::mt19937 random(6);
  const WatchedWorld world = Ring(24, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v < 12; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v >= 12; }, kPartFromWorld, random);
  const auto merged = Merge(world, a, b);
  ASSERT_TRUE(merged);
  EXPECT_EQ(merged->tie.common_photos, 0);
  ExpectWhole(world, merged->scene);
}

TEST(MergeModels, EveryOtherPhoto) {
  std::mt19937 random(7);
  const WatchedWorld world = Drive(30, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v % 2 == 0; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v % 2 == 1; }, kPartFromWorld, random);
  const auto merged = Merge(world, a, b);
  ASSERT_TRUE(merged);
  ASSERT_EQ(merged->scene.views.size(), 30U);
  for (std::size_t v = 0; v < 30; ++v) EXPECT_EQ(merged->scene.views[v].name, world.scene.views[v].name);
}

TEST(MergeModels, TwoLensesStayTwo) {
  std::mt19937 random(8);
  const WatchedWorld world = Ring(24, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v < 14; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v >= 11; }, kPartFromWorld, random);
  const auto merged = MergeModels(
      a, b, [&](const Scene& joint) { return MatchesAmong(world, joint); },
      [](const std::string&, const std::string&) { return false; });
  ASSERT_TRUE(merged);
  EXPECT_EQ(merged->scene.cameras.size(), 2U);
}

// Refused: nothing in common; matches that tie each point to another than its own, as two like places do; points on a
// line.
TEST(MergeModels, NothingInCommon) {
  std::mt19937 random(9);
  WatchedWorld world = Ring(24, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v < 12; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v >= 12; }, kPartFromWorld, random);
  world.matches.clear();
  EXPECT_FALSE(Merge(world, a, b));
}

TEST(MergeModels, TwoPlacesThatLookAlike) {
  std::mt19937 random(10);
  WatchedWorld world = Ring(24, random);
  const Scene a = PartOf(
      world.scene, [](int v) { return v < 12; }, Similarity3(), random);
  const Scene b = PartOf(
      world.scene, [](int v) { return v >= 12; }, kPartFromWorld, random);
  for (ViewMatches& m : world.matches) {
    const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> right = m.px;
    // A third of the things stand alike in both places; the rest is tied to anything.
    for (std::size_t i = right.size() / 3; i < right.size(); ++i)
      m.px[i].second = right[random() % right.size()].second;
  }
  EXPECT_FALSE(Merge(world, a, b));
}

TEST(MergeModels, PointsOnALine) {
  std::mt19937 random(11);
  for (const double off : {1e-2, 1e-3, 1e-6, 0.0}) {
    std::vector<Rigid3> poses;
    for (int i = 0; i < 8; ++i)
      poses.push_back(LookAt({-3.5 + i, 0.1 * i, -6}, Eigen::Vector3d::Zero(), -Eigen::Vector3d::UnitY()));
    const WatchedWorld world = Watch(poses, Cloud(200, {2, off, off}, random), 100, 4, random);
    const Scene a = PartOf(
        world.scene, [](int v) { return v < 5; }, Similarity3(), random);
    const Scene b = PartOf(
        world.scene, [](int v) { return v >= 3; }, kPartFromWorld, random);
    EXPECT_FALSE(Merge(world, a, b)) << off;
  }
}

}  // namespace
}  // namespace lumi
