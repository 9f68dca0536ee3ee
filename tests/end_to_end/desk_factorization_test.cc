// A desk photographed in no order, its cameras found by factorisation: as far from the truth as the method is held to.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/scene_folder.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr int kDeskPhotos = 24, kDeskWidthPx = 640;
constexpr double kDeskRotationDeg = 0.1,
                 kDeskCentrePercent =
                     0.3;  // of the worst photo; of the centres' extent, which is less than the scene's

TEST(DeskByFactorisation, IsWithinATenthOfADegreeAndThreePerMille) {
  const SimulatedCapture desk("desk", kDeskPhotos, kDeskWidthPx);
  const Scene truth = OpenScene(desk.path(), {}, SilentProgress());
  // Names say nothing of the order.
  const auto shuffled = [](std::size_t i) { return i * 7 % kDeskPhotos; };
  fs::create_directories(desk / "photos");
  for (std::size_t i = 0; i < truth.views.size(); ++i)
    fs::copy_file(truth.ImagePath(truth.views[i]), desk / "photos" / (std::to_string(100 + shuffled(i)) + ".jpg"));
  const ProgramResult run = RunProgram({"lumi-reconstruct", (desk / "photos").string(), "-o", (desk / "scene").string(),
                                        "--backend", "factorization", "--matching", "exhaustive", "--focal-px",
                                        std::to_string(truth.cameras.front().FocalPx().x()), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary["upgrade"], "metric");
  EXPECT_EQ(summary["images_registered"], kDeskPhotos);
  EXPECT_LT(summary["mean_reprojection_error_px"].get<double>(), 0.5);
  const Scene scene = OpenScene(desk / "scene", {}, SilentProgress());
  ASSERT_EQ(scene.views.size(), truth.views.size());
  std::vector<Rigid3> found, expected;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    found.push_back(scene.views[shuffled(i)].cam_from_world);  // sorted by name
    expected.push_back(truth.views[i].cam_from_world);
  }
  const PoseErrors e = ComparePoses(found, expected);
  std::printf("desk: centres %.4f %% worst, rotations %.4f degrees worst\n", e.centre_max_percent, e.rotation_max_deg);
  EXPECT_LT(e.centre_max_percent, kDeskCentrePercent);
  EXPECT_LT(e.rotation_max_deg, kDeskRotationDeg);
}

}  // namespace
}  // namespace lumi
