// Cameras round a few points that wander: when each video started is known exactly.
#include "reconstruct/epipolar_synchronise.h"

#include <gtest/gtest.h>

#include "watched_motion.h"

namespace lumi {
namespace {

TEST(EpipolarSynchronise, OffsetsThatAreAFewFramesOffAreMadeExact) {
  const std::vector<int> truth{12, 3, 7, 20, 1, 9}, off{+1, -3, +2, 0, +3, -2};
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    std::vector<int> guess = truth;
    for (std::size_t i = 0; i < guess.size(); ++i) guess[i] += off[i];
    const OffsetCorrections r = CorrectOffsets(Watched(Arc(6), truth, seed), guess);
    std::vector<int> left;  // one number for all: the clock may begin anywhere
    for (std::size_t i = 0; i < guess.size(); ++i) left.push_back(r.frames[i] + off[i]);
    EXPECT_EQ(left, std::vector<int>(6, left[0])) << seed;
    EXPECT_GT(r.correlation, 0.5);
  }
}

}  // namespace
}  // namespace lumi
