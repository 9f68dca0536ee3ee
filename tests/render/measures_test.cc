#include "render/radiance/measures/evaluate.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <random>

#include "capture.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/resolution.h"
#include "render/radiance/measures/time.h"
#include "render/radiance/visibility.h"
#include "render/radiance/weights.h"

namespace lumi {
namespace {

// Largest singular value of the plane-induced homography's Jacobian, from finite differences of the homography itself
// in double: the definition of sec. 4.2.2.
double StretchByDefinition(const RenderView& source, const RenderView& desired, const Eigen::Vector3d& point,
                           const Eigen::Vector3d& normal) {
  Plane plane;
  plane << normal, -normal.dot(point);
  const auto H = PlaneHomography(desired.P, source.P, plane);
  const auto x = Project(source.P, point);
  if (!H || !x) return std::numeric_limits<double>::quiet_NaN();
  const double step = 1e-4;
  const auto map = [&](double dx, double dy) {
    return Eigen::Vector2d((*H * Eigen::Vector3d(x->x() + dx, x->y() + dy, 1)).hnormalized());
  };
  Eigen::Matrix2d J;
  J.col(0) = (map(step, 0) - map(-step, 0)) / (2 * step);
  J.col(1) = (map(0, step) - map(0, -step)) / (2 * step);
  return Eigen::JacobiSVD<Eigen::Matrix2d>(J).singularValues()[0];
}

double ResolutionOracle(double sigma, double low, double high) {
  const double octaves = std::log2(sigma);
  const double s = octaves > 0 ? 1 - octaves / std::log2(high) : low > 0 ? 1 - octaves / std::log2(low) : 1;
  return 0.5 - 0.5 * std::cos(std::numbers::pi * std::clamp(s, 0.0, 1.0));
}

TEST(VisibilityMaps, ATexelHoldsTheDepthAtItsCentre) {
  // A slanted plane: half a texel to the side, a pixel of the photo, changes its depth by up to 1 %.
  constexpr int kWidth = 64, kHeight = 48, kTexels = 2;
  constexpr double kFocal = 60, kSlantX = 0.5, kSlantY = -0.3;
  constexpr float kRelative = 1e-5F;  // of floats, and Embree's
  Eigen::Matrix3d K;
  K << kFocal, 0, 0.5 * kWidth, 0, kFocal, 0.5 * kHeight, 0, 0, 1;
  const RenderView view{
      ProjectionMatrix(K, Rigid3{}), Eigen::Vector3d::Zero(), {kWidth, kHeight}, std::nullopt, 1.0, nullptr, nullptr};
  Mesh plane;
  for (const auto& [x, y] : {std::pair{-9.0, -9.0}, {9.0, -9.0}, {9.0, 9.0}, {-9.0, 9.0}})
    plane.vertices.emplace_back(x, y, 20 + kSlantX * x + kSlantY * y);
  plane.faces = {{0, 1, 2}, {0, 2, 3}};
  VisibilityMaps maps(1, kWidth / kTexels, kHeight / kTexels);
  maps.Fill(0, view, ProxyTracer(plane, Similarity3{}));
  for (int y = 0; y < maps.height(); ++y)
    for (int x = 0; x < maps.width(); ++x) {
      const double u = (kTexels * (x + 0.5) - 0.5 * kWidth) / kFocal,
                   v = (kTexels * (y + 0.5) - 0.5 * kHeight) / kFocal;
      const float depth = static_cast<float>(20 / (1 - kSlantX * u - kSlantY * v));
      if (std::max(std::abs(u), std::abs(v)) * depth > 8.9F) continue;  // beside the plane's end
      ASSERT_NEAR(maps.Map(0)[static_cast<std::size_t>(y * maps.width() + x)], depth, kRelative * depth)
          << x << ", " << y;
    }
  EXPECT_EQ(maps.Map(0).size(), static_cast<std::size_t>(kWidth * kHeight / kTexels / kTexels));
}

TEST(Log2, IsAccurateToFloat) {
  for (float x = 1e-12F; x < 1e12F; x *= 1.0037F)
    ASSERT_NEAR(Log2(x), std::log2(static_cast<double>(x)),
                4e-7 * std::max(1.0, std::abs(std::log2(static_cast<double>(x)))));
  EXPECT_EQ(Log2(1.0F), 0.0F);
}

TEST(Resolution, LargestSingularValueHasNoCancellation) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> u(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    Eigen::Matrix2f m;
    m << u(engine), u(engine), u(engine), u(engine);
    if (i % 3 == 0) m.row(1) = m.row(0) * (1 + 1e-6F * u(engine));  // nearly singular
    const double truth = Eigen::JacobiSVD<Eigen::Matrix2d>(m.cast<double>()).singularValues()[0];
    ASSERT_NEAR(LargestSingularValue(m(0, 0), m(0, 1), m(1, 0), m(1, 1)) / truth, 1, 1e-6);
  }
}

TEST(Resolution, ValueIsOneAtEqualSizeAndFallsOnBothSides) {
  const auto at = [](float sigma, float low, float high) {
    return ResolutionValue(sigma, low > 0 ? 1 / std::abs(std::log2(low)) : 0.0F, 1 / std::log2(high));
  };
  EXPECT_NEAR(at(1, 0.5F, 2), 1, 1e-6);
  EXPECT_NEAR(at(2, 0.5F, 2), 0, 1e-6);
  EXPECT_NEAR(at(std::sqrt(2.0F), 0.5F, 2), 0.5, 1e-6);
  EXPECT_NEAR(at(0.5F, 0.5F, 2), 0, 1e-6);
  EXPECT_NEAR(at(0.01F, 0, 2), 1, 1e-6) << "oversampled photos are as good where no lower end is given";
  EXPECT_EQ(at(std::numeric_limits<float>::infinity(), 0.5F, 2), 0);
  EXPECT_EQ(at(1e30F, 0.5F, 2), 0);
}

TEST(Time, TheInnerHalfOfTheWindowIsFreeAndTheRestContinuous) {
  const float inverse_half = 1 / 0.2F;  // a window of 0.4 s
  const auto at = [&](float dt) { return TimeDissimilarity(dt, {inverse_half, 0.5F, 0, 0, 0}); };
  EXPECT_EQ(at(0), 0);
  EXPECT_EQ(at(0.1F), 0);
  EXPECT_NEAR(at(-0.15F), 0.5, 1e-6);
  EXPECT_NEAR(at(0.2F), 1, 1e-6);
  EXPECT_NEAR(at(0.8F), 4, 1e-6);
  for (float dt = 0; dt < 0.5F; dt += 1e-4F) ASSERT_LT(std::abs(at(dt + 1e-4F) - at(dt)), 2e-3F) << dt;
}

TEST(Time, GoesRoundAPeriod) {
  const auto at = [](float dt) { return TimeDissimilarity(dt, {1 / 0.05F, 0.5F, 0, 0.5F, 2.0F}); };
  for (const float dt : {-1.02F, -0.52F, -0.02F, 0.02F, 0.48F, 0.98F}) EXPECT_EQ(at(dt), 0) << dt;
  EXPECT_NEAR(at(0.25F), 5, 1e-5) << "half a period is as far as it gets";
  EXPECT_NEAR(at(0.75F), 5, 1e-5);
}

TEST(Time, LeadsFromTheMiddleOnWithoutACore) {
  const auto at = [](float dt) { return TimeDissimilarity(dt, {1 / 0.2F, 0, 0.1F, 0, 0}); };
  EXPECT_FLOAT_EQ(at(0), 0.1F);
  EXPECT_NEAR(at(0.1F), 0.55F, 1e-6);
  EXPECT_NEAR(at(0.2F), 1, 1e-6);
  EXPECT_NEAR(at(0.4F), 2, 1e-6);
  for (float dt = 0; dt < 0.5F; dt += 1e-4F) ASSERT_LE(std::abs(at(dt + 1e-4F) - at(dt)), 2e-3F) << dt;
}

class OnACapture : public ::testing::Test {
 protected:
  OnACapture() : capture_(test::MakeCapture(12, 48)) {
    // Nearer, farther, and longer lenses: the stretch varies.
    capture_.scene.cameras.push_back(Camera::Pinhole(96, 72, 160, 160, 48, 36));
    for (std::size_t i = 0; i < capture_.scene.views.size(); ++i) {
      View& v = capture_.scene.views[i];
      if (i % 3 == 1) v.cam_from_world = LookAt(2.5 * v.CentreInWorld(), {0, 0, 0.5}, {0, -1, 0});
      if (i % 4 == 2) v.camera = {1};
      if (i % 5 != 4) v.time_s = 7200 + 0.1 * static_cast<double>(i);
    }
    sources_ = MakeSources(capture_.scene);
  }

  template <typename Check>
  void ForRandomRays(const RadianceSettings& settings, Check check) {
    const ProxyTracer tracer(capture_.proxy, capture_.scene.normalized_from_world);
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> u(-1, 1);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
      const Rigid3 pose = LookAt({3 * u(engine), u(engine), -4.5 + u(engine)}, {u(engine), u(engine), 1}, {0, -1, 0});
      const ViewSetup setup = MakeViewSetup(sources_, MakeRenderView(capture_.scene.cameras[0], pose), settings);
      const Eigen::Vector3f d = (setup.ray_from_pixel * Eigen::Vector3d(24 + 20 * u(engine), 18 + 15 * u(engine), 1))
                                    .normalized()
                                    .cast<float>();
      float t = 0;
      Eigen::Vector3f normal;
      tracer.Trace(setup.desired.centre.cast<float>(), {&d, 1}, {&t, 1}, {&normal, 1});
      if (!std::isfinite(t)) continue;
      ++hits;
      check(setup, d, t, normal);
    }
    EXPECT_GT(hits, 250);
  }

  test::Capture capture_;
  Sources sources_;
};

TEST_F(OnACapture, TheJacobianMeasureIsTheHomographysStretch) {
  RadianceSettings settings;
  settings.resolution = Resolution::kJacobian;
  settings.resolution_low = 0.3;
  settings.resolution_high = 4;
  Measures m;
  int compared = 0;
  ForRandomRays(
      settings, [&](const ViewSetup& setup, const Eigen::Vector3f& d, float t, const Eigen::Vector3f& normal) {
        EvaluateMeasures(setup.sources, settings, d, t, normal, m);
        const Eigen::Vector3d point = setup.desired.centre + static_cast<double>(t) * d.cast<double>();
        for (std::size_t j = 0; j < sources_.views.size(); ++j) {
          const double sigma = StretchByDefinition(sources_.views[j], setup.desired, point, normal.cast<double>());
          if (!std::isfinite(sigma) || sigma > 50) continue;  // edge-on: the finite difference itself fails
          ASSERT_NEAR(m.Of<measure::Resolution>()[j], ResolutionOracle(sigma, 0.3, 4), 2e-3) << j << " " << sigma;
          ++compared;
        }
      });
  EXPECT_GT(compared, 1500);
}

TEST_F(OnACapture, TheDistanceMeasureIsTheRatioWithTheFocalLengths) {
  RadianceSettings settings;
  settings.resolution = Resolution::kDistance;
  settings.resolution_low = 0.3;
  settings.resolution_high = 4;
  Measures m;
  ForRandomRays(settings, [&](const ViewSetup& setup, const Eigen::Vector3f& d, float t,
                              const Eigen::Vector3f& normal) {
    EvaluateMeasures(setup.sources, settings, d, t, normal, m);
    const Eigen::Vector3d point = setup.desired.centre + static_cast<double>(t) * d.cast<double>();
    for (std::size_t j = 0; j < sources_.views.size(); ++j) {
      const double focal = capture_.scene.CameraOf(capture_.scene.views[j]).K()(0, 0);
      const double sigma = (point - sources_.views[j].centre).norm() * (0.9 * 48) / (static_cast<double>(t) * focal);
      ASSERT_NEAR(m.Of<measure::Resolution>()[j], ResolutionOracle(sigma, 0.3, 4), 1e-4) << j;
    }
  });
}

TEST_F(OnACapture, TimesAreTakenInDoubleAndPhotosWithoutOneAreAlwaysNow) {
  RadianceSettings settings;
  settings.time = true;
  settings.time_s = 7200.3;
  settings.time_window_s = 0.4;
  Measures m;
  ForRandomRays(
      settings, [&](const ViewSetup& setup, const Eigen::Vector3f& d, float t, const Eigen::Vector3f& normal) {
        EvaluateMeasures(setup.sources, settings, d, t, normal, m);
        for (std::size_t j = 0; j < 12; ++j) {
          if (j % 5 == 4) {
            ASSERT_EQ(m.Of<measure::Time>()[j], 0);
            continue;
          }
          const double s = std::abs(0.1 * static_cast<double>(j) - 0.3) / 0.2;
          const double truth = s > 1 ? s : 0.5 - 0.5 * std::cos(std::numbers::pi * std::clamp(2 * s - 1, 0.0, 1.0));
          ASSERT_NEAR(m.Of<measure::Time>()[j], truth, 2e-5) << j;
        }
      });
}

TEST_F(OnACapture, WeightsCombineTheMeasuresAsWritten) {
  RadianceSettings settings;
  settings.k = 3;
  settings.alpha = 0.5;
  settings.beta = 0.7;
  settings.gamma = 2;
  settings.epsilon = 0.3;
  settings.resolution = Resolution::kJacobian;
  settings.time = true;
  settings.time_s = 7200.3;
  settings.time_window_s = 0.4;
  Measures m;
  WeighScratch scratch;
  ForRandomRays(settings,
                [&](const ViewSetup& setup, const Eigen::Vector3f& d, float t, const Eigen::Vector3f& normal) {
                  EvaluateMeasures(setup.sources, settings, d, t, normal, m);
                  const RayWeights w = Weigh({setup.sources, nullptr, settings}, {d, t, normal}, scratch);
                  std::vector<std::pair<double, int>> h;
                  for (int j = 0; j < 12; ++j) {
                    const auto i = static_cast<std::size_t>(j);
                    if (!(m.f[i] > 0)) continue;
                    const double unit = 2 * settings.r_max_rad;
                    h.emplace_back((0.5 * m.theta[i] + 0.7 * unit * (1 - m.Of<measure::Resolution>()[i]) +
                                    0.3 * unit * m.Of<measure::Time>()[i]) *
                                       (1 + 2 * (1 / static_cast<double>(m.f[i]) - 1)),
                                   j);
                  }
                  std::sort(h.begin(), h.end());
                  if (h.size() < 4) return;
                  double sum = 0;
                  for (std::size_t i = 0; i < 3; ++i) sum += 1 / h[i].first - 1 / h[3].first;
                  ASSERT_EQ(w.count, 3);
                  for (std::size_t i = 0; i < 3; ++i) {
                    ASSERT_EQ(w.camera[i], h[i].second);
                    ASSERT_NEAR(w.weight[i], (1 / h[i].first - 1 / h[3].first) / sum, 1e-4);
                  }
                });
}

TEST_F(OnACapture, WithoutFieldOfViewAPhotoCountsWhereItDoesNotLook) {
  RadianceSettings settings;
  settings.field_of_view = false;
  settings.k = 1;
  // Turned away, but nearest by angle.
  capture_.scene.views[0].cam_from_world = LookAt({0, 0, -4}, {0, 0, -9}, {0, -1, 0});
  sources_ = MakeSources(capture_.scene);
  const ViewSetup setup = MakeViewSetup(
      sources_, MakeRenderView(capture_.scene.cameras[0], LookAt({0, 0, -4}, {0, 0, 0}, {0, -1, 0})), settings);
  WeighScratch scratch;
  const RayWeights w = Weigh({setup.sources, nullptr, settings}, {Eigen::Vector3f(0, 0, 1), 0.5F}, scratch);
  ASSERT_EQ(w.count, 1);
  EXPECT_EQ(w.camera[0], 0);
}

}  // namespace
}  // namespace lumi
