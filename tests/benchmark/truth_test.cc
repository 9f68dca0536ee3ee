#include "tests/benchmark/truth.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

constexpr double kRounding = 1e-6;  // of poses written with ten digits

TEST(Truth, CameraFilesHoldTheTransposedRotationAndTheCentre) {
  const TemporaryFolder folder;
  const Scene scene = MakeSmallScene(folder / "images", 5);
  for (const View& view : scene.views) {
    std::ostringstream text;
    text.precision(12);
    const Eigen::Matrix3d M = view.cam_from_world.R().transpose();
    text << "60 0 32\n0 60 24\n0 0 1\n0 0 0\n" << M << "\n" << view.CentreInWorld().transpose() << "\n64 48\n";
    WriteTextAtomically(folder / "truth" / (view.name + ".camera"), text.str());
  }
  const TruePoses truth = ReadTruePoses(folder / "truth");
  ASSERT_EQ(truth.size(), 5U);
  const auto errors = CompareWithTruth(scene, truth);
  ASSERT_TRUE(errors);
  EXPECT_LT(errors->centre_max_percent, kRounding * 100);
  EXPECT_LT(errors->rotation_max_deg, kRounding * 60);
}

TEST(Truth, AShiftedCameraShowsInPercentOfTheExtent) {
  const TemporaryFolder folder;
  Scene scene = MakeSmallScene(folder / "images", 9);
  WriteColmapModel(scene, folder / "truth");
  const TruePoses truth = ReadTruePoses(folder / "truth");
  scene.views[4].cam_from_world.translation.y() += 0.1;
  const auto errors = CompareWithTruth(scene, truth);
  ASSERT_TRUE(errors);
  EXPECT_GT(errors->centre_max_percent, 1);
  EXPECT_LT(errors->centre_max_percent, 5);
}

TEST(Truth, ACameraFarOffIsNamedThoughItPullsTheAlignment) {
  const TemporaryFolder folder;
  Scene scene = MakeSmallScene(folder / "images", 9);
  WriteColmapModel(scene, folder / "truth");
  const TruePoses truth = ReadTruePoses(folder / "truth");
  std::mt19937 random(2);
  std::normal_distribution<double> off(0, 1e-3);
  for (View& view : scene.views)
    for (int c = 0; c < 3; ++c) view.cam_from_world.translation[c] += off(random);
  EXPECT_TRUE(FarOff(scene, truth, 10).empty());
  scene.views[4].cam_from_world.translation.y() += 0.1;
  EXPECT_EQ(FarOff(scene, truth, 10), std::vector<std::string>{scene.views[4].name});
}

TEST(Truth, AThirdThatIsOffTogetherIsNamed) {
  const TemporaryFolder folder;
  Scene scene = MakeSmallScene(folder / "images", 12);
  WriteColmapModel(scene, folder / "truth");
  const TruePoses truth = ReadTruePoses(folder / "truth");
  std::mt19937 random(2);
  std::normal_distribution<double> off(0, 1e-4);
  std::vector<std::string> moved;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    for (int c = 0; c < 3; ++c) scene.views[v].cam_from_world.translation[c] += off(random);
    if (v >= 4) continue;
    scene.views[v].cam_from_world.translation.z() += 0.2;
    moved.push_back(scene.views[v].name);
  }
  EXPECT_EQ(FarOff(scene, truth, 10), moved);
}

TEST(Truth, WithoutCommonPhotosThereIsNothingToCompare) {
  const TemporaryFolder folder;
  EXPECT_FALSE(CompareWithTruth(MakeSmallScene(folder / "images", 5), {}));
  std::filesystem::create_directories(folder / "empty");
  EXPECT_THROW(ReadTruePoses(folder / "empty"), InputError);
}

}  // namespace
}  // namespace lumi
