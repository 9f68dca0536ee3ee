#include "reconstruct/adjust_frames.h"

#include <random>

#include "database_fixture.h"
#include "reconstruct/options.h"
#include "reconstruct/reprojection.h"

namespace lumi {
namespace {

// Cameras waved and rolled (which tells a principal point from a turn) before points in a room, one lens; keyframes and
// points as a first mapping leaves them, its lens a little off.
class FramesAdjust : public ::testing::Test {
 protected:
  static constexpr int kKeyframes = 8, kFrames = 40, kPoints = 150;
  static constexpr double kNoisePx = 0.3;

  void SetUp() override {
    truth_.model = CameraModel::kRadial;
    truth_.width_px = 320;
    truth_.height_px = 240;
    truth_.params = {400, 164, 117, 0.02, 0};
    std::uniform_real_distribution<double> across(-0.9, 0.9), deep(3, 7);
    for (int i = 0; i < kPoints; ++i) points_.emplace_back(across(random_), 0.8 * across(random_), deep(random_));
    Camera started = truth_;
    started.params = {406, 160, 120, 0, 0};
    scene_.cameras = {started};
    for (int i = 0; i < kPoints; ++i)
      scene_.points.emplace_back().x_in_world = points_[static_cast<std::size_t>(i)] + 0.01 * Any();
    for (int k = 0; k < kKeyframes; ++k) {
      View view;
      view.name = "frame_" + std::to_string(k) + ".jpg";
      view.camera = CameraId{0};
      const Rigid3 pose = Pose(k * kFrames / kKeyframes);
      view.cam_from_world = pose;
      view.cam_from_world.translation += 0.003 * Any();
      scene_.views.push_back(view);
      for (const auto& [point, x] : Seen(pose))
        scene_.points[static_cast<std::size_t>(point)].track.push_back({ViewId{k}, x});
    }
    for (const Point& point : scene_.points) ASSERT_GE(point.track.size(), 2U);
    for (int f = 0; f < kFrames; ++f) {
      PlacedCamera placed;
      placed.ok = f % 10 != 3;
      placed.cam_from_world = Pose(f);
      placed.cam_from_world.translation += 0.003 * Any();
      placed.observations = Seen(placed.ok ? Pose(f) : Rigid3{});
      placed_.push_back(placed);
    }
  }

  Eigen::Vector3d Any() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  static Rigid3 Pose(int f) {
    const double t = 0.35 * f;
    return LookAt(Eigen::Vector3d(1.5 * std::sin(t), 0.8 * std::cos(0.7 * t), 0.8 * std::sin(0.4 * t)),
                  Eigen::Vector3d(0, 0, 5), Eigen::Vector3d(0.6 * std::sin(0.9 * t), -1, 0));
  }
  // One sighting in fifty is of something else.
  std::vector<std::pair<std::int32_t, Eigen::Vector2d>> Seen(const Rigid3& pose) {
    std::vector<std::pair<std::int32_t, Eigen::Vector2d>> seen;
    for (int i = 0; i < kPoints; ++i) {
      const auto x = truth_.Project(pose * points_[static_cast<std::size_t>(i)]);
      if (!x || x->x() < 0 || x->y() < 0 || x->x() >= truth_.width_px || x->y() >= truth_.height_px) continue;
      const double noise = i % 50 == 7 ? 10 * kNoisePx : kNoisePx;
      seen.emplace_back(i, *x + noise * Any().head<2>());
    }
    return seen;
  }

  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
  FixtureFolder folder_{"adjust"};
  Camera truth_;
  std::vector<Eigen::Vector3d> points_;
  Scene scene_;
  std::vector<PlacedCamera> placed_;
};

TEST_F(FramesAdjust, LensIsFoundAndOnlyKeyframesStay) {
  ColmapProgram colmap(folder_.path() / "colmap.log", SilentProgress());
  AdjustWithFrames(scene_, placed_, false, {ReconstructOptions{}, folder_.path(), colmap, SilentProgress()});
  EXPECT_EQ(scene_.views.size(), static_cast<std::size_t>(kKeyframes));
  EXPECT_EQ(scene_.points.size(), static_cast<std::size_t>(kPoints));
  // 6 and 5 px off before. What 0.3 px of noise leaves is mostly what focal length and distortion, principal point and
  // turns share: 2.4 and 0.8 px with these numbers.
  EXPECT_NEAR(scene_.cameras[0].FocalPx().x(), truth_.FocalPx().x(), 4);
  EXPECT_LT((scene_.cameras[0].PrincipalPointPx() - truth_.PrincipalPointPx()).norm(), 1.5);
  for (const Point& point : scene_.points)
    for (const Observation& o : point.track) EXPECT_LT(o.view.value, kKeyframes);
  EXPECT_LT(UpdatePointErrors(scene_), 2 * kNoisePx);
}

TEST_F(FramesAdjust, ALensThatIsKnownStays) {
  scene_.cameras = {truth_};
  ColmapProgram colmap(folder_.path() / "colmap.log", SilentProgress());
  AdjustWithFrames(scene_, placed_, true, {ReconstructOptions{}, folder_.path(), colmap, SilentProgress()});
  EXPECT_EQ(scene_.cameras[0].params, truth_.params);
  EXPECT_LT(UpdatePointErrors(scene_), 2 * kNoisePx);
}

TEST_F(FramesAdjust, WithoutFramesNothingChanges) {
  for (PlacedCamera& p : placed_) p.ok = false;
  const Scene before = scene_;
  ColmapProgram colmap(folder_.path() / "colmap.log", SilentProgress());
  AdjustWithFrames(scene_, placed_, false, {ReconstructOptions{}, folder_.path(), colmap, SilentProgress()});
  EXPECT_EQ(scene_.cameras[0].params, before.cameras[0].params);
  EXPECT_EQ(scene_.points[5].track.size(), before.points[5].track.size());
}

}  // namespace
}  // namespace lumi
