// Which of many photos are matched: those of one place are among them, nothing hangs on the number of threads, and
// parts that hang on nothing are tried elsewhere.
#include "reconstruct/view_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <random>
#include <set>

#include "scene/program/parallel.h"
#include "scene/tracks/sift.h"
#include "scene/tracks/vlad.h"

namespace lumi {
namespace {

// A walk around a block: each photo sees a stretch of it, so that neighbours share half of what they see and photos
// further on less. A share of the features is of things that stand everywhere.
struct Walk {
  std::vector<ByteDescriptors> photos;
  std::vector<std::set<int>> seen;  // points, of each photo

  int Shared(int a, int b) const {
    const std::set<int>&x = seen[static_cast<std::size_t>(a)], &y = seen[static_cast<std::size_t>(b)];
    return static_cast<int>(std::ranges::count_if(x, [&](int p) { return y.contains(p); }));
  }
};

constexpr int kSeen = 400, kStep = 100, kEverywhere = 200;

Walk MakeWalk(int photos, unsigned seed) {
  std::mt19937 random(seed);
  std::gamma_distribution<float> number(0.5F);
  std::normal_distribution<float> noise(0, 0.25F);
  const int points = photos * kStep;
  Descriptors of_points(points + kEverywhere, kByteDescriptorLength);
  for (Eigen::Index p = 0; p < of_points.rows(); ++p)
    for (int k = 0; k < kByteDescriptorLength; ++k) of_points(p, k) = number(random);
  Walk walk;
  for (int v = 0; v < photos; ++v) {
    std::set<int> seen;
    for (int i = 0; i < kSeen; ++i) seen.insert((v * kStep + i) % points);
    walk.seen.push_back(seen);
    for (int i = 0; i < kEverywhere; ++i) seen.insert(points + i);
    Descriptors d(static_cast<Eigen::Index>(seen.size()), kByteDescriptorLength);
    Eigen::Index row = 0;
    for (const int p : seen) {
      for (int k = 0; k < kByteDescriptorLength; ++k) d(row, k) = of_points(p, k) * std::abs(1 + noise(random));
      d.row(row++).normalize();
    }
    walk.photos.push_back(ToBytes(d));
  }
  return walk;
}

ViewGraph GraphOf(const std::vector<ByteDescriptors>& photos) {
  return ViewGraph(DescribePhotos(photos.size(), [&](std::size_t i) { return photos[i]; }, {}));
}

TEST(ViewGraph, PhotosOfOnePlaceAreAmongThoseThatAreMatched) {
  constexpr int kPhotos = 120;
  const Walk walk = MakeWalk(kPhotos, 1);
  const PhotoPairs pairs = GraphOf(walk.photos).Similar(12);
  // As many as each photo may have, at most.
  EXPECT_LE(pairs.size(), 12U * kPhotos);
  // By how many features photos share, a quarter (they show a third more that stands everywhere) to three quarters:
  // around the block, the last photos with the first ones too.
  std::map<int, int> found, wanted;
  for (int a = 0; a < kPhotos; ++a)
    for (int b = a + 1; b < kPhotos; ++b) {
      const int shared = walk.Shared(a, b);
      if (shared == 0) continue;
      ++wanted[shared];
      found[shared] += std::ranges::binary_search(pairs, std::pair(a, b));
    }
  for (const int shared : {100, 200, 300}) ASSERT_EQ(wanted[shared], kPhotos) << shared;
  for (const int shared : {200, 300}) EXPECT_EQ(found[shared], kPhotos) << shared;
  EXPECT_GE(found[100], kPhotos * 95 / 100);
  std::printf("  of %d pairs each: %d, %d, %d\n", kPhotos, found[100], found[200], found[300]);
}

TEST(ViewGraph, TheSamePairsByAnyNumberOfThreads) {
  const Walk walk = MakeWalk(70, 2);
  SetThreadCount(1);
  const Eigen::MatrixXf one = DescribePhotos(walk.photos.size(), [&](std::size_t i) { return walk.photos[i]; }, {});
  const auto similar = MostSimilar(one, 9);
  for (const int threads : {2, 5}) {
    SetThreadCount(threads);
    const Eigen::MatrixXf more = DescribePhotos(walk.photos.size(), [&](std::size_t i) { return walk.photos[i]; }, {});
    EXPECT_EQ(one, more);
    EXPECT_EQ(similar, MostSimilar(more, 9));
  }
  SetThreadCount(0);
}

TEST(ViewGraph, PhotosWithoutFeaturesHaveNoPartner) {
  Walk walk = MakeWalk(20, 3);
  walk.photos[4].resize(0, kByteDescriptorLength);
  walk.photos[19].resize(0, kByteDescriptorLength);
  const PhotoPairs pairs = GraphOf(walk.photos).Similar(5);
  EXPECT_FALSE(pairs.empty());
  for (const auto& [a, b] : pairs) {
    EXPECT_LT(a, b);
    for (const int photo : {a, b}) EXPECT_TRUE(photo != 4 && photo != 19);
  }
  EXPECT_TRUE(GraphOf({}).Similar(5).empty());
  EXPECT_TRUE(GraphOf({walk.photos[0]}).Similar(5).empty());
  EXPECT_TRUE(GraphOf({ByteDescriptors(0, kByteDescriptorLength), ByteDescriptors(0, kByteDescriptorLength)})
                  .Similar(5)
                  .empty());
  EXPECT_TRUE(GraphOf({}).Next({}, {}).empty());
  // One feature a photo, or the same photo several times, still is something to match.
  std::vector<ByteDescriptors> same(6, walk.photos[1]);
  EXPECT_EQ(GraphOf(same).Similar(5).size(), 15U);
  for (ByteDescriptors& d : same) d = walk.photos[1].topRows(1).eval();
  EXPECT_EQ(GraphOf(same).Similar(5).size(), 15U);
}

TEST(ViewGraph, WhatMatchesMadeLikelyIsTriedNext) {
  const Walk walk = MakeWalk(40, 4);
  const ViewGraph graph = GraphOf(walk.photos);
  // Each with the next, the third and the fourth: who is two further on has the same partners.
  PhotoPairs tried;
  std::vector<VerifiedPair> verified;
  for (int a = 0; a < 40; ++a)
    for (const int d : {1, 3, 4}) tried.emplace_back(std::min(a, (a + d) % 40), std::max(a, (a + d) % 40));
  tried = Joined(std::move(tried), {});
  for (const auto& [a, b] : tried) verified.push_back({a, b, 100});
  const PhotoPairs next = graph.Next(tried, verified);
  for (int a = 0; a < 40; ++a) {
    const std::pair likely(std::min(a, (a + 2) % 40), std::max(a, (a + 2) % 40));
    EXPECT_TRUE(std::ranges::binary_search(next, likely)) << a;
  }
  for (const auto& pair : next) EXPECT_FALSE(std::ranges::binary_search(tried, pair));
  EXPECT_LT(next.size(), 40U * 8U);
}

TEST(ViewGraph, PartsThatHangOnLittleAreTriedElsewhere) {
  const Walk walk = MakeWalk(40, 5);
  const ViewGraph graph = GraphOf(walk.photos);
  // Photos 0 to 29 hang together; 30 to 39 do, and with 29 by a few matches only.
  PhotoPairs tried;
  std::vector<VerifiedPair> verified;
  for (int a = 0; a + 1 < 40; ++a) {
    tried.emplace_back(a, a + 1);
    verified.push_back({a, a + 1, a == 29 ? 16 : 100});
  }
  const PhotoPairs next = graph.Next(tried, verified);
  const auto has = [&](int a, int b) { return std::ranges::binary_search(next, std::pair(a, b)); };
  EXPECT_TRUE(has(29, 31) && has(28, 30));  // the seam
  EXPECT_TRUE(has(0, 39));                  // and around the block
  // All pairs tried: nothing is left.
  PhotoPairs all;
  for (int a = 0; a < 40; ++a)
    for (int b = a + 1; b < 40; ++b) all.emplace_back(a, b);
  EXPECT_TRUE(graph.Next(all, verified).empty());
  // Nothing verified at all: every photo but one part's is tried with those that look like it.
  EXPECT_FALSE(graph.Next({}, {}).empty());
}

std::vector<InputPhoto> WithGps(const std::vector<std::pair<double, double>>& places) {
  std::vector<InputPhoto> photos;
  for (const auto& [latitude, longitude] : places) {
    InputPhoto photo;
    photo.gps = GpsPosition{latitude, longitude, {}};
    photos.push_back(photo);
  }
  return photos;
}

TEST(ViewGraph, GpsSaysWhatIsNear) {
  // Along a street that crosses the date line.
  std::vector<std::pair<double, double>> street;
  for (int i = 0; i < 40; ++i) {
    const double longitude = 179.99 + 0.0005 * i;
    street.emplace_back(-17, longitude > 180 ? longitude - 360 : longitude);
  }
  const PhotoPairs pairs = NearByGps(WithGps(street));
  for (int a = 0; a + 1 < 40; ++a) EXPECT_TRUE(std::ranges::binary_search(pairs, std::pair(a, a + 1))) << a;
  for (const auto& [a, b] : pairs) EXPECT_LE(b - a, 12);
  // All at one place, two photos, and one: no more pairs than there are.
  EXPECT_LE(NearByGps(WithGps(std::vector(30, std::pair(48.0, 11.0)))).size(), 30U * 12U);
  EXPECT_EQ(NearByGps(WithGps({{48, 11}, {48, 12}})).size(), 1U);
  EXPECT_TRUE(NearByGps(WithGps({{48, 11}})).empty());
  // Few that have it say little.
  std::vector<InputPhoto> few = WithGps(street);
  for (std::size_t i = 0; i < 21; ++i) few[i].gps.reset();
  EXPECT_TRUE(NearByGps(few).empty());
}

TEST(ViewGraph, PairsAreJoinedOnce) {
  EXPECT_EQ(Joined({{3, 1}, {2, 2}, {0, 5}}, {{1, 3}, {5, 0}, {0, 1}}), (PhotoPairs{{0, 1}, {0, 5}, {1, 3}}));
}

}  // namespace
}  // namespace lumi
