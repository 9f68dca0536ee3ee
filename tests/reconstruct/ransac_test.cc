#include "reconstruct/factorization/ransac.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <set>

namespace lumi {
namespace {

// Lines y = a x + b through points, the first `inliers` of them on y = 2 x + 1.
struct Line {
  double a = 0, b = 0;
};
struct Points {
  std::vector<double> x, y;
};
Points OnALine(int count, int inliers) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-50, 50);
  Points p;
  for (int i = 0; i < count; ++i) {
    p.x.push_back(i);
    p.y.push_back(i < inliers ? 2.0 * i + 1 : uniform(random) + 1000 * (i + 1));
  }
  return p;
}
struct Found {
  std::optional<Line> line;
  int inliers = 0;
  RansacSummary drawn;
};
Found FindLine(const Points& p, const RansacOptions& options, std::uint64_t seed = 1) {
  const auto error = [&](const Line& l, std::size_t i) { return std::pow(l.a * p.x[i] + l.b - p.y[i], 2); };
  Consensus<Line, decltype(error)> consensus(p.x.size(), 1, error);
  std::mt19937_64 random(seed);
  Found found;
  found.drawn = DrawModels<2>(options, p.x.size(), random, consensus, [&](const std::array<std::size_t, 2>& s) {
    const double a = (p.y[s[1]] - p.y[s[0]]) / (p.x[s[1]] - p.x[s[0]]);
    return consensus.Offer({a, p.y[s[0]] - a * p.x[s[0]]});
  });
  if (consensus.found()) found.line = consensus.best();
  found.inliers = consensus.InlierCount();
  return found;
}

TEST(Ransac, FindsTheLineAmongOutliers) {
  const Found found = FindLine(OnALine(40, 16), {});
  ASSERT_TRUE(found.line);
  EXPECT_NEAR(found.line->a, 2, 1e-9);
  EXPECT_NEAR(found.line->b, 1, 1e-9);
  EXPECT_EQ(found.inliers, 16);
  EXPECT_TRUE(found.drawn.confident);
}

TEST(Ransac, DrawsAsManySamplesAsTheInliersAskFor) {
  // log(1e-4) / log(1 - 0.4^2) = 52.8
  EXPECT_EQ(TrialsNeeded(0.4, 2, {}), 53);
  EXPECT_EQ(TrialsNeeded(1, 2, {}), 1);
  EXPECT_EQ(TrialsNeeded(1, 2, {.min_trials = 20}), 20);
  EXPECT_EQ(TrialsNeeded(0.4, 2, {.max_trials = 30}), 30);
  EXPECT_EQ(TrialsNeeded(0, 2, {.max_trials = 30}), 30);
  EXPECT_EQ(TrialsNeeded(1e-200, 7, {.max_trials = 30}), 30);
  EXPECT_EQ(FindLine(OnALine(40, 16), {}).drawn.trials, 53);
  EXPECT_EQ(FindLine(OnALine(40, 40), {.min_trials = 5}).drawn.trials, 5);
  EXPECT_EQ(FindLine(OnALine(40, 40), {}).drawn.trials, 1);
  // A confidence about more than the sample's own data.
  EXPECT_EQ(FindLine(OnALine(40, 32), {.sample_size = 7}).drawn.trials, TrialsNeeded(0.8, 7, {}));
}

TEST(Ransac, TheSameSeedDrawsTheSameSamples) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Found a = FindLine(OnALine(40, 12), {}, seed), b = FindLine(OnALine(40, 12), {}, seed);
    EXPECT_EQ(a.line->a, b.line->a);
    EXPECT_EQ(a.drawn.trials, b.drawn.trials);
  }
}

TEST(Ransac, WithoutInliersItSaysThatItIsNotSure) {
  // Any line goes through its own two points; so few ask for more samples than are allowed.
  const Found found = FindLine(OnALine(40, 0), {.max_trials = 25});
  EXPECT_EQ(found.drawn.trials, 25);
  EXPECT_FALSE(found.drawn.confident);
}

TEST(Ransac, OfDegenerateSamplesNothingIsTaken) {
  // All points in one place: no line through any two of them.
  const Found found = FindLine({{1, 1, 1, 1}, {2, 2, 2, 2}}, {.max_trials = 25});
  EXPECT_FALSE(found.line);
  EXPECT_EQ(found.inliers, 0);
  EXPECT_EQ(found.drawn.trials, 25);
  EXPECT_FALSE(found.drawn.confident);
}

TEST(Ransac, FewerDataThanASampleHasAreNotDrawnFrom) {
  const Found found = FindLine({{1}, {2}}, {});
  EXPECT_EQ(found.drawn.trials, 0);
  EXPECT_FALSE(found.line);
}

TEST(Ransac, ASampleIsOfDifferentData) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const auto s = DrawSample<5>(5, random);
    EXPECT_EQ(std::set<std::size_t>(s.begin(), s.end()).size(), 5U);
  }
}

TEST(Consensus, OfTwoModelsWithAsManyInliersTheNearerIsKept) {
  const std::vector<double> data{0, 0, 10};
  const auto error = [&](double m, std::size_t i) { return (m - data[i]) * (m - data[i]); };
  Consensus<double, decltype(error)> consensus(3, 1, error);
  EXPECT_FALSE(consensus.Offer(100));  // explains nothing
  EXPECT_FALSE(consensus.Offer(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(consensus.Offer(0.5));
  EXPECT_TRUE(consensus.Offer(0.25));
  EXPECT_FALSE(consensus.Offer(0.25));
  EXPECT_EQ(consensus.best(), 0.25);
  EXPECT_EQ(consensus.Inliers(), (std::vector<char>{1, 1, 0}));
}

}  // namespace
}  // namespace lumi
