// The map between two windows' worlds, recovered from the frames that both reconstructed.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>

#include "stabilize/world_map.h"
#include "tests/stabilize/walks.h"

namespace lumi {
namespace {

using namespace test;

struct Windows {
  FilmedScene a, b;
  std::vector<Matrix34d> P_a, P_b;
  std::vector<std::vector<Eigen::Vector4d>> points_b;
};
Windows TwoTellings(const Walk& walk) {
  Telling first, second;
  first.world_from_walk = ProjectiveFrame(walk, 50, 1);
  second.world_from_walk = ProjectiveFrame(walk, 1000, 2);
  Windows w{ReadWalk(walk, first), ReadWalk(walk, second), {}, {}, {}};
  for (std::size_t t = 0; t < walk.shaky.size(); ++t) {
    w.P_a.push_back(w.a.frames[t].P);
    w.P_b.push_back(w.b.frames[t].P);
    std::vector<Eigen::Vector4d>& X = w.points_b.emplace_back();
    for (const SightOfPoint& s : w.b.frames[t].sights) X.push_back(w.b.X[static_cast<std::size_t>(s.point)]);
  }
  return w;
}
double LargestPx(const Windows& w, const Eigen::Matrix4d& a_from_b) {
  double largest = 0;
  for (std::size_t t = 0; t < w.P_a.size(); ++t)
    for (const Eigen::Vector4d& X : w.points_b[t]) {
      const Eigen::Vector3d q = w.a.frames[t].P * (a_from_b * X), x = w.b.frames[t].P * X;
      largest = std::max(largest, q.z() > 0 ? (q.hnormalized() - x.hnormalized()).norm() * w.a.px_per_unit() : 1e300);
    }
  return largest;
}

TEST(WorldMap, OfExactMatricesIsExact) {
  const Windows w = TwoTellings(Wander(30));
  const auto map = MapBetweenWorlds(w.P_a, w.P_b, w.points_b);
  ASSERT_TRUE(map);
  EXPECT_LT(LargestPx(w, map->a_from_b), 1e-5);
  EXPECT_LT(map->rms * w.a.px_per_unit(), 1e-5);
}

TEST(WorldMap, OfNoisyMatricesWithABadFrameIsAsSureAsTheMatrices) {
  constexpr double kNoise = 1e-3;  // of matrices of norm 1: about a pixel
  Windows w = TwoTellings(Wander(60));
  std::mt19937_64 random(5);
  std::normal_distribution<double> gauss(0, kNoise);
  for (auto* matrices : {&w.P_a, &w.P_b})
    for (Matrix34d& P : *matrices)
      for (int i = 0; i < 12; ++i) P.data()[i] += gauss(random);
  std::swap(w.P_a[7], w.P_a[50]);
  const auto map = MapBetweenWorlds(w.P_a, w.P_b, w.points_b);
  ASSERT_TRUE(map);
  EXPECT_LT(LargestPx(w, map->a_from_b), 2);
  EXPECT_LT(map->rms * w.a.px_per_unit(), 3);
}

TEST(WorldMap, FramesThatAreWrongDoNotMoveWhatTheOthersAgreeOn) {
  // A tenth of the frames, exchanged with one another; the rest is exact, and so is the map, but for a robust loss's
  // share.
  Windows w = TwoTellings(Wander(60));
  for (std::size_t t = 0; t < 3; ++t) std::swap(w.P_a[7 + t], w.P_a[50 - 5 * t]);
  const auto map = MapBetweenWorlds(w.P_a, w.P_b, w.points_b);
  ASSERT_TRUE(map);
  EXPECT_LT(LargestPx(w, map->a_from_b), 0.01);  // measured 1e-4; 17 where all frames weigh the same
}

TEST(WorldMap, TwoFramesTellNone) {
  Windows w = TwoTellings(Wander(30));
  w.P_a.resize(2), w.P_b.resize(2), w.points_b.resize(2);
  EXPECT_FALSE(MapBetweenWorlds(w.P_a, w.P_b, w.points_b));
  EXPECT_FALSE(MapBetweenWorlds({}, {}, {}));
  w = TwoTellings(Wander(5));
  for (auto& X : w.points_b) X.clear();
  EXPECT_FALSE(MapBetweenWorlds(w.P_a, w.P_b, w.points_b));
}

}  // namespace
}  // namespace lumi
