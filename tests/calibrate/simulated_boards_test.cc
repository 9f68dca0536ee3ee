// Boards that lumi-simulate photographs, a ray for every sample of every pixel through distortion and skew: what is
// found in the pictures against what is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calibrate/detect_board.h"
#include "calibrate/fit.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/geometry/rigid3.h"
#include "scene/program/parallel.h"
#include "tests/support/child_program.h"

namespace lumi::test {
namespace {

const Board kBoard{9, 6, 25};

struct TrueView {
  std::string name;
  Camera camera;
  std::vector<Eigen::Vector2d> corners_px;
  std::optional<FoundBoard> found;
};

// The example `boards`; its board lies in the plane z = 0 about the origin.
std::vector<TrueView> Simulate(const std::filesystem::path& capture) {
  const ProgramResult run = RunProgram({"lumi-simulate", "--example", "boards", "-o", capture, "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::vector<TrueView> views;
  const nlohmann::json truth = nlohmann::json::parse(ReadText(capture / "truth/cameras.json"));
  for (const auto& v : truth["views"]) {
    const auto p = v["params"].get<std::vector<double>>();
    const auto m = v["cam_from_world"].get<std::vector<double>>();
    TrueView view{v["name"],
                  {CameraModel::kPlumbBob,
                   v["size_px"][0],
                   v["size_px"][1],
                   {p[0], p[1], p[2], p[3], v["skew_px"], p[4], p[5], p[6], p[7], 0}},
                  {},
                  {}};
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> pose =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(m.data());
    for (int row = 0; row < kBoard.rows; ++row)
      for (int column = 0; column < kBoard.columns; ++column) {
        const Eigen::Vector4d x(0.025 * (column - 0.5 * (kBoard.columns - 1)), 0.025 * (row - 0.5 * (kBoard.rows - 1)),
                                0, 1);
        view.corners_px.push_back(*view.camera.Project(pose * x));
      }
    views.push_back(view);
  }
  ParallelFor(views.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      views[i].found = FindBoard(ReadImage8(capture / "images" / views[i].name), kBoard).found;
  });
  return views;
}

class SimulatedBoards : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const TemporaryFolder folder;
    views_ = Simulate(folder / "capture");
  }
  static std::vector<TrueView> views_;
};
std::vector<TrueView> SimulatedBoards::views_;

// A board and itself turned by half a turn may be numbered either way.
double RmsError(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b) {
  double sum = 0, turned = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - b[i]).squaredNorm();
    turned += (a[i] - b[a.size() - 1 - i]).squaredNorm();
  }
  return std::sqrt(std::min(sum, turned) / static_cast<double>(a.size()));
}

TEST_F(SimulatedBoards, AreAllFoundAndTheirCornersAreRight) {
  ASSERT_GE(views_.size(), 10U);
  // Measured: 0.02 to 0.06 px. Half a pixel would be a convention of pixel centres gone wrong, a pixel a skew with the
  // wrong sign.
  constexpr double kTolerancePx = 0.1;
  for (const TrueView& view : views_) {
    ASSERT_TRUE(view.found) << view.name;
    std::vector<Eigen::Vector2d> mirrored = view.corners_px;  // seen from above, rows of the board run the other way
    for (std::size_t row = 0; row < mirrored.size(); row += 9)
      std::reverse(mirrored.begin() + static_cast<std::ptrdiff_t>(row),
                   mirrored.begin() + static_cast<std::ptrdiff_t>(row + 9));
    EXPECT_LT(std::min(RmsError(view.found->corners_px, view.corners_px), RmsError(view.found->corners_px, mirrored)),
              kTolerancePx)
        << view.name;
  }
}

TEST_F(SimulatedBoards, GiveIntrinsicsWithinThreeOfTheirStandardDeviations) {
  std::vector<BoardView> found;
  for (const TrueView& view : views_)
    if (view.found) found.push_back({view.name, view.found->corners_px, {}});
  const Camera& truth = views_.front().camera;
  const FitResult fit = Fit(kBoard, found, truth.width_px, truth.height_px, {});
  const Calibration& c = fit.calibration;
  std::printf("%zu views, model %s, RMS %.4f px\n", fit.views.size(), c.model.name.c_str(), c.rms_px);
  const auto check = [](const char* name, double value, double sigma, double true_value) {
    std::printf("%-4s %10.5f +- %.5f, truth %10.5f: off by %.2f sigma\n", name, value, sigma, true_value,
                (value - true_value) / sigma);
    EXPECT_GT(sigma, 0) << name << " is not free";
    EXPECT_LT(std::abs(value - true_value), 3 * sigma) << name;
  };
  const auto term = [&](const char* name, Term t, double true_value) {
    check(name, c.intrinsics[t], c.Sigma(t, c.noise_px), true_value);
  };
  term("fx", kFx, truth.Get(CameraTerm::kFx));
  check("fy", c.Fy(), c.SigmaFy(c.noise_px), truth.Get(CameraTerm::kFy));
  term("cx", kCx, truth.Get(CameraTerm::kCx));
  term("cy", kCy, truth.Get(CameraTerm::kCy));
  term("skew", kSkew, truth.Get(CameraTerm::kSkew));
  term("k1", kK1, truth.Get(CameraTerm::kK1));
  term("k2", kK2, truth.Get(CameraTerm::kK2));
  // No sigma so large that anything would do.
  EXPECT_LT(c.Sigma(kFx, c.noise_px) / truth.FocalPx().x(), 1e-3);
  EXPECT_LT(c.Sigma(kSkew, c.noise_px), 0.1);
}

}  // namespace
}  // namespace lumi::test
