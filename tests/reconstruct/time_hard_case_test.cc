// Several cameras, and turning objects, where little tells when what was seen.
#include <gtest/gtest.h>

#include "scene/program/error.h"
#include "turning_object.h"
#include "watched_motion.h"

namespace lumi {
namespace {

constexpr double kExactAxis = 1e-9;  // rounding of products of rotations

TEST(TurntableHardCase, TimesFarFromZeroAndPhasesThatRepeatDoNoHarm) {
  // 1e9 turns: doubles hold 1e-7 of a turn there.
  Table table(94, 1 / 47.0, 1e9, 0);
  EXPECT_LT(table.DistanceOff(FindTurnAxis(table.cam_from_object, table.turns)), 1e-4);
  // Photos of one moment say nothing of the axis, and are no 0/0.
  Table twice(20, 1 / 47.0, 0, 0);
  for (int i = 0; i < 20; ++i)
    twice.cam_from_object.push_back(twice.cam_from_object[19]), twice.turns.push_back(twice.turns[19]);
  EXPECT_LT(twice.DistanceOff(FindTurnAxis(twice.cam_from_object, twice.turns)), kExactAxis);
}

TEST(TurntableHardCase, WhatDoesNotGoRoundIsRefused) {
  const Table table(60, 1 / 47.0, 0, 0);
  EXPECT_THROW(FindTurnAxis(table.cam_from_room, table.turns), DataError) << "the room's cameras";
  std::vector<double> half = table.turns;
  for (double& t : half) t *= 0.5;
  EXPECT_THROW(FindTurnAxis(table.cam_from_object, half), DataError) << "another pace";
  EXPECT_THROW(
      FindTurnAxis({table.cam_from_object.begin(), table.cam_from_object.begin() + 3}, {0, 1 / 47.0, 2 / 47.0}),
      DataError)
      << "two pairs";
  EXPECT_THROW(FindTurnAxis({}, {}), DataError);
  // A camera that looks about at the right pace, from places that lie on no circle.
  std::vector<Rigid3> lost = table.cam_from_object;
  std::mt19937 random(2);
  std::normal_distribution<double> n(0, 1);
  for (Rigid3& pose : lost) pose.translation += Eigen::Vector3d(n(random), n(random), n(random));
  EXPECT_THROW(FindTurnAxis(lost, table.turns), DataError);
}

TEST(EpipolarSynchroniseHardCase, WhatTellsNothingLeavesTheGuessAsItIs) {
  const std::vector<int> guess{4, 0, 2}, none{0, 0, 0};
  // Nothing moves; cameras in one place, which share no plane; videos too short; one video; none.
  EXPECT_EQ(CorrectOffsets(Watched(Arc(3), {5, 6, 7}, 1, false), guess).frames, none);
  const Eigen::Vector3d place(0, -3, 0.8);
  EXPECT_EQ(CorrectOffsets(Watched({place, place, place}, {5, 6, 7}, 1), guess).frames, none);
  auto brief = Watched(Arc(3), {5, 6, 7}, 1);
  for (WatchedMotion& v : brief) v.change.resize(10), v.foreground.resize(10);
  EXPECT_EQ(CorrectOffsets(brief, guess).frames, none);
  EXPECT_EQ(CorrectOffsets(brief, guess).correlation, 0);
  EXPECT_EQ(CorrectOffsets(Watched(Arc(1), {5}, 1), {0}).frames, (std::vector<int>{0}));
  EXPECT_TRUE(CorrectOffsets({}, {}).frames.empty());
}

TEST(EpipolarSynchroniseHardCase, ACameraInAnothersViewHasItsEpipoleThere) {
  // The second stands before the first, on its axis, nearer by half; approached from beside, where the epipole leaves
  // the picture.
  for (const double aside : {1.0, 0.1, 1e-3, 1e-9, 0.0}) {
    const std::vector<int> off =
        CorrectOffsets(Watched({{0, -4, 0.5}, {aside, -2, 0.25}, {1, -3, 0.9}}, {4, 1, 6}, 7), {6, 1, 5}).frames;
    EXPECT_EQ(off[0] + 2, off[1]) << aside;
    EXPECT_EQ(off[2] - 1, off[1]) << aside;
  }
}

}  // namespace
}  // namespace lumi
