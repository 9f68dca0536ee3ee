// Thousands of cameras: those that see nothing of a piece of the proxy are not ranked there, and nothing else changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "render/radiance/measures/photo_sight.h"
#include "render/radiance/reconstruct.h"
#include "render/radiance/sparse/cameras_in_sight.h"
#include "render/radiance/sparse/weigh_samples.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

using test::InTurn;

// The box before the plane, and so many cameras about it: they look anywhere, and a hundred stand in one place. With
// only as many pixels as an angle of 40 degrees needs.
struct Crowd {
  explicit Crowd(int cameras, const Eigen::Vector3d& away = Eigen::Vector3d::Zero()) {
    proxy = test::PlaneAndBox();
    for (Eigen::Vector3d& v : proxy.vertices) v += away;
    scene.cameras.push_back(Camera::Pinhole(64, 48, 90, 90, 32, 24));
    std::mt19937 engine(11);
    std::uniform_real_distribution<double> wide(-6, 6), near(-1, 1);
    for (int i = 0; i < cameras; ++i) {
      const bool together = i % 20 == 7;
      const Eigen::Vector3d eye =
          together ? Eigen::Vector3d(0.3, 0.2, -4) : Eigen::Vector3d(wide(engine), wide(engine), -4 + near(engine));
      // Every third looks at the box, the others somewhere, some of them away from it.
      const Eigen::Vector3d at =
          i % 3 == 0 ? Eigen::Vector3d(near(engine), near(engine), 0.5)
                     : Eigen::Vector3d(eye + Eigen::Vector3d(wide(engine), wide(engine), 2 * near(engine) + 0.5));
      View v;
      v.name = std::to_string(i);
      v.camera = {0};
      v.cam_from_world = LookAt(eye + away, at + away, {0, -1, 0});
      scene.views.push_back(v);
    }
    for (int i = 0; i < 60; ++i) {
      Point p;
      p.x_in_world = away + Eigen::Vector3d(std::sin(12.9 * i), std::sin(78.2 * i), std::sin(37.7 * i) + 1) * 1.5;
      scene.points.push_back(p);
    }
    UpdateFrameOfReference(scene);
    sources = MakeSources(scene);
    view = MakeRenderView(scene.cameras[0],
                          LookAt(Eigen::Vector3d(0.5, 0.4, -5) + away, Eigen::Vector3d(0, 0, 0.5) + away, {0, -1, 0}));
  }
  // On a grid of pixels, where they meet the proxy or not.
  RaySamples Rays(const ViewSetup& setup) const {
    RaySamples rays;
    for (int y = 0; y < 48; y += 2)
      for (int x = 0; x < 64; x += 2)
        rays.direction.push_back(
            (setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>());
    rays.t.resize(rays.direction.size());
    rays.normal.resize(rays.direction.size());
    ProxyTracer(proxy, scene.normalized_from_world)
        .Trace(setup.desired.centre.cast<float>(), rays.direction, rays.t, rays.normal);
    return rays;
  }
  Scene scene;
  Mesh proxy;
  Sources sources;
  RenderView view;
};

std::vector<std::pair<std::int32_t, float>> Row(const WeightTable& table, std::size_t i) {
  std::vector<std::pair<std::int32_t, float>> row;
  for (auto e = static_cast<std::size_t>(table.first[i]); e < static_cast<std::size_t>(table.first[i + 1]); ++e)
    row.emplace_back(table.camera[e], table.weight[e]);
  std::ranges::sort(row);
  return row;
}

void ExpectTheSameAsOfAll(const Crowd& crowd, const RadianceSettings& settings, float tolerance) {
  const ViewSetup setup = MakeViewSetup(crowd.sources, crowd.view, settings);
  const RaySamples rays = crowd.Rays(setup);
  WeightTable found, all;
  OptimumCounts counts;
  WeighScratch scratch;
  WeighSamples(setup, nullptr, rays, InTurn, found, counts);
  Reconstruct(setup, nullptr, rays, all, counts, scratch);
  ASSERT_EQ(found.size(), all.size());
  std::size_t weighed = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(found.alpha[i], all.alpha[i]) << i;
    const auto one = Row(found, i), other = Row(all, i);
    if (tolerance == 0) {
      EXPECT_EQ(one, other) << i;
      weighed += one.size();
      continue;
    }
    std::map<std::int32_t, float> difference;
    for (const auto& [camera, w] : one) difference[camera] += w;
    for (const auto& [camera, w] : other) difference[camera] -= w;
    for (const auto& [camera, w] : difference) EXPECT_NEAR(w, 0, tolerance) << i << " " << camera;
    weighed += one.size();
  }
  EXPECT_GT(weighed, all.size());
}

TEST(ManyCameras, AreRankedAsIfAllWereAsked) {
  const Crowd crowd(2000);
  RadianceSettings s;
  ExpectTheSameAsOfAll(crowd, s, 0);
  s.resolution = Resolution::kJacobian;
  s.k = 8;
  ExpectTheSameAsOfAll(crowd, s, 0);
  s.correlation = Correlation::kFallingLeaves;
  ExpectTheSameAsOfAll(crowd, s, 0);
  s.k = 0;
  s.correlation = Correlation::kInverse;
  ExpectTheSameAsOfAll(crowd, s, 1e-6F);  // sums of other numbers of zeros
}

TEST(ManyCameras, FarFromTheOriginLikewise) { ExpectTheSameAsOfAll(Crowd(1000, {3e5, -2e5, 1e5}), {}, 0); }

TEST(ManyCameras, WithoutFieldOfViewAllAreAsked) {
  RadianceSettings s;
  s.field_of_view = false;
  ExpectTheSameAsOfAll(Crowd(600), s, 0);
}

TEST(ManyCameras, TheOptimumIsOfThoseThatSee) {
  RadianceSettings s;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.sampling = Sampling::kInterpolated;
  s.grid_columns = s.grid_rows = 8;
  s.k = 0;
  s.accuracy = 1e-5;
  ExpectTheSameAsOfAll(Crowd(600), s, 2e-5F);
}

TEST(CamerasInSight, ThoseLeftOutSeeNothingOfTheBoxAndMostAreLeftOut) {
  const Crowd crowd(2000);
  const ViewSetup setup = MakeViewSetup(crowd.sources, crowd.view, {});
  const RaySamples rays = crowd.Rays(setup);
  std::mt19937 engine(3);
  std::uniform_real_distribution<float> part(0, 1);
  std::size_t listed = 0, boxes = 0;
  for (std::size_t i = 0; i + 40 < rays.size(); i += 37) {
    if (!std::isfinite(rays.t[i]) || !std::isfinite(rays.t[i + 1])) continue;
    Eigen::AlignedBox3f box(Eigen::Vector3f(rays.t[i] * rays.direction[i]));
    if (i % 2 == 0) box.extend(rays.t[i + 1] * rays.direction[i + 1]);  // else a point: no size at all
    std::vector<std::int32_t> seeing;
    CamerasInSight(setup.sources, box, seeing);
    EXPECT_TRUE(std::ranges::is_sorted(seeing));
    std::vector<bool> sees(2000, false);
    for (const std::int32_t j : seeing) sees[static_cast<std::size_t>(j)] = true;
    listed += seeing.size();
    ++boxes;
    const PhotoArrays arrays(setup.sources);
    for (int n = 0; n < 20; ++n) {
      const Eigen::Vector3f p =
          box.min() + box.sizes().cwiseProduct(Eigen::Vector3f(part(engine), part(engine), part(engine)));
      RayPoint point;
      point.x = p.x();
      point.y = p.y();
      point.z = p.z();
      for (int j = 0; j < 2000; ++j)
        if (!sees[static_cast<std::size_t>(j)]) {
          EXPECT_EQ(FieldOfViewOf(arrays, point, j), 0) << i << " " << j;
        }
    }
  }
  ASSERT_GT(boxes, 5U);
  EXPECT_LT(listed, boxes * 2000 * 6 / 10) << "a third looks at the box";
}

}  // namespace
}  // namespace lumi
