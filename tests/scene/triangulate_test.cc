#include "scene/triangulation/triangulate.h"

#include <gtest/gtest.h>

#include "random_scene.h"

namespace lumi {
namespace {

TEST(Triangulate, ExactImagesGiveThePointBack) {
  test::Random random(21);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d x = random.InBox(0.5);
    std::vector<Matrix34d> P;
    std::vector<Eigen::Vector2d> px;
    for (int k = 0; k < 2 + i % 4; ++k) {
      P.push_back(ProjectionMatrix(test::TestCamera().K(), random.PoseAroundBox()));
      px.push_back(*Project(P.back(), x));
    }
    const auto t = Triangulate(P, px);
    ASSERT_TRUE(t);
    // Rounding of pixels over focal length (1e-16 * 1e3 / 5e2), magnified by the inverse of the angle.
    EXPECT_LT((t->x_in_world - x).norm(), 1e-12 / t->max_angle_rad);
    EXPECT_LT(t->rms_px, 1e-9);
  }
}

TEST(Triangulate, NoiseOfAPixelStaysAPixel) {
  test::Random random(22);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d x = random.InBox(0.5);
    std::vector<Matrix34d> P;
    std::vector<Eigen::Vector2d> px;
    for (int k = 0; k < 5; ++k) {
      P.push_back(ProjectionMatrix(test::TestCamera().K(), random.PoseAroundBox()));
      px.push_back(*Project(P.back(), x) + Eigen::Vector2d(random.Uniform(-1, 1), random.Uniform(-1, 1)));
    }
    const auto t = Triangulate(P, px);
    ASSERT_TRUE(t);
    EXPECT_LT(t->rms_px, 1.2);                    // at most the noise's own radius
    EXPECT_LT((t->x_in_world - x).norm(), 0.05);  // 6 units away, f 520: a pixel is 0.012
  }
}

TEST(Triangulate, ParallelRaysOneViewAndPointsBehindHaveNoAnswer) {
  const Eigen::Matrix3d K = test::TestCamera().K();
  const Matrix34d a = ProjectionMatrix(K, Rigid3{});
  const Matrix34d b = ProjectionMatrix(K, Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 0, 0)});
  const Eigen::Vector2d centre(318.5, 241.25);
  EXPECT_FALSE(Triangulate({a}, {centre}));
  EXPECT_FALSE(Triangulate({a, b}, {centre, centre}));
  EXPECT_FALSE(Triangulate({a, a}, {centre, centre}));
  // Rays that diverge forwards meet behind the cameras.
  EXPECT_FALSE(Triangulate({a, b}, {centre - Eigen::Vector2d(50, 0), centre + Eigen::Vector2d(50, 0)}));
  EXPECT_TRUE(Triangulate({a, b}, {centre + Eigen::Vector2d(50, 0), centre - Eigen::Vector2d(50, 0)}));
}

}  // namespace
}  // namespace lumi
