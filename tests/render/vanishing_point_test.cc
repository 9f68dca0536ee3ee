#include "render/world/vanishing_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "projective_capture.h"
#include "render/picture/border_fill.h"
#include "render/world/per_view_proxy.h"
#include "scene/geometry/angle.h"

namespace lumi {
namespace {

constexpr double kRounding = 1e-10;  // of angles, radians, through a transformation of condition 30

class VanishingPoints : public testing::Test {
 protected:
  VanishingPoints() : capture_(test::MakeCapture(10, 64)) {
    capture_.scene.points = test::SeenPoints(capture_);
    projective_ = test::Projective(capture_.scene, T_);
  }
  Matrix34d P(std::size_t view) const { return projective_.views[view].P; }
  Plane plane() const { return *projective_.plane_at_infinity; }

  const Eigen::Matrix4d T_ = test::RandomTransformation(11, 30);
  test::Capture capture_;
  Scene projective_;
};

TEST_F(VanishingPoints, AreEuclideanAnglesWhereThePlaneAndTheCalibrationAreTrue) {
  const Scene& metric = capture_.scene;
  for (std::size_t i = 0; i < metric.views.size(); ++i) {
    const auto frame = VanishingPointFrame::Make(P(i), plane(), metric.cameras[0].K(), 1);
    ASSERT_TRUE(frame);
    for (const Point& p : metric.points) {
      const Eigen::Vector4d moved = frame->MovePoint(T_ * p.x_in_world.homogeneous());
      const Eigen::Vector3d x = moved.head<3>() / moved.w();
      for (std::size_t j = 0; j < metric.views.size(); ++j) {
        const auto source = frame->MoveCamera(P(j));
        ASSERT_TRUE(source);
        const double true_angle = AngleBetween(Eigen::Vector3d(p.x_in_world - metric.views[i].CentreInWorld()),
                                               Eigen::Vector3d(p.x_in_world - metric.views[j].CentreInWorld()));
        ASSERT_NEAR(AngleBetween(x, Eigen::Vector3d(x - source->centre)), true_angle, kRounding);
      }
    }
  }
}

// Eq. 6.1 as it stands: v = P_i P_j+ x_j with the inverse projection onto the plane at infinity, oriented; and K0.
TEST_F(VanishingPoints, AreThoseOfTheHomographyThroughThePlaneAtInfinity) {
  const Eigen::Matrix3d K0 = NominalCalibration({64, 48}, NominalFocalPx({64, 48})), K0_inverse = K0.inverse();
  const auto frame = VanishingPointFrame::Make(P(2), plane(), K0, 0.7);
  ASSERT_TRUE(frame);
  for (std::size_t j = 0; j < projective_.views.size(); ++j) {
    const auto H = PlaneHomography(P(2), P(j), plane());
    const auto source = frame->MoveCamera(P(j));
    ASSERT_TRUE(H && source);
    for (const Point& p : projective_.points) {
      const Eigen::Vector3d x_i = P(2) * p.X_in_world, x_j = P(j) * p.X_in_world;
      if (!(x_i.z() > 0 && x_j.z() > 0)) continue;
      Eigen::Vector3d v = *H * x_j;
      if (H->determinant() < 0) v = -v;  // its own sign is arbitrary
      const Eigen::Vector4d moved = frame->MovePoint(p.X_in_world);
      const Eigen::Vector3d x = moved.head<3>() / moved.w();
      ASSERT_NEAR(AngleBetween(x, Eigen::Vector3d(x - source->centre)),
                  AngleBetween(Eigen::Vector3d(K0_inverse * v), Eigen::Vector3d(K0_inverse * x_i)), kRounding);
    }
  }
}

TEST_F(VanishingPoints, DoNotDependOnScalesNorOnTheWorld) {
  const Eigen::Matrix3d K0 = NominalCalibration({64, 48}, 70);
  const auto a = VanishingPointFrame::Make(P(0), plane(), K0, 0.5);
  for (const double scale : {1e-8, 3.0, 1e8}) {
    // kappa = pi . X / w has the scales of both.
    const auto b = VanishingPointFrame::Make(scale * P(0), 7 * plane(), K0, 0.5 * 7 / scale);
    ASSERT_TRUE(a && b);
    for (std::size_t j = 1; j < projective_.views.size(); ++j) {
      EXPECT_LT((a->MoveCamera(P(j))->centre - b->MoveCamera(scale * P(j))->centre).norm(), kRounding);
      EXPECT_LT((a->MoveCamera(P(j))->P - b->MoveCamera(P(j))->P).norm(), 100 * kRounding) << "in pixels";
    }
  }
  EXPECT_FALSE(VanishingPointFrame::Make(P(0), plane(), K0, 0));
  const Eigen::Vector4d C = CentreOfProjection(P(0));
  EXPECT_FALSE(VanishingPointFrame::Make(P(0), plane() - plane().dot(C) * C, K0, 1)) << "a centre on the plane";
  Matrix34d flat = P(0);
  flat.row(1) = flat.row(0);
  EXPECT_FALSE(VanishingPointFrame::Make(flat, plane(), K0, 1)) << "no rank 3";
}

TEST_F(VanishingPoints, APictureOfThemHasItsPointsAtDepthOneOrSoAndInThePicture) {
  GiveTimes(projective_);
  const PerViewProxy proxy(projective_);
  RenderView view;
  view.P = P(5);
  view.size_px = {64, 48};
  view.time_s = projective_.views[5].time_s;
  const PictureWorld all = proxy.For(view), near = proxy.For(view, 2);
  EXPECT_EQ(all.photos.size(), 10u);
  EXPECT_EQ(near.photos, (std::vector<std::int32_t>{3, 4, 5, 6, 7}));
  EXPECT_TRUE(std::all_of(near.use.begin(), near.use.end(), [](bool u) { return u; }));
  EXPECT_EQ(near.sources.views[2].centre, Eigen::Vector3d::Zero()) << "the view's own photo is exactly where it is";
  std::vector<double> depths;
  for (const Eigen::Vector3d& x : near.proxy.vertices) depths.push_back(x.z());
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2), depths.end());
  EXPECT_NEAR(depths[depths.size() / 2], 1, 0.05);
  EXPECT_GT(*std::min_element(depths.begin(), depths.end()), 0);
}

TEST_F(VanishingPoints, PointsThatOnlyOtherPhotosSeeAreNotInView) {
  GiveTimes(projective_);
  // Half of the points are seen by the first three photos only.
  for (std::size_t i = 0; i < projective_.points.size(); i += 2) {
    auto& track = projective_.points[i].track;
    std::erase_if(track, [](const Observation& o) { return o.view.value > 2; });
  }
  const PerViewProxy proxy(projective_);
  RenderView view;
  view.P = P(7);
  view.size_px = {64, 48};
  view.time_s = projective_.views[7].time_s;
  EXPECT_LT(proxy.For(view, 1).proxy.vertices.size(), proxy.For(view).proxy.vertices.size());
  EXPECT_EQ(proxy.For(view, 9).proxy.vertices.size(), proxy.For(view).proxy.vertices.size());
}

TEST(PhotoOrder, IsThatOfTimesElseOfFramesElseOfNames) {
  Scene s;
  for (int i = 0; i < 6; ++i) s.views.push_back({});
  const PhotoOrder names(s);
  EXPECT_EQ(names.view(4), 4);
  for (int i = 0; i < 6; ++i) s.views[static_cast<std::size_t>(i)].frame_index = (5 * i) % 6;
  const PhotoOrder frames(s);
  EXPECT_EQ(frames.view(5), 1);
  GiveTimes(s);
  const PhotoOrder times(s);
  EXPECT_EQ(times.view(5), 1);
  EXPECT_EQ(times.Around(0.0, 2), std::pair(0, 2));
  EXPECT_EQ(times.Around(3.4 / 30, 1), std::pair(2, 4));
  EXPECT_EQ(times.Around(100.0, 1), std::pair(4, 5));
  EXPECT_EQ(times.Around(0.1, -1), std::pair(0, 5));
  EXPECT_EQ(times.Around(std::nullopt, 1), std::pair(0, 5));
}

TEST(FillSmoothly, KeepsWhatIsThereAndIsConstantAroundAConstant) {
  ImageF image(37, 23, 4);
  for (int y = 5; y < 14; ++y)
    for (int x = 8; x < 21; ++x)
      for (int c = 0; c < 4; ++c) image.At(x, y, c) = c == 3 ? 1.0F : 0.2F * static_cast<float>(c + 1);
  image.At(7, 7, 0) = 0.1F;  // half a pixel of the same colour
  image.At(7, 7, 1) = 0.2F;
  image.At(7, 7, 2) = 0.3F;
  image.At(7, 7, 3) = 0.5F;
  FillSmoothly(image);
  for (int y = 0; y < 23; ++y)
    for (int x = 0; x < 37; ++x)
      for (int c = 0; c < 4; ++c)
        ASSERT_NEAR(image.At(x, y, c), c == 3 ? 1.0F : 0.2F * static_cast<float>(c + 1), 1e-5F)
            << x << ' ' << y << ' ' << c;
}

TEST(FillSmoothly, IsSmoothBetweenTwoColoursAndLeavesAnEmptyPictureEmpty) {
  ImageF image(64, 8, 4);
  for (int y = 0; y < 8; ++y)
    for (const int x : {0, 63}) {
      image.At(x, y, 0) = x == 0 ? 0.0F : 1.0F;
      image.At(x, y, 3) = 1;
    }
  FillSmoothly(image);
  for (int x = 0; x < 63; ++x) {
    EXPECT_LT(std::abs(image.At(x + 1, 4, 0) - image.At(x, 4, 0)), 0.3F) << x;
    EXPECT_GE(image.At(x + 1, 4, 0), image.At(x, 4, 0) - 0.02F) << x;
  }
  ImageF empty(5, 3, 4);
  FillSmoothly(empty);
  for (const float v : empty.data) EXPECT_EQ(v, 0);
}

}  // namespace
}  // namespace lumi
