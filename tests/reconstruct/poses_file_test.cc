#include "reconstruct/poses_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "reconstruct/known_cameras.h"
#include "scene/files/atomic_file.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

class PosesFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("lumi-poses-{}-{}", ::getpid(),
                                                      ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path Write(const std::string& text, const std::string& name = "poses.txt") const {
    WriteTextAtomically(folder_ / name, text);
    return folder_ / name;
  }
  fs::path folder_;
};

Rigid3 RandomPose(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return {Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized(),
          Eigen::Vector3d(normal(random), normal(random), normal(random))};
}

std::string Numbers(const Eigen::Matrix<double, 3, 4>& m) {
  std::string text;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) text += fmt::format("{}{:.17g}", text.empty() ? "" : " ", m(r, c));
  return text;
}

constexpr const char* kTwelve = "1 0 0 0 0 1 0 0 0 0 1 5";

TEST(DecomposeProjection, GivesBackRandomCamerasWhateverTheSignAndScaleOfP) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> focal(300, 4000), centre(100, 2000), scale(-3, 3);
  for (int i = 0; i < 500; ++i) {
    Eigen::Matrix3d K;
    K << focal(random), 0, centre(random), 0, focal(random), centre(random), 0, 0, 1;
    const Rigid3 pose = RandomPose(random);
    double s = scale(random);
    if (std::abs(s) < 1e-3) s = -1e-3;
    const auto d = DecomposeProjection(s * ProjectionMatrix(K, pose));
    ASSERT_TRUE(d);
    // The condition of K is about its focal length: 1e4 epsilon.
    constexpr double kTolerance = 1e-11;
    EXPECT_LT((d->K - K).cwiseAbs().maxCoeff(), kTolerance * K.maxCoeff());
    EXPECT_LT(d->cam_from_world.rotation.angularDistance(pose.rotation),
              1e-7);  // angularDistance itself has sqrt(epsilon)
    EXPECT_LT((d->cam_from_world.R() - pose.R()).cwiseAbs().maxCoeff(), kTolerance);
    EXPECT_LT((d->cam_from_world.translation - pose.translation).norm(), kTolerance * 1e2);
  }
}

TEST(DecomposeProjection, SingularMatricesHaveNoAnswer) {
  EXPECT_FALSE(DecomposeProjection(Matrix34d::Zero()));
  Matrix34d affine = Matrix34d::Zero();
  affine(0, 0) = affine(1, 1) = affine(2, 3) = 1;
  EXPECT_FALSE(DecomposeProjection(affine));
  Matrix34d nan = Matrix34d::Constant(std::nan(""));
  EXPECT_FALSE(DecomposeProjection(nan));
}

TEST_F(PosesFile, TheTwoPoseFormatsAreInversesOfEachOther) {
  std::mt19937 random(2);
  const Rigid3 pose = RandomPose(random);
  const auto a =
      ReadPosesFile(Write("# comment\nphoto.jpg " + Numbers(pose.Matrix()) + "\n"), PosesFormat::kCamFromWorld);
  const auto b = ReadPosesFile(Write("photo.jpg," + Numbers(pose.Inverse().Matrix()) + "\r\n", "b.txt"),
                               PosesFormat::kWorldFromCam);
  ASSERT_EQ(a.size(), 1u);
  ASSERT_EQ(b.size(), 1u);
  EXPECT_EQ(a[0].name, "photo.jpg");
  EXPECT_EQ(b[0].name, "photo.jpg");
  EXPECT_LT((a[0].cam_from_world.Matrix() - pose.Matrix()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((b[0].cam_from_world.Matrix() - pose.Matrix()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_FALSE(a[0].K);
}

TEST_F(PosesFile, MiddleburyGivesIntrinsicsAndPose) {
  const auto cameras =
      ReadPosesFile(Write("2\na.png 3310.4 0 316.73 0 3325.5 200.55 0 0 1 1 0 0 0 1 0 0 0 1 0.1 0.2 0.3\n"
                          "b.png 3310.4 0 316.73 0 3325.5 200.55 0 0 1 0 -1 0 1 0 0 0 0 1 0.1 0.2 0.4\n"),
                    PosesFormat::kUnset);
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[1].name, "b.png");
  EXPECT_DOUBLE_EQ((*cameras[0].K)(0, 2), 316.73);
  EXPECT_DOUBLE_EQ(cameras[1].cam_from_world.translation.z(), 0.4);
}

TEST_F(PosesFile, WhatTwelveNumbersMeanMustBeTold) {
  EXPECT_THROW(ReadPosesFile(Write(kTwelve), PosesFormat::kUnset), UsageError);
  // A matrix that is no pose can only be a projection.
  EXPECT_TRUE(ReadPosesFile(Write("700 0 320 0 0 700 240 0 0 0 1 5", "p.txt"), PosesFormat::kUnset)[0].K);
}

TEST_F(PosesFile, MalformedFilesAreRefusedWithTheirLine) {
  const auto refused = [&](const std::string& text, PosesFormat format, const std::string& expected) {
    try {
      ReadPosesFile(Write(text), format);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
    }
  };
  const std::string good = std::string("a.jpg ") + kTwelve + "\n";
  refused("", PosesFormat::kCamFromWorld, "no camera");
  refused("# only a comment\n", PosesFormat::kCamFromWorld, "no camera");
  refused(good + "b.jpg 1 2 3\n", PosesFormat::kCamFromWorld, "line 2");
  refused(good + "b.jpg 1 0 0 0 0 1 0 0 0 zero 1 5\n", PosesFormat::kCamFromWorld, "'zero'");
  refused(good + "b.jpg 1 0 0 0 0 1 0 0 0 nan 1 5\n", PosesFormat::kCamFromWorld, "'nan'");
  refused(good + kTwelve, PosesFormat::kCamFromWorld, "some have none");
  refused("2 0 0 0 0 2 0 0 0 0 2 5", PosesFormat::kCamFromWorld, "no rotation");
  refused("1 0 0 0 0 1 0 0 0 0 -1 5", PosesFormat::kCamFromWorld, "no rotation");  // a mirror
  refused("1 0 0 0 1 0 0 0 0 0 1 5", PosesFormat::kProjection, "singular");
  refused("3\na.png 1 0 0 0 1 0 0 0 1 1 0 0 0 1 0 0 0 1 0 0 0\n", PosesFormat::kUnset, "announces 3");
  refused("1\na.png 1 0 0 0 1 0 0 0 1 1 0 0 0 1 0 0 0 1 0 0\n", PosesFormat::kUnset, "21 numbers");
  refused("1\na.png 1 0 0 0 1 0 0 0 1 1 1 0 0 1 0 0 0 1 0 0 0\n", PosesFormat::kUnset, "no rotation");
  EXPECT_THROW(ReadPosesFile(folder_ / "absent.txt", PosesFormat::kCamFromWorld), InputError);
  EXPECT_THROW(ReadPosesFile(folder_, PosesFormat::kUnset), InputError);  // a folder without a model
}

Capture PosedPhotos(const std::vector<std::string>& names) {
  Capture capture;
  for (const auto& name : names) {
    InputPhoto photo;
    photo.name = name;
    photo.width_px = 640;
    photo.height_px = 480;
    capture.photos.push_back(photo);
  }
  return capture;
}

TEST_F(PosesFile, NamesAreMatchedWithoutEndingAndPunctuation) {
  ReconstructOptions options;
  options.poses = Write(fmt::format("viff.001.png {}\nviff.000.png {}\nviff.002.png {}\n", "1 0 0 1 0 1 0 0 0 0 1 0",
                                    "1 0 0 0 0 1 0 0 0 0 1 0", "1 0 0 2 0 1 0 0 0 0 1 0"));
  options.poses_format = PosesFormat::kCamFromWorld;
  options.focal_px = 500;
  std::vector<MissingPhoto> missing;
  const auto views =
      ReadKnownCameras(PosedPhotos({"viff000.jpg", "viff001.jpg", "viff007.jpg"}), options, &missing, SilentProgress());
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].name, "viff000.jpg");
  EXPECT_EQ(views[0].cam_from_world.translation.x(), 0);
  EXPECT_EQ(views[1].cam_from_world.translation.x(), 1);
  EXPECT_EQ(views[0].camera.PrincipalPointPx(), Eigen::Vector2d(320, 240));
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_EQ(missing[0].name, "viff007.jpg");
}

TEST_F(PosesFile, AListWithoutNamesNeedsALineForEachPhoto) {
  ReconstructOptions options;
  options.poses = Write(std::string(kTwelve) + "\n" + kTwelve + "\n");
  options.poses_format = PosesFormat::kWorldFromCam;
  options.intrinsics = {500, 500, 320, 240};
  std::vector<MissingPhoto> missing;
  EXPECT_EQ(ReadKnownCameras(PosedPhotos({"a.jpg", "b.jpg"}), options, &missing, SilentProgress()).size(), 2u);
  EXPECT_THROW(ReadKnownCameras(PosedPhotos({"a.jpg", "b.jpg", "c.jpg"}), options, &missing, SilentProgress()),
               DataError);
}

TEST_F(PosesFile, APixelOriginAtTheCentreMovesThePrincipalPoint) {
  ReconstructOptions options;
  options.poses = Write("700 0 320 0 0 700 240 0 0 0 1 5\n700 0 320 1 0 700 240 0 0 0 1 5\n");
  options.poses_format = PosesFormat::kProjection;
  options.pixel_origin = PixelOrigin::kCentre;
  std::vector<MissingPhoto> missing;
  const auto views = ReadKnownCameras(PosedPhotos({"a.jpg", "b.jpg"}), options, &missing, SilentProgress());
  EXPECT_NEAR(views[0].camera.PrincipalPointPx().x(), 320.5, 1e-9);
  EXPECT_NEAR(views[0].camera.PrincipalPointPx().y(), 240.5, 1e-9);
}

TEST_F(PosesFile, SkewBecomesAShearOfThePhotoAndACameraWithoutIt) {
  std::mt19937 random(3);
  Eigen::Matrix3d K;
  K << 700, 20, 300, 0, 650, 220, 0, 0, 1;
  const Rigid3 pose = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 5)};
  const Matrix34d P = ProjectionMatrix(K, pose);
  ReconstructOptions options;
  options.poses = Write("a.jpg " + Numbers(-2 * P) + "\nb.jpg " + Numbers(P) + "\n");
  options.poses_format = PosesFormat::kProjection;
  std::vector<MissingPhoto> missing;
  const Capture capture = PosedPhotos({"a.jpg", "b.jpg"});
  const auto views = ReadKnownCameras(capture, options, &missing, SilentProgress());
  ASSERT_EQ(views.size(), 2u);
  EXPECT_TRUE(HasSkew(views, capture));
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d X(coordinate(random), coordinate(random), coordinate(random));
    const Eigen::Vector2d x = *Project(P, X), straight = *views[0].camera.Project(views[0].cam_from_world * X);
    EXPECT_NEAR(straight.x(), x.x() - views[0].shear * (x.y() - 240), 1e-9);
    EXPECT_NEAR(straight.y(), x.y(), 1e-9);
  }
  // A skew far beyond any camera's is a matrix read wrongly.
  options.poses = Write("a.jpg 700 400 320 0 0 700 240 0 0 0 1 5\nb.jpg 700 400 320 1 0 700 240 0 0 0 1 5\n");
  EXPECT_THROW(ReadKnownCameras(capture, options, &missing, SilentProgress()), InputError);
}

TEST_F(PosesFile, AMirroredWorldShowsTheSamePhotos) {
  std::mt19937 random(4);
  HeldView view;
  view.camera = Camera::Pinhole(640, 480, 500, 500, 320, 240);
  view.cam_from_world = RandomPose(random);
  const HeldView mirrored = Mirrored({view})[0];
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d in_cam(normal(random), normal(random), -2 - std::abs(normal(random)));  // behind the camera
    const Eigen::Vector3d X = view.cam_from_world.Inverse() * in_cam;
    const Eigen::Vector3d in_mirrored = mirrored.cam_from_world * Eigen::Vector3d(X.x(), X.y(), -X.z());
    EXPECT_LT((in_mirrored + in_cam).norm(), 1e-12);  // the same ray, in front
  }
}

TEST_F(PosesFile, PosesWithoutAFocalLengthAreAUsageError) {
  ReconstructOptions options;
  options.poses = Write(std::string(kTwelve) + "\n" + kTwelve + "\n");
  options.poses_format = PosesFormat::kWorldFromCam;
  std::vector<MissingPhoto> missing;
  EXPECT_THROW(ReadKnownCameras(PosedPhotos({"a.jpg", "b.jpg"}), options, &missing, SilentProgress()), UsageError);
}

TEST_F(PosesFile, ACameraOfAnotherSizeIsRefusedUnlessRescaled) {
  Write("1 SIMPLE_RADIAL 1280 960 1000 640 480 -0.02\n", "cameras.txt");
  Write("1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 1 0 0 1 b.jpg\n\n", "images.txt");
  Write("", "points3D.txt");
  ReconstructOptions options;
  options.poses = folder_;
  std::vector<MissingPhoto> missing;
  const Capture capture = PosedPhotos({"a.png", "b.png"});
  EXPECT_THROW(ReadKnownCameras(capture, options, &missing, SilentProgress()), DataError);
  options.rescale_cameras = true;
  const auto views = ReadKnownCameras(capture, options, &missing, SilentProgress());
  ASSERT_EQ(views.size(), 2u);
  EXPECT_NEAR(views[0].camera.FocalPx().x(), 500, 1e-9);
  // Scaled photos are often undistorted too: both are offered.
  EXPECT_FALSE(views[0].camera.IsPinhole());
  EXPECT_TRUE(views[0].undistorted_alternative.IsPinhole());
}

}  // namespace
}  // namespace lumi
