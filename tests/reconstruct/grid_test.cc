#include "reconstruct/grid.h"

#include <random>

#include "database_fixture.h"
#include "reconstruct/near_pairs.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kGridExact = 1e-12;

TEST(GridSearch, FindsWhichWayTheCoordinatesRun) {
  for (const double sign : {1.0, -1.0}) {
    const FixtureFolder folder("grid");
    std::mt19937 random(12);
    std::uniform_real_distribution<double> coordinate(-2, 2), depth(8, 16);
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 100; ++i) points.emplace_back(coordinate(random), coordinate(random), depth(random));
    const Camera camera = Camera::Pinhole(640, 480, 700, 700, 320, 240);
    Capture capture;
    {
      TestDatabase db(folder.path() / "database.db");
      for (int v = 0; v < 9; ++v) {
        InputPhoto photo;
        photo.name = "p" + std::to_string(v) + ".jpg";
        photo.width_px = 640;
        photo.height_px = 480;
        capture.photos.push_back(photo);
        std::vector<Eigen::Vector2d> keypoints;
        for (const auto& X : points)
          keypoints.push_back(*camera.Project(GridPose(sign * (v % 3), v / 3) * X));  // columns run right or left
        db.AddImage(v + 1, photo.name, keypoints);
      }
      std::vector<std::pair<int, int>> matches;
      for (int i = 0; i < 100; ++i) matches.emplace_back(i, i);
      for (int a = 1; a <= 9; ++a)
        for (int b = a + 1; b <= 9; ++b) db.AddMatches(a, b, matches);
    }
    ReconstructOptions options;
    options.rig = Rig::kGrid;
    options.grid_size = "3x3";
    options.focal_px = 700;
    const auto views =
        AssumeGrid(capture, options, GridPositions(capture, options), folder.path() / "database.db", SilentProgress());
    EXPECT_NEAR(views[1].cam_from_world.OriginInSource().x(), sign, kGridExact);
    EXPECT_NEAR(views[3].cam_from_world.OriginInSource().y(), 1, kGridExact);
    options.grid_size = "2x4";
    EXPECT_THROW(GridPositions(capture, options), DataError);
  }
}

TEST(GridPose, CamerasAreParallel) {
  const Rigid3 pose = GridPose(3, 2);
  EXPECT_LT((pose.OriginInSource() - Eigen::Vector3d(3, 2, 0)).norm(), kGridExact);
  EXPECT_LT((pose * Eigen::Vector3d(3, 2, 7) - Eigen::Vector3d(0, 0, 7)).norm(), kGridExact);
}

TEST(GridSize, IsRowsTimesColumns) {
  EXPECT_EQ(ParseGridSize("17x16"), std::pair(17, 16));
  for (const char* wrong : {"", "17", "17x", "x17", "0x4", "-1x4", "3x4x5", "axb"})
    EXPECT_THROW(ParseGridSize(wrong), UsageError) << wrong;
}

TEST(GridNames, SayWhereTheCameraStood) {
  const auto p = PositionFromName("left/out_03_16_-381.909271_1103.376221.jpg");
  ASSERT_TRUE(p);
  EXPECT_EQ(p->vertical, -381.909271);
  EXPECT_EQ(p->horizontal, 1103.376221);
  EXPECT_TRUE(PositionFromName("out_00_00_1_2_.png"));  // as the archive's own files end
  for (const char* other :
       {"IMG_0001.jpg", "out_00_00.jpg", "a_b_c_1_2.jpg", "out_0.5_1_1_2.jpg", "out_00_01_nan_2.jpg", ""})
    EXPECT_FALSE(PositionFromName(other)) << other;
}

// A grid of 4 x 5 cameras that look at points 8 to 16 away, in coordinates that run as the signs say, shifted to
// coincide at `plane`.
struct SimulatedGrid {
  std::vector<GridPosition> positions;
  std::vector<RigMatch> matches;
  double focal_px = 700;
  SimulatedGrid(double sign_h, double sign_v, double plane, double noise_px) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> coordinate(-2, 2), depth(8, 16);
    std::normal_distribution<double> noise(0, noise_px);
    const auto at = [&](int camera) {
      return Eigen::Vector2d(sign_h * 0.1 * (camera % 5), sign_v * 0.1 * (camera / 5));
    };
    for (int c = 0; c < 20; ++c) positions.push_back({0.1 * (c % 5), 0.1 * (c / 5)});
    for (int m = 0; m < 2000; ++m) {
      const int a = static_cast<int>(random() % 20), b = static_cast<int>(random() % 20);
      if (a == b) continue;
      const Eigen::Vector2d X(coordinate(random), coordinate(random));
      const double Z = depth(random);
      const auto see = [&](int c) -> Eigen::Vector2d {
        const Eigen::Vector2d x = focal_px * (X - at(c)) / Z +
                                  (plane > 0 ? Eigen::Vector2d(focal_px / plane * at(c)) : Eigen::Vector2d::Zero());
        return x + Eigen::Vector2d(noise(random), noise(random));
      };
      matches.push_back({a, b, see(a), see(b)});
      if (m % 100 == 0) matches.back().x_b_px += Eigen::Vector2d(30, -50);  // wrong matches
    }
  }
};

TEST(GridFit, CoordinatesOfPhotosThatWereNotShiftedAreFoundOutWhicheverWayTheyRun) {
  for (const double h : {1.0, -1.0})
    for (const double v : {1.0, -1.0}) {
      const SimulatedGrid grid(h, v, 0, 0.3);
      const GridFit fit = FitGrid(grid.positions, grid.matches, grid.focal_px, std::nullopt);
      EXPECT_EQ(fit.sign_h, h);
      EXPECT_EQ(fit.sign_v, v);
      EXPECT_TRUE(fit.signs_known);
      EXPECT_EQ(fit.shear_px, 0);
      EXPECT_GT(fit.agreement, 0.9);
    }
}

TEST(GridFit, APlaneAmidTheSceneIsMovedBehindSoThatAllLiesInFront) {
  const SimulatedGrid grid(1, -1, 11, 0.3);
  const GridFit fit = FitGrid(grid.positions, grid.matches, grid.focal_px, std::nullopt);
  EXPECT_FALSE(fit.signs_known);
  EXPECT_EQ(fit.sign_h * fit.sign_v, -1);  // beside each other they are known
  // Shifts of the points: f / Z - f / 11. With the shear added all are in front, the farthest about 4 times as far.
  const double nearest = grid.focal_px / 8 - grid.focal_px / 11 + fit.shear_px,
               farthest = grid.focal_px / 16 - grid.focal_px / 11 + fit.shear_px;
  EXPECT_GT(farthest, 0);
  EXPECT_NEAR(nearest / farthest, 4, 1);  // wrong matches and noise may widen the range
  EXPECT_NEAR(FitGrid(grid.positions, grid.matches, grid.focal_px, 11.0).shear_px, grid.focal_px / 11, kGridExact);
}

TEST(GridFit, PhotosThatAreNoGridAreRefused) {
  SimulatedGrid grid(1, 1, 0, 0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(0, 600);
  for (RigMatch& m : grid.matches)
    m.x_b_px = Eigen::Vector2d(anywhere(random), anywhere(random)) + Eigen::Vector2d(5000, 0);
  for (RigMatch& m : grid.matches) m.a = 0, m.b = 5;  // straight down, yet they move to the right
  EXPECT_THROW(FitGrid(grid.positions, grid.matches, grid.focal_px, std::nullopt), DataError);
}

TEST(NearPairs, AreThoseThatStandNearAndLookTheSameWay) {
  std::vector<KnownStand> cameras;
  for (int i = 0; i < 100; ++i)
    cameras.push_back({{static_cast<double>(i), 0, 0}, Eigen::Vector3d(0, 0, i % 2 == 0 ? 1 : -1)});
  const auto pairs = NearPairs(cameras);
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  std::size_t of_50 = 0;
  for (const auto& [a, b] : pairs) {
    ASSERT_LT(a, b);
    EXPECT_EQ((b - a) % 2, 0) << "they look away from each other";
    of_50 += a == 50 || b == 50;
  }
  EXPECT_GE(of_50, 12U);
  EXPECT_LT(pairs.size(), 100U * 17);
  EXPECT_TRUE(std::find(pairs.begin(), pairs.end(), std::pair(50, 52)) != pairs.end());
  EXPECT_TRUE(NearPairs({}).empty());
  EXPECT_TRUE(NearPairs({cameras[0]}).empty());
}

}  // namespace
}  // namespace lumi
