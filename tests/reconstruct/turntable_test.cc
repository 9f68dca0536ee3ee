// Cameras about a turning object, put into the room; and lists of times.
#include "reconstruct/turntable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruct/view_times.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "turning_object.h"

namespace lumi {
namespace {

constexpr double kAxisExact = 1e-9;  // rounding of products of rotations

TEST(Turntable, TheAxisIsFoundThoughTheCameraRisesAfterEveryTurn) {
  for (const double step :
       {1 / 47.0, 0.31,
        -1 / 47.0}) {  // the last: a table that turns the other way round is an axis that points the other way
    const Table table(140, std::abs(step), 0, 0);
    std::vector<double> turns = table.turns;
    if (step < 0)
      for (double& t : turns) t = -t;
    const TurnAxis found = FindTurnAxis(table.cam_from_object, turns);
    EXPECT_LT((found.direction - (step < 0 ? -table.axis : table.axis)).norm(), kAxisExact) << step;
    EXPECT_LT(table.DistanceOff(found), kAxisExact) << step;
    EXPECT_LT(found.room_step, kAxisExact);
    EXPECT_GT(found.object_step, 0.1);
  }
}

TEST(Turntable, AHandThatShakesMovesTheAxisLessThanItself) {
  constexpr double kShake = 0.003;
  const Table table(140, 1 / 47.0, 0, kShake);
  const TurnAxis found = FindTurnAxis(table.cam_from_object, table.turns);
  EXPECT_LT((found.direction - table.axis).norm(), 2 * kShake);
  EXPECT_LT(table.DistanceOff(found), 4 * kShake);
}

TEST(Turntable, InTheRoomTheCameraStandsAndThePointsTurn) {
  const Table table(94, 1 / 47.0, 0, 0);
  const double period_s = 1.7;
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(640, 480, 900, 900, 320, 240));
  for (std::size_t i = 0; i < table.turns.size(); ++i) {
    View v;
    v.name = "p" + std::to_string((i * 37) % 94);  // their order is not that of the times
    v.camera = {0};
    v.cam_from_world = table.cam_from_object[i];
    v.time_s = period_s * table.turns[i];
    scene.views.push_back(v);
  }
  std::mt19937 random(4);
  std::shuffle(scene.views.begin(), scene.views.end(), random);
  std::uniform_real_distribution<double> u(-0.3, 0.3);
  for (int k = 0; k < 20; ++k) {
    Point p;
    p.x_in_world = table.point + Eigen::Vector3d(u(random), u(random), u(random));
    for (std::size_t v = 0; v < scene.views.size(); v += 5)
      p.track.push_back({ViewId{static_cast<std::int32_t>(v)},
                         *scene.cameras[0].Project(scene.views[v].cam_from_world * p.x_in_world)});
    scene.points.push_back(p);
  }
  PutIntoRoom(scene, period_s);
  EXPECT_EQ(scene.period_s, period_s);
  for (const View& view : scene.views) {
    const auto i = static_cast<std::size_t>(std::lround(*view.time_s / period_s * 47));
    const Rigid3 off = table.cam_from_room[i].Inverse() * view.cam_from_world;
    EXPECT_LT((off * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-7);
  }
  for (const Point& p : scene.points) {
    ASSERT_FALSE(p.track.empty());
    const double time_s = std::fmod(*scene.views[static_cast<std::size_t>(p.track[0].view.value)].time_s, period_s);
    for (const Observation& o : p.track) {
      const View& view = scene.views[static_cast<std::size_t>(o.view.value)];
      EXPECT_LT((*scene.cameras[0].Project(view.cam_from_world * p.x_in_world) - o.x_px).norm(), 1e-5);
      EXPECT_LT(std::abs(std::remainder(*view.time_s - time_s, period_s)), 1e-3);
    }
  }
  EXPECT_GT(scene.points.size(), 20U * 10);
}

TEST(ViewTimes, AreReadByTheNamesOfTheirColumns) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    WriteTextAtomically(folder / "t.csv", text);
    return ReadViewTimes(folder / "t.csv");
  };
  ViewTimes t = read("frame,image,period,phase_deg,ring\r\n5,a.png,2,90,-7\r\n6,\"b.png\",2,97.2,-7\r\n");
  EXPECT_TRUE(t.in_turns);
  ASSERT_EQ(t.photos.size(), 2U);
  EXPECT_EQ(t.photos[1].name, "b.png");
  EXPECT_EQ(t.photos[0].frame_index, 5);
  EXPECT_NEAR(t.photos[0].time, 2.25, 1e-15);
  EXPECT_NEAR(t.photos[1].time, 2.27, 1e-15);
  t = read("a.jpg, 1000000000.25\nb.jpg,7");
  EXPECT_FALSE(t.in_turns);
  EXPECT_EQ(t.photos[0].time, 1000000000.25);
  EXPECT_FALSE(t.photos[0].frame_index);
  EXPECT_EQ(read("name,phase\na,0.25\n").photos[0].time, 0.25);
  EXPECT_EQ(read("time_s,file\n3,a\n\n").photos[0].time, 3);
  for (const char* bad : {"", "\n\n", "image,phase\n", "image,when\na,3\n", "image,phase,time_s\na,3,3\n",
                          "image,phase\na,x\n", "image,phase\na\n", "image,phase\na,nan\n", "image,phase\n,0.5\n",
                          "image,phase,frame\na,0.5,1.5\n", "phase,frame\n0.5,1\n"})
    EXPECT_THROW(read(bad), InputError) << bad;
  EXPECT_THROW(ReadViewTimes(folder / "absent.csv"), InputError);
}

TEST(ViewTimes, PhotosWithoutOneAreLeftOutAndNamed) {
  const TemporaryFolder folder;
  WriteTextAtomically(folder / "t.csv", "image,phase,period\nb.png,0.5,1\nc.png,0.75,0\nz.png,0,0\n");
  Capture capture;
  for (const char* name : {"a.jpg", "b.jpg", "sub/c.jpg"}) capture.photos.emplace_back().name = name;
  ReconstructOptions options;
  options.times = folder / "t.csv";
  EXPECT_EQ(PeriodOfScene(options), 1.0);
  options.period_s = 4;
  EXPECT_EQ(PeriodOfScene(options), 4.0);
  const Capture timed = WithTimes(capture, options);
  ASSERT_EQ(timed.photos.size(), 2U);
  EXPECT_EQ(timed.photos[0].time_s, 6.0);
  EXPECT_EQ(timed.photos[1].time_s, 3.0);
  ASSERT_EQ(timed.unreadable.size(), 1U);
  EXPECT_EQ(timed.unreadable[0].name, "a.jpg");
  EXPECT_EQ(timed.total(), 3);
  capture.photos.resize(1);
  EXPECT_THROW(WithTimes(capture, options), DataError);
  options.times = folder / "s.csv";
  WriteTextAtomically(options.times, "a.jpg,3\n");
  options.period_s.reset();
  EXPECT_EQ(PeriodOfScene(options), std::nullopt);
}

}  // namespace
}  // namespace lumi
