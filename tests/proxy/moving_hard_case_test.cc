#include <gtest/gtest.h>

#include "scene/program/error.h"
#include "tests/proxy/moving_world.h"

namespace lumi::test {
namespace {

constexpr double kDepth = 0.12;  // as in moving_test.cc

Mesh Built(const MovingWorld& world) {
  const Mesh mesh = BuildMovingProxy(world.Photos(), world.Still(), {}, SilentProgress());
  EXPECT_EQ(Validate(mesh), std::nullopt);
  return mesh;
}

TEST(MovingHardCase, NothingMaskedIsRefused) {
  const MovingWorld world{.mask_margin = -1};
  EXPECT_THROW(Built(world), DataError);
}

TEST(MovingHardCase, EverythingMasked) {
  const MovingWorld world{.mask_margin = 100};
  const Mesh mesh = Built(world);
  EXPECT_NEAR(world.DepthTowards(mesh, 0, 0, 2), 2, kDepth);
  // The wall's texture says where the wall is, also where it is not believed to stand still. A plane is 0.4 deep there.
  for (const double x : {-1.8, 1.8}) EXPECT_NEAR(world.DepthTowards(mesh, x, 0, 4), 4, 0.4) << x;
}

TEST(MovingHardCase, WithoutTextureItsOutlineIsAllThereIs) {
  MovingWorld world;
  world.plate_texture = false;
  const Mesh mesh = Built(world);
  // What is uniform within can stand on any depth between the outline's and the wall's and look the same.
  for (const double x : {-0.4, 0.0, 0.4}) {
    const double depth = world.DepthTowards(mesh, x, 0, 2);
    EXPECT_GT(depth, 2 - 2 * kDepth);
    EXPECT_LT(depth, 4 + 1e-9);
  }
}

TEST(MovingHardCase, WithoutAnyTextureItStaysOnWhatStandsStill) {
  MovingWorld world;
  world.wall_texture = false;
  world.plate_texture = false;
  std::vector<MovingPhoto> photos = world.Photos();
  for (MovingPhoto& p : photos) std::fill(p.photo.data.begin(), p.photo.data.end(), std::uint8_t{90});
  EXPECT_THROW(BuildMovingProxy(photos, world.Still(), {}, SilentProgress()), DataError);
}

TEST(MovingHardCase, TheRegionLeavesThePicture) {
  for (const double x : {0.6, 0.9, 1.1}) {
    MovingWorld world;
    world.plate_x = x;  // pictures end at 1.07 there
    const Mesh mesh = Built(world);
    EXPECT_NEAR(world.DepthTowards(mesh, x - 0.3, 0, 2), 2, kDepth) << x;
    for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_TRUE(v.allFinite());
  }
}

TEST(MovingHardCase, TheRegionLiesBehindAllPoints) {
  // As seen through a window: the surface that is known stands before what moves.
  MovingWorld world;
  world.plate_depth = 4;
  world.wall_depth = 6;
  world.still_depth = 3;
  const Mesh mesh = Built(world);
  for (const double x : {-0.4, 0.0, 0.4})
    EXPECT_NEAR(world.DepthTowards(mesh, x, 0, 4), 4, 0.5) << x;  // a plane is 0.4 deep there
  // Elsewhere it hides what it hid.
  EXPECT_NEAR(world.DepthTowards(mesh, 0, 2.2, 4), 3, 1e-9);
}

TEST(MovingHardCase, ASinglePhaseIsAStillScene) {
  MovingWorld world;
  world.moments = 1;
  EXPECT_NEAR(world.DepthTowards(Built(world), 0, 0, 2), 2, kDepth);
}

TEST(MovingHardCase, CamerasThatComeTogetherSayNothing) {
  // All of a moment's photos approach one place, step by step: the depth gets worse, the mesh stays one, or there is
  // none.
  for (double apart = 1e-2; apart > 1e-16; apart *= 0.01) {
    const MovingWorld world{.moments = 2, .views = 3};
    std::vector<MovingPhoto> photos = world.Photos();
    for (MovingPhoto& p : photos) {
      p.render.centre *= apart;
      p.render.P.col(3) = -p.render.P.leftCols<3>() * p.render.centre;
    }
    try {
      EXPECT_EQ(Validate(BuildMovingProxy(photos, world.Still(), {}, SilentProgress())), std::nullopt) << apart;
    } catch (const DataError&) {
    }
  }
  EXPECT_THROW(BuildMovingProxy({}, MovingWorld().Still(), {}, SilentProgress()), DataError);
}

TEST(MovingHardCase, CamerasAllRoundAreRefused) {
  const MovingWorld world;
  std::vector<MovingPhoto> photos = world.Photos();
  // Half of them look back from behind.
  const Eigen::Matrix3d turn = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  for (std::size_t i = 0; i < photos.size(); i += 2) {
    const Eigen::Vector3d centre(0, 0, 8);
    photos[i].render.P.leftCols<3>() = photos[i].render.P.leftCols<3>() * turn;
    photos[i].render.centre = centre;
    photos[i].render.P.col(3) = -photos[i].render.P.leftCols<3>() * centre;
  }
  EXPECT_THROW(BuildMovingProxy(photos, world.Still(), {}, SilentProgress()), DataError);
}

TEST(MovingHardCase, FarFromTheOriginItIsTheSame) {
  MovingWorld here;
  const double depth = here.DepthTowards(Built(here), 0, 0, 2);
  for (double offset = 1; offset <= 1e6; offset *= 100) {
    MovingWorld there;
    there.offset = {offset, -offset, offset};
    // A pixel's place moves by epsilon * offset * focal length: at 1e6 by 2e-8 pixels, which a choice between planes
    // may take as a tie.
    EXPECT_NEAR(there.DepthTowards(Built(there), 0, 0, 2), depth, 1e-3) << offset;
  }
}

}  // namespace
}  // namespace lumi::test
