// Vanishing-point angles next to their degenerate neighbours: transformations of condition up to 1e6, one centre for
// all cameras, planes at infinity through points and centres, vanishing points behind the view, epipoles at infinity.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "projective_capture.h"
#include "render/radiance/frame_plan.h"
#include "render/world/per_view_proxy.h"
#include "render/world/vanishing_point.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// Of a weight: what the same picture in another world may differ by.
constexpr double kSameWeight = 1e-6;
// With the resolution measure, which is made of floats: their last digits are 1e-7 of a penalty, a few 1e-6 of a
// weight.
constexpr double kSameWithResolution = 1e-5;

// Weights of all photos at every pixel, and alpha behind them.
std::vector<std::vector<double>> Weights(const PictureWorld& world, const RadianceSettings& settings) {
  const ViewSetup setup = MakeViewSetup(world.sources, world.view, settings, world.use);
  const ProxyTracer tracer(world.proxy, world.sources.normalized_from_world);
  FramePlan plan;
  WeighScratch scratch;
  PlanPixels(setup, tracer, nullptr, {0, 0, world.view.size_px.x(), world.view.size_px.y()}, plan, scratch);
  std::vector<std::vector<double>> weights;
  for (std::size_t s = 0; s < plan.alpha.size(); ++s) {
    std::vector<double> w(world.photos.size() + 1, 0.0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(plan.k); ++i)
      if (const std::int32_t c = plan.camera[s * static_cast<std::size_t>(plan.k) + i]; c >= 0)
        w[static_cast<std::size_t>(c)] = plan.weight[s * static_cast<std::size_t>(plan.k) + i];
    w.back() = plan.alpha[s];
    weights.push_back(w);
  }
  return weights;
}

void ExpectSameWeights(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b,
                       const std::string& what, double tolerance = kSameWeight) {
  ASSERT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t s = 0; s < a.size(); ++s)
    for (std::size_t i = 0; i < a[s].size(); ++i) {
      ASSERT_TRUE(std::isfinite(a[s][i]) && std::isfinite(b[s][i]));
      worst = std::max(worst, std::abs(a[s][i] - b[s][i]));
    }
  EXPECT_LE(worst, tolerance) << what;
}

RenderView ViewOf(const Scene& scene, std::size_t i) {
  RenderView v;
  v.P = scene.views[i].P;
  v.size_px = scene.views[i].size_px;
  v.time_s = scene.views[i].time_s;
  return v;
}

class VanishingPointsHardCase : public testing::Test {
 protected:
  VanishingPointsHardCase() : capture_(test::MakeCapture(12, 64)) {
    capture_.scene.points = test::SeenPoints(capture_);
    settings_.time = true;
    settings_.time_core = 0;
    settings_.time_least = 0.01;
    settings_.time_window_s = 11.0 / 30;
  }
  // Between two photos, a little turned.
  RenderView Between(const Eigen::Matrix4d& T) const {
    RenderView v;
    v.P = test::InWorldOf(
        MakeRenderView(capture_.scene.cameras[0], LookAt({0.4, 0.2, -4.6}, {0.05, 0, 0.4}, {0, -1, 0})).P, T);
    v.size_px = {64, 48};
    v.time_s = 5.3 / 30;
    return v;
  }
  test::Capture capture_;
  RadianceSettings settings_;
};

TEST_F(VanishingPointsHardCase, AnyProjectiveTransformationOfTheSceneRendersWithTheSameWeights) {
  Scene reference = test::Projective(capture_.scene, Eigen::Matrix4d::Identity());
  GiveTimes(reference);
  const PerViewProxy proxy(reference);
  RadianceSettings with_resolution = settings_;
  with_resolution.resolution = Resolution::kJacobian;
  for (const int reach : {-1, 3}) {
    const PictureWorld world = proxy.For(Between(Eigen::Matrix4d::Identity()), reach);
    const auto wanted = Weights(world, settings_), wanted_with_resolution = Weights(world, with_resolution);
    for (unsigned seed = 1; seed <= 6; ++seed)
      for (const double condition : {1.0, 1e2, 1e4, 1e6}) {
        const Eigen::Matrix4d T = test::RandomTransformation(seed, condition);
        Scene other = test::Projective(capture_.scene, T);
        GiveTimes(other);
        const std::string what = "condition " + std::to_string(condition) + ", seed " + std::to_string(seed);
        const PictureWorld there = PerViewProxy(other).For(Between(T), reach);
        ExpectSameWeights(Weights(there, settings_), wanted, what);
        ExpectSameWeights(Weights(there, with_resolution), wanted_with_resolution, what + ", resolution",
                          kSameWithResolution);
      }
  }
}

TEST_F(VanishingPointsHardCase, APlaneThatIsNotTheTrueOneIsCarriedAlongToo) {
  // Behind all cameras and points, and slanted: a quasi-affine guess.
  const Plane guess(0.02, -0.01, 0.05, 1);
  const auto with_guess = [&](const Eigen::Matrix4d& T) {
    Scene s = test::Projective(capture_.scene, T);
    s.plane_at_infinity = test::InWorldOf(guess, T);
    GiveTimes(s);
    return s;
  };
  const Scene reference = with_guess(Eigen::Matrix4d::Identity());
  const auto wanted = Weights(PerViewProxy(reference).For(Between(Eigen::Matrix4d::Identity())), settings_);
  for (unsigned seed = 20; seed < 24; ++seed) {
    const Eigen::Matrix4d T = test::RandomTransformation(seed, 1e6);
    const Scene other = with_guess(T);
    ExpectSameWeights(Weights(PerViewProxy(other).For(Between(T)), settings_), wanted, "seed " + std::to_string(seed));
  }
}

TEST_F(VanishingPointsHardCase, WeightsAreTheMetricOnesWherePlaneAndCalibrationAreTrue) {
  Scene metric = capture_.scene;
  GiveTimes(metric);
  RenderView view = Between(Eigen::Matrix4d::Identity());
  const Eigen::Vector4d C = CentreOfProjection(view.P);
  view.centre = C.head<3>() / C.w();
  const auto wanted = Weights(PerViewProxy(metric).For(view), settings_);
  PerViewOptions options;
  options.nominal_focal_px = 0.9 * 64;
  const Eigen::Matrix4d T = test::RandomTransformation(31, 1e3);
  Scene other = test::Projective(metric, T);
  ExpectSameWeights(Weights(PerViewProxy(other, options).For(Between(T)), settings_), wanted, "metric");
}

TEST_F(VanishingPointsHardCase, CamerasAtOneCentreAreToldApartByTimeAlone) {
  // The photos of a camera that only turned, as homographies and points (x, y, 1, 1) of the first; and the same in
  // another world.
  Scene turning = capture_.scene;
  turning.frame = Frame::kQuasiAffine;
  const Eigen::Matrix3d K = turning.cameras[0].K();
  for (std::size_t i = 0; i < turning.views.size(); ++i) {
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(0.02 * (static_cast<double>(i) - 5.5), Eigen::Vector3d(0.3, 1, 0.1).normalized())
            .toRotationMatrix();
    turning.views[i].P.setZero();
    turning.views[i].P.leftCols<3>() = K * R * K.inverse();
    turning.views[i].size_px = {64, 48};
  }
  for (std::size_t n = 0; n < turning.points.size(); ++n)
    turning.points[n].X_in_world = {64 * std::fmod(0.618 * static_cast<double>(n), 1.0),
                                    48 * std::fmod(0.414 * static_cast<double>(n), 1.0), 1, 1};
  GiveTimes(turning);
  for (const double condition : {0.0, 1.0, 1e3, 1e6}) {
    Scene s = turning;
    if (condition > 0) {
      const Eigen::Matrix4d T = test::RandomTransformation(7, condition);
      s.frame = Frame::kProjective;
      for (View& v : s.views) v.P = test::InWorldOf(v.P, T);
      for (Point& p : s.points) p.X_in_world = T * p.X_in_world;
      s.plane_at_infinity = test::InWorldOf(Plane(0, 0, 0, 1), T);
    }
    const PerViewProxy proxy(s);
    for (const std::size_t at : {5U, 6U}) {
      const PictureWorld world = proxy.For(ViewOf(s, at), 5);
      for (const RenderView& v : world.sources.views)
        ASSERT_EQ(v.centre, Eigen::Vector3d::Zero()) << "condition " << condition;
      RadianceSettings settings = settings_;
      settings.resolution = Resolution::kOff;
      settings.time_s = *s.views[at].time_s;
      const auto weights = Weights(world, settings);
      const std::size_t middle = 24 * 64 + 32,
                        own = static_cast<std::size_t>(
                            std::find(world.photos.begin(), world.photos.end(), static_cast<std::int32_t>(at)) -
                            world.photos.begin());
      EXPECT_GT(weights[middle][own], 0.75);
      EXPECT_NEAR(weights[middle][own - 1], weights[middle][own + 1], 1e-5) << "as far in time";
      // From pixel to pixel nothing jumps: where a photo ends it has given way.
      for (std::size_t y = 0; y < 48; ++y)
        for (std::size_t x = 1; x < 64; ++x)
          for (std::size_t j = 0; j < world.photos.size(); ++j)
            ASSERT_LT(std::abs(weights[64 * y + x][j] - weights[64 * y + x - 1][j]), 0.75) << x << ' ' << y << ' ' << j;
    }
  }
}

TEST_F(VanishingPointsHardCase, APlaneAtInfinityThatReachesAPointLeavesThePointOut) {
  const Scene scene = test::Projective(capture_.scene, Eigen::Matrix4d::Identity());
  // Slanted planes ever nearer to the farthest point, and beyond it: the point's inverse depth falls through 0.
  double farthest = 0;
  for (const Point& p : scene.points) farthest = std::max(farthest, p.x_in_world.z());
  for (const double distance : {1e-2, 1e-4, 1e-8, 1e-12, 1e-15, 0.0, -1e-15, -1e-8, -1e-2, -1.0}) {
    Scene s = scene;
    s.plane_at_infinity = Plane(0, 0, -1, farthest + distance);
    GiveTimes(s);
    const PictureWorld world = PerViewProxy(s).For(Between(Eigen::Matrix4d::Identity()), 3);
    ASSERT_FALSE(world.proxy.faces.empty()) << distance;
    for (const Eigen::Vector3d& x : world.proxy.vertices) ASSERT_TRUE(x.allFinite() && x.z() > 0) << distance;
    for (const auto& w : Weights(world, settings_)) {
      double sum = 0;
      for (std::size_t i = 0; i + 1 < w.size(); ++i) {
        ASSERT_TRUE(w[i] >= 0 && w[i] <= 1 + 1e-6) << distance;
        sum += w[i];
      }
      if (w.back() > 0) {
        ASSERT_NEAR(sum, 1, 1e-5) << distance;
      }
    }
  }
}

TEST_F(VanishingPointsHardCase, ACentreAtThePlaneAtInfinityOrBeyondIsLeftOut) {
  const Scene scene = test::Projective(capture_.scene, Eigen::Matrix4d::Identity());
  const Eigen::Vector3d C = scene.views[0].CentreInWorld(), away = (C - scene.views[11].CentreInWorld()).normalized();
  for (const double distance : {1e-1, 1e-2, 1e-4, 1e-8, 1e-12, 1e-15, 0.0, -1e-15, -1e-8, -1e-2}) {
    Scene s = scene;
    // Between photo 0's centre and everything else, or just beyond it.
    s.plane_at_infinity = Plane(-away.x(), -away.y(), -away.z(), away.dot(C) + distance);
    const PictureWorld world = PerViewProxy(s).For(ViewOf(s, 11));
    EXPECT_TRUE(world.use[11]);
    EXPECT_EQ(world.use[0], distance > 1e-5) << distance << ": as far away as floats hold an angle";
    for (const auto& w : Weights(world, settings_))
      for (const double v : w) ASSERT_TRUE(std::isfinite(v)) << distance;
    // The view's own centre there: no angles, and said so.
    if (std::abs(distance) < 1e-14) {
      EXPECT_THROW(PerViewProxy(s).For(ViewOf(s, 0)), DataError) << distance;
    }
  }
}

TEST_F(VanishingPointsHardCase, AVanishingPointBehindTheViewIsNinetyDegreesOrMore) {
  // Photos that look at the object from all around: at 180 degrees the thesis's distance in pixels is 0 again.
  Scene s = capture_.scene;
  const Eigen::Vector3d object(0, 0, 0.5);
  for (std::size_t i = 0; i < s.views.size(); ++i) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(i) / 12;
    s.views[i].cam_from_world =
        LookAt(object + Eigen::Vector3d(5 * std::sin(turn), 0, -5 * std::cos(turn)), object, {0, -1, 0});
  }
  const Eigen::Matrix4d T = test::RandomTransformation(41, 1e4);
  const Scene p = test::Projective(s, T);
  const auto frame = VanishingPointFrame::Make(p.views[0].P, *p.plane_at_infinity, s.cameras[0].K(), 0.2);
  ASSERT_TRUE(frame);
  const Eigen::Vector4d moved = frame->MovePoint(T * object.homogeneous());
  const Eigen::Vector3d x = moved.head<3>() / moved.w();
  for (std::size_t j = 0; j < 12; ++j) {
    const auto source = frame->MoveCamera(p.views[j].P);
    ASSERT_TRUE(source);
    const double turn = 30.0 * static_cast<double>(j <= 6 ? j : 12 - j);
    EXPECT_NEAR(AngleBetween(x, Eigen::Vector3d(x - source->centre)) * kDegPerRad, turn, 1e-6) << j;
  }
}

TEST_F(VanishingPointsHardCase, AnEpipoleAtInfinityIsAnEpipoleLikeOthers) {
  // Cameras side by side: motion in the image plane, towards it and away from it, by ever less.
  Scene s = capture_.scene;
  for (const double slant : {0.0, 1e-15, -1e-15, 1e-8, -1e-8, 1e-2, -1e-2}) {
    for (std::size_t i = 0; i < s.views.size(); ++i) {
      const double side = 0.1 * (static_cast<double>(i) - 5.5);
      s.views[i].cam_from_world = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-side, 0, 4.5 - slant * side)};
    }
    const Eigen::Matrix4d T = test::RandomTransformation(51, 1e3);
    Scene p = test::Projective(s, T);
    GiveTimes(p);
    const PictureWorld world = PerViewProxy(p).For(ViewOf(p, 5), 4);
    RadianceSettings untimed = settings_;
    untimed.time = false;
    untimed.resolution = Resolution::kOff;
    for (const auto& w : Weights(world, untimed)) {
      EXPECT_EQ(w.back(), 1) << slant;
      EXPECT_NEAR(w[4], 1, 1e-6) << "the view's own photo" << slant;
    }
  }
}

}  // namespace
}  // namespace lumi
