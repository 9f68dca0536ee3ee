#include "reconstruct/options.h"

#include <gtest/gtest.h>

#include "reconstruct/features.h"
#include "reconstruct/mapping.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

ReconstructOptions Good() {
  ReconstructOptions o;
  o.input = "photos";
  o.scene = "scene";
  return o;
}

TEST(ReconstructOptions, ContradictionsAreNamed) {
  EXPECT_EQ(Validate(Good()), "");
  const auto wrong = [](auto&& change) {
    ReconstructOptions o = Good();
    change(o);
    return !Validate(o).empty();
  };
  EXPECT_TRUE(wrong([](auto& o) { o.scene.clear(); }));
  EXPECT_TRUE(wrong([](auto& o) { o.component = -1; }));
  EXPECT_TRUE(wrong([](auto& o) { o.min_registered = 1.5; }));
  EXPECT_TRUE(wrong([](auto& o) { o.min_registered = std::nan(""); }));
  EXPECT_TRUE(wrong([](auto& o) { o.keyframes = 1; }));
  EXPECT_TRUE(wrong([](auto& o) { o.poses = "p", o.rig = Rig::kRing; }));
  EXPECT_TRUE(wrong([](auto& o) { o.focal_px = 500; }));  // with nothing to use it
  EXPECT_TRUE(wrong([](auto& o) { o.poses = "p", o.focal_px = -5; }));
  EXPECT_TRUE(wrong([](auto& o) { o.poses = "p", o.intrinsics = {1, 2, 3}; }));
  EXPECT_TRUE(wrong([](auto& o) { o.poses = "p", o.intrinsics = {1, 2, 3, 4}, o.focal_px = 5; }));
  EXPECT_TRUE(wrong([](auto& o) { o.search_focal = true; }));
  EXPECT_TRUE(wrong([](auto& o) { o.period_s = 0; }));
  EXPECT_TRUE(wrong([](auto& o) { o.period_s = std::nan(""); }));
  EXPECT_TRUE(wrong([](auto& o) { o.turntable = true, o.times = "t.csv"; }));
  EXPECT_TRUE(wrong([](auto& o) { o.turntable = true, o.poses = "p"; }));
  EXPECT_FALSE(wrong([](auto& o) { o.turntable = true, o.poses = "p", o.times = "t.csv"; }));
  EXPECT_TRUE(wrong([](auto& o) { o.rig = Rig::kGrid, o.grid_size = "2x2", o.grid_positions = "p.csv"; }));
  EXPECT_TRUE(wrong([](auto& o) { o.rig = Rig::kGrid, o.grid_plane = -1; }));
  EXPECT_TRUE(wrong([](auto& o) { o.rig = Rig::kRing, o.grid_plane = 0; }));
  EXPECT_FALSE(wrong([](auto& o) { o.rig = Rig::kGrid; }));  // positions may stand in the names
  EXPECT_TRUE(wrong([](auto& o) { o.poses = "p", o.all_frames = true; }));
  EXPECT_TRUE(wrong([](auto& o) { o.clips = true, o.all_frames = true; }));
  EXPECT_TRUE(wrong([](auto& o) { o.clips = true, o.backend = Backend::kFactorization; }));
  EXPECT_FALSE(wrong([](auto& o) { o.clips = true; }));
  EXPECT_TRUE(wrong([](auto& o) { o.reference = "truth"; }));             // with nothing to measure
  EXPECT_TRUE(wrong([](auto& o) { o.tradeoff = true, o.poses = "p"; }));  // nothing is estimated
  EXPECT_TRUE(wrong([](auto& o) { o.tradeoff = true, o.rig = Rig::kRing; }));
  EXPECT_TRUE(wrong([](auto& o) { o.tradeoff = true, o.database = "d"; }));  // features are what is measured
  EXPECT_TRUE(wrong([](auto& o) {
    o.tradeoff = true, o.reference = "truth", o.backend = Backend::kFactorization, o.projective = true;
  }));
  EXPECT_FALSE(wrong([](auto& o) { o.tradeoff = true, o.reference = "truth"; }));
  EXPECT_FALSE(wrong([](auto& o) { o.rig = Rig::kGrid, o.grid_size = "2x2", o.focal_px = 500; }));
  EXPECT_FALSE(wrong([](auto& o) { o.rig = Rig::kRing, o.search_focal = true; }));
  EXPECT_TRUE(wrong([](auto& o) { o.partners = -1; }));
  EXPECT_TRUE(wrong([](auto& o) { o.partners = 10, o.matching = Matching::kExhaustive; }));
  EXPECT_FALSE(wrong([](auto& o) { o.partners = 10, o.matching = Matching::kSimilar; }));
  EXPECT_TRUE(wrong([](auto& o) { o.mapper = Mapper::kCareful, o.poses = "p"; }));
  EXPECT_TRUE(wrong([](auto& o) { o.mapper = Mapper::kHierarchical, o.backend = Backend::kFactorization; }));
  EXPECT_FALSE(wrong([](auto& o) { o.mapper = Mapper::kHierarchical; }));
}

TEST(ReconstructOptions, EveryOptionThatChangesTheResultChangesTheRecord) {
  const auto base = OptionsAsText(Good());
  const auto differs = [&](auto&& change) {
    ReconstructOptions o = Good();
    change(o);
    return OptionsAsText(o) != base;
  };
  EXPECT_TRUE(differs([](auto& o) { o.seed = 7; }));
  EXPECT_TRUE(differs([](auto& o) { o.quality = Quality::kLow; }));
  EXPECT_TRUE(differs([](auto& o) { o.component = 1; }));
  EXPECT_TRUE(differs([](auto& o) { o.search_focal = true; }));
  EXPECT_TRUE(differs([](auto& o) { o.intrinsics = {1, 2, 3, 4}; }));
  EXPECT_TRUE(differs([](auto& o) { o.all_frames = true; }));
  EXPECT_TRUE(differs([](auto& o) { o.clips = true; }));
  EXPECT_TRUE(differs([](auto& o) { o.matching = Matching::kSimilar; }));
  EXPECT_TRUE(differs([](auto& o) { o.partners = 10; }));
  EXPECT_TRUE(differs([](auto& o) { o.mapper = Mapper::kCareful; }));
  EXPECT_FALSE(differs([](auto& o) { o.threads = 3; }));
  EXPECT_FALSE(differs([](auto& o) { o.tradeoff = true, o.reference = "truth"; }));  // measured beside the scene
}

TEST(ReconstructSummary, SurvivesItsJson) {
  ReconstructSummary s;
  s.images_total = 12;
  s.images_registered = 10;
  s.missing = {{"a \"b\".jpg", "blurred", "again"}, {"c.jpg", "far", ""}};
  s.mean_reprojection_error_px = 0.5;
  s.components = {10, 2};
  s.reused = {"features"};
  s.focal_px = 812.5;
  s.camera_model = "RADIAL";
  const auto back = JsonKeys::Parse(JsonKeys(s).Text())->As<ReconstructSummary>();
  EXPECT_EQ(JsonKeys(back).Text(), JsonKeys(s).Text());
  EXPECT_EQ(back.missing[0].name, s.missing[0].name);
}

Capture Photos(std::size_t n, int width, std::optional<double> focal) {
  Capture capture;
  for (std::size_t i = 0; i < n; ++i) {
    InputPhoto p;
    p.name = std::to_string(i);
    p.width_px = width;
    p.height_px = 100;
    p.focal_35mm = focal;
    capture.photos.push_back(p);
  }
  return capture;
}

TEST(CameraPlan, PhotosShareACameraWhenSizeAndFocalLengthAgree) {
  const ReconstructOptions o = Good();
  EXPECT_TRUE(PlanCameras(Photos(10, 200, std::nullopt), o).shared);
  EXPECT_EQ(PlanCameras(Photos(10, 200, std::nullopt), o).model, CameraModel::kRadial);
  EXPECT_EQ(PlanCameras(Photos(3, 200, std::nullopt), o).model, CameraModel::kSimpleRadial);  // too few for two terms
  Capture sizes = Photos(10, 200, std::nullopt);
  sizes.photos[3].width_px = 300;
  EXPECT_FALSE(PlanCameras(sizes, o).shared);
  Capture zoom = Photos(10, 200, 35.0);
  zoom.photos[3].focal_35mm = 70;
  EXPECT_FALSE(PlanCameras(zoom, o).shared);
  ReconstructOptions yes = o;
  yes.single_camera = SingleCamera::kYes;
  EXPECT_TRUE(PlanCameras(zoom, yes).shared);
  EXPECT_THROW(PlanCameras(sizes, yes), DataError);
}

TEST(Matching, FollowsTheInput) {
  ReconstructOptions o = Good();
  EXPECT_EQ(ChoosePairs(o, 100, false), PairChoice::kAll);
  EXPECT_EQ(ChoosePairs(o, 101, false), PairChoice::kListed);
  EXPECT_EQ(ChoosePairs(o, 60, true), PairChoice::kAll);
  EXPECT_EQ(ChoosePairs(o, 61, true), PairChoice::kListed);
  o.matching = Matching::kExhaustive;
  EXPECT_EQ(ChoosePairs(o, 1000, true), PairChoice::kAll);
  o.matching = Matching::kSequential;
  EXPECT_EQ(ChoosePairs(o, 10, false), PairChoice::kNeighbours);
  o.matching = Matching::kSimilar;
  EXPECT_EQ(ChoosePairs(o, 10, false), PairChoice::kListed);
  o.matching = Matching::kAuto;
  o.partners = 7;
  EXPECT_EQ(ChoosePairs(o, 10, false), PairChoice::kListed);
  EXPECT_EQ(PartnersOf(o, false), 7);
  EXPECT_GT(PartnersOf({}, false), PartnersOf({}, true));
}

TEST(FeatureLimits, FewerForMorePhotosAndTheUsersWordOverrides) {
  ReconstructOptions o = Good();
  EXPECT_GT(LimitsFor(o, 10).max_features, LimitsFor(o, 100).max_features);
  EXPECT_GT(LimitsFor(o, 100).max_features, LimitsFor(o, 1000).max_features);
  o.max_features = 123;
  EXPECT_EQ(LimitsFor(o, 10).max_features, 123);
}

Scene SceneOf(std::size_t points, double baseline) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(100, 100, 100, 100, 50, 50));
  for (int i = 0; i < 2; ++i) {
    View view;
    view.camera = CameraId{0};
    view.cam_from_world.translation = Eigen::Vector3d(-i * baseline, 0, 0);
    scene.views.push_back(view);
  }
  for (std::size_t i = 0; i < points; ++i) {
    Point p;
    p.x_in_world = Eigen::Vector3d(0.001 * static_cast<double>(i), 0, 10);
    p.error_px = 0.5;
    p.track = {{ViewId{0}, Eigen::Vector2d::Zero()}, {ViewId{1}, Eigen::Vector2d::Zero()}};
    scene.points.push_back(p);
  }
  return scene;
}

TEST(Distrust, AChanceAlignmentAndAStandingCameraAreNoScene) {
  EXPECT_EQ(Distrust(SceneOf(500, 2)), "");
  EXPECT_NE(Distrust(SceneOf(30, 2)).find("only 30 points"), std::string::npos);
  EXPECT_NE(Distrust(SceneOf(500, 0.05)).find("nearly one place"), std::string::npos);
  EXPECT_FALSE(Distrust(Scene{}).empty());
}

TEST(Outliers, PointsFarBeyondTheMedianErrorAreLeftOut) {
  Scene scene = SceneOf(101, 2);
  scene.points[7].error_px = 1.4;
  scene.points[8].error_px = 1.6;
  const Scene clean = WithoutOutliers(scene, 3);
  EXPECT_EQ(clean.points.size(), 100u);
}

}  // namespace
}  // namespace lumi
