#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "proxy/hull/soundness.h"
#include "proxy/hull/visual_hull.h"
#include "scene/program/error.h"
#include "tests/proxy/hull_bodies.h"

namespace lumi::test {
namespace {

constexpr double kPi = std::numbers::pi;
const Body kBall = Ellipsoid({1, 1, 1});
constexpr double kBallVolume = 4.0 / 3 * kPi;

struct Made {
  Mesh mesh;
  HullSummary summary;
  Soundness soundness;
};
Made SoundHull(const std::vector<SilhouetteView>& views, const HullOptions& options = {},
               const std::optional<Eigen::Vector3d>& near = {}) {
  Made made;
  made.mesh = BuildVisualHull(views, options, SilentProgress(), &made.summary, near);
  made.soundness = CheckSoundness(made.mesh);
  EXPECT_TRUE(made.soundness.IsSolid()) << made.soundness.Describe();
  EXPECT_GE(made.summary.fit.coverage_min, 0.995);
  EXPECT_LE(made.summary.fit.deepest_uncovered_px, 2);
  return made;
}

// V - E + F
long Euler(const Mesh& mesh) {
  return static_cast<long>(mesh.vertices.size()) - static_cast<long>(mesh.faces.size()) / 2;
}

TEST(HullHardCase, ASilhouetteMayTouchTheBorder) {
  Shot close;
  close.width = 200;  // of a ball of 200 pixels' diameter, off the middle: cut at one side
  close.principal_px = {60, 160};
  std::vector<SilhouetteView> views = Around(kBall, 12);
  const double whole = SoundHull(views).summary.volume;
  const Eigen::Vector3d eye(5, 0.5, 0.3);
  views.push_back(Photograph(kBall, eye, Eigen::Vector3d::Zero(), close));
  const Made made = SoundHull(views);
  EXPECT_EQ(made.summary.left_out.size(), 0u);
  EXPECT_GT(made.summary.volume, kBallVolume);  // what lies beyond the frame is not carved
  EXPECT_LE(made.summary.volume, whole * 1.001);
  // Cut in every view: closed all the same, and what the frames show is covered.
  std::vector<SilhouetteView> cut;
  for (int n = 0; n < 8; ++n)
    cut.push_back(
        Photograph(kBall, {5 * std::cos(n * kPi / 4), 5 * std::sin(n * kPi / 4), 1}, Eigen::Vector3d::Zero(), close));
  SoundHull(cut);
}

TEST(HullHardCase, AHoleInTheSilhouettesIsAHoleInTheHull) {
  std::vector<SilhouetteView> views = Around(Torus(0.8, 0.25), 24);
  views.push_back(Photograph(Torus(0.8, 0.25), {0, 0, 5}));
  const Made made = SoundHull(views);
  EXPECT_EQ(made.soundness.parts, 1u);
  EXPECT_EQ(Euler(made.mesh), 0);  // genus 1
  EXPECT_GT(made.summary.volume, 2 * kPi * kPi * 0.8 * 0.0625);
}

TEST(HullHardCase, TwoPartsStayTwo) {
  const Body two = Union(Ellipsoid({0.35, 0.35, 0.35}, {0.6, 0, 0}), Ellipsoid({0.25, 0.25, 0.25}, {-0.6, 0.1, 0}));
  const Made made = SoundHull(Around(two, 24));
  EXPECT_EQ(made.soundness.parts, 2u);
  EXPECT_EQ(Euler(made.mesh), 4);
}

TEST(HullHardCase, SilhouettesOfAFewPixelsMakeASmallHull) {
  for (const double radius : {0.1, 0.03, 0.015, 0.006}) {  // 20 pixels across to one
    std::vector<SilhouetteView> views = Around(Ellipsoid(Eigen::Vector3d::Constant(radius)), 10);
    std::size_t pixels = 0;
    for (const SilhouetteView& v : views)
      pixels += static_cast<std::size_t>(std::count(v.mask.data.begin(), v.mask.data.end(), 255));
    if (pixels == 0) continue;
    const Made made = SoundHull(views);
    for (const Eigen::Vector3d& v : made.mesh.vertices) EXPECT_LT(v.norm(), 2 * radius + 0.04) << radius;
  }
}

TEST(HullHardCase, EmptyAndFullSilhouettesAreNamedAndLeftOut) {
  std::vector<SilhouetteView> views = Around(kBall, 8);
  views[2].mask = Image8(320, 320, 1);
  views[6].mask = Image8(320, 320, 1, 255);
  const Made made = SoundHull(views);
  ASSERT_EQ(made.summary.left_out.size(), 2u);
  EXPECT_EQ(made.summary.left_out[0].name, "view2");
  EXPECT_NE(made.summary.left_out[0].reason.find("empty"), std::string::npos);
  EXPECT_EQ(made.summary.left_out[1].name, "view6");
  EXPECT_NE(made.summary.left_out[1].reason.find("fills the image"), std::string::npos);
  for (SilhouetteView& v : views) v.mask = Image8(320, 320, 1);
  EXPECT_THROW(BuildVisualHull(views, {}, SilentProgress()), DataError);
  EXPECT_THROW(BuildVisualHull({}, {}, SilentProgress()), DataError);
  EXPECT_THROW(BuildVisualHull({Photograph(kBall, {5, 0, 0})}, {}, SilentProgress()), DataError);
}

TEST(HullHardCase, CamerasThatCoincideAddNothing) {
  std::vector<SilhouetteView> views = Around(kBall, 6);
  const double volume = SoundHull(views).summary.volume;
  const std::vector<SilhouetteView> once = views;
  views.insert(views.end(), once.begin(), once.end());
  EXPECT_NEAR(SoundHull(views).summary.volume, volume, 1e-9 * volume);
}

TEST(HullHardCase, CamerasThatFaceEachOtherBoundTheHull) {
  // Two cones with their apexes at each other's camera: a spindle.
  const Made made = SoundHull({Photograph(kBall, {5, 0, 0}), Photograph(kBall, {-5, 0, 0})});
  EXPECT_TRUE(made.summary.bounded);
  const double tangent = 1 / std::sqrt(24.0), volume = 2 * kPi / 3 * std::pow(5 * tangent, 2) * 5;
  EXPECT_GT(made.summary.volume, volume);
  EXPECT_LT(made.summary.volume, 1.05 * volume);
}

TEST(HullHardCase, ViewsAsGoodAsEqual) {
  std::vector<SilhouetteView> views = Around(kBall, 6);
  const double volume = SoundHull(views).summary.volume;
  for (const double angle : {1e-2, 1e-6, 1e-9, 1e-15}) {
    std::vector<SilhouetteView> more = views;
    for (const SilhouetteView& v : views) {
      const Eigen::Vector3d eye = CentreOfProjection(v.P).hnormalized();
      more.push_back(Photograph(kBall, Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * eye));
    }
    const Made made = SoundHull(more);
    EXPECT_EQ(made.summary.left_out.size(), 0u) << angle;
    EXPECT_LE(made.summary.volume, volume * (1 + 1e-9)) << angle;
    EXPECT_GT(made.summary.volume, kBallVolume) << angle;
  }
}

TEST(HullHardCase, ViewsFromOnePlaceDoNotSayHowFarAndAreRefused) {
  for (const double angle : {0.0, 1e-15, 1e-9}) {
    const Eigen::Vector3d eye(5, 0, 0), turned = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * eye;
    const std::vector<SilhouetteView> views = {Photograph(kBall, eye), Photograph(kBall, turned)};
    EXPECT_THROW(BuildVisualHull(views, {}, SilentProgress()), DataError) << angle;
    // With a point of the object it is a piece of the cone, cut off, and said to be.
    HullOptions coarse;
    coarse.cell_px = 8;
    EXPECT_FALSE(SoundHull(views, coarse, Eigen::Vector3d::Zero()).summary.bounded) << angle;
  }
}

TEST(HullHardCase, ScenesOfAnyUnitAnywhere) {
  const std::vector<SilhouetteView> views = Around(Ellipsoid({1, 0.7, 0.5}), 8);
  const Made here = SoundHull(views);
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
    const Made there = SoundHull(Moved(views, scale, scale * Eigen::Vector3d(3, -20, 100)));
    // Rounding may move a grid's corner across the surface here and there.
    EXPECT_NEAR(there.summary.volume / std::pow(scale, 3), here.summary.volume, 1e-3 * here.summary.volume) << scale;
    EXPECT_EQ(there.summary.used.size(), 8u) << scale;
  }
}

TEST(HullHardCase, CoplanarConesOfACubeSeenAlongItsFaces) {
  // Cameras in the planes of the cube's faces: their cones' sides are coplanar with each other's.
  std::vector<SilhouetteView> views;
  const Body cube = Block({0.5, 0.5, 0.5});
  for (const double side : {-0.5, 0.5}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double far : {-4.0, 4.0}) {
        Eigen::Vector3d eye = Eigen::Vector3d::Constant(side), target = eye;
        eye[axis] = far;
        target[axis] = 0;
        views.push_back(Photograph(cube, eye, target));
      }
    }
  }
  const Made made = SoundHull(views);
  EXPECT_EQ(made.summary.left_out.size(), 0u);
  EXPECT_GT(made.summary.volume, 1);
  EXPECT_LT(made.summary.volume, 1.15);
}

TEST(HullHardCase, SilhouettesThatAgreeNowhereAreRefusedNotAnEmptyHull) {
  // Two views whose masks show different ends of the world.
  std::vector<SilhouetteView> views = {Photograph(Ellipsoid({0.2, 0.2, 0.2}, {0, 0, 0.9}), {5, 0, 0}),
                                       Photograph(Ellipsoid({0.2, 0.2, 0.2}, {0, 0, -0.9}), {0, 5, 0})};
  EXPECT_THROW(BuildVisualHull(views, {}, SilentProgress()), DataError);
  // With others it is they who are left out.
  for (const SilhouetteView& v : Around(kBall, 8)) views.push_back(v);
  const Made made = SoundHull(views);
  EXPECT_GT(made.summary.volume, kBallVolume);
}

TEST(HullHardCase, ACameraThatIsOffByLittleToMuchNeverEmptiesTheHull) {
  for (double off = 1e-4; off < 3; off *= 4) {
    std::vector<SilhouetteView> views = Around(kBall, 6);
    views[1].P.col(3) +=
        views[1].P.leftCols<3>() * (off * Eigen::Vector3d(views[1].P.block<1, 3>(0, 0).transpose()).normalized());
    const Made made = SoundHull(views);
    EXPECT_GT(made.summary.volume, 0.95 * kBallVolume) << off;
    EXPECT_LE(made.summary.left_out.size(), 1u) << off;
  }
}

}  // namespace
}  // namespace lumi::test
