// Fewer matches for the mapper: what each region and pair of photos keeps, and that tracks are kept or left whole.
#include "reconstruct/thin_matches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "reconstruct/colmap_database.h"
#include "tests/reconstruct/database_fixture.h"

namespace lumi {
namespace {

using testing::IsEmpty;

// A walk past points in a row: photo i sees those of a window around it, at pixels of its own; photos up to five steps
// from each other are matched. A feature's place in a photo is its point's place in the window.
struct WalkPast {
  std::vector<std::vector<Eigen::Vector2d>> keypoints_px;
  std::vector<std::vector<int>> points;  // of each photo's features
  std::vector<PairMatches> pairs;
};

constexpr int kPhotosOfRow = 30, kStepOfRow = 160, kSeenOfRow = 2400, kNeighbours = 5;

WalkPast MakeRow() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> px(0, 640);
  WalkPast row;
  for (int photo = 0; photo < kPhotosOfRow; ++photo) {
    std::vector<int> seen(kSeenOfRow);
    std::iota(seen.begin(), seen.end(), photo * kStepOfRow);
    row.points.push_back(seen);
    std::vector<Eigen::Vector2d> keypoints;
    for (int i = 0; i < kSeenOfRow; ++i) keypoints.emplace_back(px(random), px(random));
    row.keypoints_px.push_back(keypoints);
  }
  for (int a = 0; a < kPhotosOfRow; ++a)
    for (int b = a + 1; b <= std::min(a + kNeighbours, kPhotosOfRow - 1); ++b) {
      PairMatches pair{a, b, {}};
      for (int i = (b - a) * kStepOfRow; i < kSeenOfRow; ++i) pair.matches.emplace_back(i, i - (b - a) * kStepOfRow);
      row.pairs.push_back(pair);
    }
  return row;
}

std::size_t MatchesIn(const std::vector<PairMatches>& pairs) {
  std::size_t n = 0;
  for (const PairMatches& pair : pairs) n += pair.matches.size();
  return n;
}

TEST(ThinMatches, EveryPairAndEveryRegionKeepsEnough) {
  const WalkPast row = MakeRow();
  const ThinningOptions options{.cells = 4, .of_a_cell = 4, .of_a_pair = 40};
  const std::vector<PairMatches> thin = ThinMatches(row.pairs, row.keypoints_px, options);
  ASSERT_EQ(thin.size(), row.pairs.size());
  EXPECT_LT(MatchesIn(thin), MatchesIn(row.pairs) / 3);
  // Features of each region that are left, and that were there to be matched.
  std::map<std::pair<int, std::pair<int, int>>, std::pair<std::set<int>, std::set<int>>> region;
  const auto cell = [&](const Eigen::Vector2d& x) {
    return std::pair(static_cast<int>(x.x() / 160), static_cast<int>(x.y() / 160));
  };
  for (std::size_t p = 0; p < thin.size(); ++p) {
    EXPECT_GE(thin[p].matches.size(), std::min<std::size_t>(40, row.pairs[p].matches.size()));
    for (const bool all : {false, true})
      for (const auto& [i, j] : (all ? row.pairs : thin)[p].matches)
        for (const auto& [photo, feature] : {std::pair(thin[p].photo1, i), std::pair(thin[p].photo2, j)}) {
          auto& [left, there] = region[{
              photo, cell(row.keypoints_px[static_cast<std::size_t>(photo)][static_cast<std::size_t>(feature)])}];
          (all ? there : left).insert(feature);
        }
  }
  // The photos' regions are of their keypoints' bounding box, a little less than 640 px: one feature may fall beside.
  for (const auto& [where, features] : region)
    EXPECT_GE(features.first.size() + 1, std::min<std::size_t>(4, features.second.size()));
}

TEST(ThinMatches, ATrackIsKeptWholeOrNotAtAll) {
  const WalkPast row = MakeRow();
  const std::vector<PairMatches> thin = ThinMatches(row.pairs, row.keypoints_px, {.of_a_cell = 4, .of_a_pair = 40});
  std::map<int, std::pair<int, int>> matches_of;  // of each point: left, all
  for (std::size_t p = 0; p < thin.size(); ++p) {
    EXPECT_TRUE(std::ranges::includes(row.pairs[p].matches, thin[p].matches)) << "in their order";
    const auto& points = row.points[static_cast<std::size_t>(thin[p].photo1)];
    for (const auto& match : thin[p].matches) ++matches_of[points[static_cast<std::size_t>(match.first)]].first;
    for (const auto& match : row.pairs[p].matches) ++matches_of[points[static_cast<std::size_t>(match.first)]].second;
  }
  for (const auto& [point, count] : matches_of)
    EXPECT_TRUE(count.first == 0 || count.first == count.second) << "point " << point;
}

TEST(ThinMatches, TracksThatContradictThemselvesComeLast) {
  WalkPast row = MakeRow();
  // The first photo's last point is taken for another in the second photo: two features of one photo in one track, the
  // longest of all by far where chains of such matches go on.
  PairMatches& pair = row.pairs.front();
  for (int i = kStepOfRow; i + 1 < kSeenOfRow; i += 2) pair.matches.emplace_back(i, i - kStepOfRow + 1);
  const std::size_t before = pair.matches.size();
  const std::vector<PairMatches> thin = ThinMatches(row.pairs, row.keypoints_px, {.of_a_cell = 2, .of_a_pair = 10});
  // Only what the first two photos need, which see hardly anything else.
  EXPECT_LT(thin.front().matches.size(), before / 2);
  std::size_t wrong = 0;
  for (const auto& [i, j] : thin[8].matches) wrong += j == i - kStepOfRow + 1 ? 1 : 0;
  EXPECT_EQ(wrong, 0U);
}

TEST(ThinMatches, WhatIsFewStaysAsItIs) {
  const WalkPast row = MakeRow();
  const std::vector<PairMatches> all =
      ThinMatches(row.pairs, row.keypoints_px, {.of_a_cell = 0, .of_a_pair = kSeenOfRow});
  for (std::size_t p = 0; p < all.size(); ++p) EXPECT_EQ(all[p].matches, row.pairs[p].matches);
}

TEST(ThinMatches, NothingAndOnePlaceOnly) {
  EXPECT_THAT(ThinMatches({}, {}), IsEmpty());
  EXPECT_THAT(ThinMatches({{0, 1, {}}}, {{}, {}}).front().matches, IsEmpty());
  // All keypoints at one pixel, and on one line: no region has a width.
  const std::vector<Eigen::Vector2d> one(5, Eigen::Vector2d(3, 4));
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < 5; ++i) line.emplace_back(3, i);
  const PairMatches pair{0, 1, {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}}};
  EXPECT_EQ(ThinMatches({pair}, {one, line}).front().matches, pair.matches);
}

TEST(ThinMatches, ADatabaseIsCopiedWithLess) {
  const WalkPast row = MakeRow();
  const FixtureFolder folder("thin");
  const auto file = folder.path() / "database.db", thinned = folder.path() / "thinned.db";
  {
    TestDatabase database(file);
    for (int photo = 0; photo < kPhotosOfRow; ++photo)
      database.AddImage(photo + 1, "photo" + std::to_string(100 + photo),
                        row.keypoints_px[static_cast<std::size_t>(photo)]);
    for (const PairMatches& pair : row.pairs) database.AddMatches(pair.photo1 + 1, pair.photo2 + 1, pair.matches);
  }
  ASSERT_TRUE(WriteThinnedDatabase(file, thinned));
  const ColmapDatabase whole(file), less(thinned);
  EXPECT_TRUE(less.IsWhole());
  EXPECT_EQ(less.Images().size(), std::size_t{kPhotosOfRow});
  const std::vector<PairMatches> expected = ThinMatches(row.pairs, row.keypoints_px);
  for (std::size_t p = 0; p < row.pairs.size(); ++p) {
    const PairMatches& pair = row.pairs[p];
    EXPECT_EQ(whole.VerifiedMatches(pair.photo1 + 1, pair.photo2 + 1), pair.matches);
    EXPECT_EQ(less.VerifiedMatches(pair.photo1 + 1, pair.photo2 + 1), expected[p].matches);
    EXPECT_EQ(less.Matches(pair.photo1 + 1, pair.photo2 + 1), pair.matches);
    EXPECT_EQ(less.Keypoints(pair.photo1 + 1).size(), std::size_t{kSeenOfRow});
  }
  // Nothing to be gained.
  const auto small = folder.path() / "small.db", none = folder.path() / "none.db";
  {
    TestDatabase database(small);
    for (const int id : {1, 2}) database.AddImage(id, std::to_string(id), row.keypoints_px[0]);
    database.AddMatches(
        1, 2, std::vector<std::pair<int, int>>(row.pairs[0].matches.begin(), row.pairs[0].matches.begin() + 50));
  }
  EXPECT_FALSE(WriteThinnedDatabase(small, none));
  EXPECT_FALSE(std::filesystem::exists(none));
}

}  // namespace
}  // namespace lumi
