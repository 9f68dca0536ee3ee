// Several cameras, and turning objects, where little tells when what was seen.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

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

TEST(TurntableHardCase, ATurnThatVanishesBetweenPhotosTellsItsAxisOrNothing) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kSafety = 10, kDistance = 3,
                   kTurns = 2 * std::numbers::pi;
  int answered = 0;
  for (double step = 1e-2; step >= 1e-15; step /= 10) {
    const Table table(60, step, 0, 0);
    try {
      const TurnAxis found = FindTurnAxis(table.cam_from_object, table.turns);
      ++answered;
      // Two photos' movement over the turn between them: doubles of the camera's distance over its angle.
      EXPECT_LT(table.DistanceOff(found), kSafety * kEpsilon * kDistance / (kTurns * step)) << step;
      EXPECT_NEAR(found.direction.norm(), 1, kSafety * kEpsilon) << step;
    } catch (const DataError&) {
    }
  }
  EXPECT_GE(answered,
            3);  // down to 1e-4 of a turn: a camera that hardly moves is not told from one that does not go round
}

TEST(TurntableHardCase, TurnsThatAreCountedFromFartherAndFartherAwayLoseTheirPlacesOnly) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kSafety = 10, kDistance = 3, kStep = 1 / 47.0;
  int answered = 0;
  for (double first = 1; first <= 1e15; first *= 10) {
    const Table table(94, kStep, first, 0);
    try {
      const TurnAxis found = FindTurnAxis(table.cam_from_object, table.turns);
      ++answered;
      EXPECT_LT(table.DistanceOff(found), kSafety * kEpsilon * first * kDistance / kStep) << first;
    } catch (const DataError&) {
      EXPECT_GT(first, 1e12) << "a turn has 1e3 places left at 1e12";
    }
  }
  EXPECT_GE(answered, 13);
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
