#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "proxy/dense/fusion.h"
#include "proxy/dense/source_views.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/proxy/photographed_planes.h"

namespace lumi::test {
namespace {

std::vector<Photographed> PhotographAll(const std::vector<TexturedPlane>& world,
                                        const std::vector<StereoCamera>& cameras) {
  std::vector<Photographed> photos;
  for (const StereoCamera& camera : cameras) photos.push_back(Photograph(world, camera));
  return photos;
}

// What holds of every map, however bad the photos were.
void ExpectNumbers(const DepthMap& map, double nearest, double farthest, const std::string& what) {
  for (std::size_t p = 0; p < map.Pixels(); ++p) {
    ASSERT_TRUE(std::isfinite(map.w[p]) && std::isfinite(map.gx[p]) && std::isfinite(map.gy[p]) &&
                std::isfinite(map.cost[p]))
        << what;
    ASSERT_GE(map.w[p], 0.999F / static_cast<float>(farthest)) << what;
    ASSERT_LE(map.w[p], 1.001F / static_cast<float>(nearest)) << what;
    ASSERT_GE(map.cost[p], 0) << what;
  }
}

TEST(DenseHardCase, ABaselineTowardsZeroMakesNoFalseSurface) {
  std::size_t before = 1000000;
  for (double baseline = 1e-2; baseline > 1e-16; baseline *= 0.1) {
    const std::vector<Photographed> photos = PhotographAll(
        {Wall(4)}, {CameraAt({0, 0, 0}, {0, 0, 4}, 64, 48), CameraAt({baseline, 0, 0}, {baseline, 0, 4}, 64, 48)});
    const std::vector<DepthMap> maps = MatchAll(photos, 3, 1, 20);
    for (const DepthMap& map : maps) ExpectNumbers(map, 1, 20, "baseline " + std::to_string(baseline));
    FusionInput input{{{1}, {0}}, [&](std::int32_t v) -> FusionMap {
                        const auto i = static_cast<std::size_t>(v);
                        return {photos[i].picture.camera, std::make_shared<const DepthMap>(maps[i])};
                      }};
    FusionOptions options;
    options.agree = 1;
    // Points may be made while any parallax is left; each says how uncertain it is: at least its error allows.
    const std::vector<ProxyPoint> points = FuseDepths(input, options, [] {});
    before = std::min(before, points.size() + 1);
    for (const ProxyPoint& p : points) {
      ASSERT_TRUE(p.x_in_world.allFinite());
      ASSERT_TRUE(std::isfinite(p.sigma));
      EXPECT_GE(p.sigma, 0.1 * p.footprint / baseline)
          << "0.3 px over an angle of at most the baseline at depth 1; at 1e-15 half of it is rounding";
    }
  }
}

TEST(DenseHardCase, GrazingPatchesAreScoredAsLongAsTheyAreSeen) {
  // A floor seen at an angle that goes to nothing; the score at the true plane stays a number, and good while a patch
  // still has texture of its own.
  for (double height = 1; height > 1e-16; height *= height > 0.01 ? 0.5 : 0.1) {
    const TexturedPlane floor{{0, height, 5}, {5, 0, 0}, {0, 0, 4.9}, NoiseTexture(0.04, 5)};
    const std::vector<Photographed> photos =
        PhotographAll({floor}, {CameraAt({0, 0, 0}, {0, 0, 5}), CameraAt({0.2, 0, 0}, {0.2, 0, 5})});
    PatchBatch patches;
    PlaneBatch planes;
    std::array<int, kLanes> x;
    const StereoCamera& camera = photos[0].picture.camera;
    for (int l = 0; l < kLanes; ++l) x[static_cast<std::size_t>(l)] = 60 + 2 * l;
    const int y = 100;
    MakePatches(photos[0].picture.grey, x.data(), y, patches);
    // height = depth * (y - cy) / f: the inverse depth of the floor.
    for (std::size_t l = 0; l < kLanes; ++l) {
      planes.w[l] = static_cast<float>((y + 0.5 - camera.centre_px.y()) / camera.focal_px.y() / height);
      planes.gx[l] = 0;
      planes.gy[l] = static_cast<float>(1 / camera.focal_px.y() / height);
    }
    std::array<float, kLanes> cost;
    ScorePatches(patches, PackQuads(photos[1].picture.grey), Pair(camera, photos[1].picture.camera), planes,
                 cost.data());
    for (const float c : cost) {
      ASSERT_TRUE(std::isfinite(c)) << "height " << height;
      ASSERT_GE(c, 0);
      ASSERT_LE(c, kUnseen);
    }
    if (height >= 0.5) {
      EXPECT_LT(*std::ranges::max_element(cost), 0.35F) << "height " << height;
    }
  }
}

TEST(DenseHardCase, PlanesThroughACameraAreNotSeenOrANumber) {
  const std::vector<Photographed> photos =
      PhotographAll({Wall(4)}, {CameraAt({0, 0, 0}, {0, 0, 4}), CameraAt({0.3, 0, 0.5}, {0.3, 0, 4})});
  PatchBatch patches;
  PlaneBatch planes;
  std::array<int, kLanes> x;
  for (int l = 0; l < kLanes; ++l) x[static_cast<std::size_t>(l)] = 60 + 2 * l;
  MakePatches(photos[0].picture.grey, x.data(), 60, patches);
  const PairGeometry pair = Pair(photos[0].picture.camera, photos[1].picture.camera);
  // Depth 0.5 is the source's own: from both sides nearer, step by step, and steep enough to pass through the centre.
  for (double step = 1e-2; step > 1e-16; step *= 0.1) {
    for (const double side : {-1.0, 0.0, 1.0}) {
      for (const float slope : {0.0F, 0.5F, -0.5F, 100.0F}) {
        for (std::size_t l = 0; l < kLanes; ++l) {
          planes.w[l] = static_cast<float>(1 / (0.5 + side * step));
          planes.gx[l] = slope;
          planes.gy[l] = -slope;
        }
        std::array<float, kLanes> cost;
        ScorePatches(patches, PackQuads(photos[1].picture.grey), pair, planes, cost.data());
        for (const float c : cost) {
          ASSERT_TRUE(c >= 0 && c <= kUnseen) << step << " " << side << " " << slope;
          if (side < 0 && step == 1e-2) {
            EXPECT_EQ(c, kUnseen) << "behind the source";
          }
        }
      }
    }
  }
}

TEST(DenseHardCase, WhereTheWorldsOriginLiesDoesNotMatter) {
  const std::vector<StereoCamera> cameras = {CameraAt({0, 0, 0}, {0, 0, 4}, 64, 48),
                                             CameraAt({0.4, 0, 0}, {0.3, 0, 4}, 64, 48),
                                             CameraAt({-0.4, 0, 0}, {-0.3, 0, 4}, 64, 48)};
  const std::vector<Photographed> near = PhotographAll({Wall(4)}, cameras);
  for (double far = 1e2; far < 1e8; far *= 10) {
    std::vector<Photographed> moved = near;
    for (Photographed& photo : moved) {
      Rigid3& pose = photo.picture.camera.cam_from_world;
      pose.translation -= pose.rotation * Eigen::Vector3d(far, -far, far);
    }
    for (std::size_t v = 1; v < cameras.size(); ++v) {
      const PairGeometry here = Pair(near[0].picture.camera, near[v].picture.camera),
                         there = Pair(moved[0].picture.camera, moved[v].picture.camera);
      // A double keeps 1e-16 of the distance; the baseline is a pixel's share of what matters.
      for (int i = 0; i < 9; ++i) EXPECT_NEAR(there.a[i], here.a[i], 1e-4F);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(there.b[i], here.b[i], 80 * 10 * 2.3e-16 * far + 1e-5);
    }
    EXPECT_GT(ShareWithin(MatchAll(moved, 3, 1, 20)[0], moved[0], 0.02), 0.8) << "origin " << far;
  }
}

TEST(DenseHardCase, EqualCostsAlwaysEndTheSameWay) {
  // Nothing to tell planes apart: every pixel keeps what it started from.
  const TexturedPlane bare{{0, 0, 4}, {6, 0, 0}, {0, 4.5, 0}, [](double, double) { return 128.0; }};
  for (double contrast = 1e-2; contrast > 1e-16; contrast *= 0.1) {
    TexturedPlane faint = bare;
    faint.grey = [contrast, noise = NoiseTexture(0.05, 2)](double s, double t) {
      return 128 + contrast * (noise(s, t) - 128);
    };
    const std::vector<Photographed> photos =
        PhotographAll({faint}, {CameraAt({0, 0, 0}, {0, 0, 4}, 64, 48), CameraAt({0.3, 0, 0}, {0.3, 0, 4}, 64, 48)});
    const std::vector<DepthMap> once = MatchAll(photos, 3, 1, 20), twice = MatchAll(photos, 3, 1, 20);
    EXPECT_EQ(once[0].w, twice[0].w);
    EXPECT_TRUE(std::ranges::all_of(once[0].cost, [](float c) { return c >= 1; })) << "contrast " << contrast;
  }
}

TEST(DenseHardCase, PhotosTowardsOnePlaceBecomeNoSources) {
  // Three cameras apart, a fourth that goes towards the first one.
  for (double apart = 1e-2; apart > 1e-16; apart *= 0.1) {
    const TemporaryFolder folder;
    std::vector<StereoCamera> cameras;
    for (const double x : {0.0, 0.4, 0.8, apart}) cameras.push_back(CameraAt({x, 0, 0}, {0.3 * x, 0, 4}, 96, 72));
    const Scene scene = SceneOf({Wall(4)}, cameras, folder.path());
    const auto sources = PickSources(scene, 3);
    ASSERT_FALSE(sources[0].empty());
    for (const SourceView& s : sources[0]) EXPECT_NE(s.view.value, 3) << apart;
    std::vector<StereoCamera> two = {cameras[0], cameras[3]};
    EXPECT_THROW(PickSources(SceneOf({Wall(4)}, two, folder.path()), 3), DataError);
  }
}

TEST(DenseHardCase, TheScaleOfTheWorldDoesNotMatter) {
  const std::vector<StereoCamera> cameras = {CameraAt({0, 0, 0}, {0, 0, 4}, 64, 48),
                                             CameraAt({0.4, 0, 0}, {0.3, 0, 4}, 64, 48)};
  const std::vector<Photographed> one = PhotographAll({Wall(4)}, cameras);
  const std::vector<DepthMap> here = MatchAll(one, 3, 1, 20);
  for (double scale = 1e-2; scale > 1e-12; scale *= 0.1) {
    std::vector<Photographed> small = one;
    for (Photographed& photo : small) {
      photo.picture.camera.cam_from_world.translation *= scale;
      for (double& depth : photo.depth) depth *= scale;
    }
    const DepthMap map = MatchAll(small, 3 * scale, scale, 20 * scale)[0];
    EXPECT_NEAR(ShareWithin(map, small[0], 0.01), ShareWithin(here[0], one[0], 0.01), 0.05) << scale;
  }
}

}  // namespace
}  // namespace lumi::test
