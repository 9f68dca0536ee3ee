#include "scene/files/camera_yaml.h"

#include <opencv2/core.hpp>

#include "files_test_util.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"

namespace lumi::test {
namespace {

const char* kRos = R"(image_width: 640
image_height: 480
camera_name: left  # a comment
camera_matrix:
  rows: 3
  cols: 3
  data: [500.5, 0., 319.5, 0.0, 501.25, 239.5, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.1,
         1e-3, -2e-3, 0.0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
)";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(CameraYaml, RosLayoutIsReadAndThePrincipalPointMovesToOurPixels) {
  const TempFolder folder;
  Write(folder / "c.yaml", kRos);
  const Camera camera = ReadCameraYaml(folder / "c.yaml");
  EXPECT_EQ(camera.model, CameraModel::kOpenCV);
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  EXPECT_EQ(camera.params, (std::vector<double>{500.5, 501.25, 320, 240, -0.25, 0.1, 1e-3, -2e-3}));
}

TEST(CameraYaml, WhatIsWrittenComesBackAndOpenCvReadsIt) {
  const TempFolder folder;
  for (const Camera& camera :
       {Camera::Pinhole(640, 480, 500.123456789, 501, 320.25, 240),
        Camera{CameraModel::kOpenCV, 640, 480, {500, 501, 320.5, 240.5, -0.2, 0.1, 1e-4, -1.0 / 3}},
        Camera{CameraModel::kOpenCVFisheye, 640, 480, {300, 301, 320.5, 240.5, 0.1, -0.02, 0.003, 1e-5}}}) {
    WriteCameraYaml(camera, folder / "c.yaml");
    const Camera back = ReadCameraYaml(folder / "c.yaml");
    EXPECT_EQ(back.model, camera.model);
    EXPECT_EQ(back.params, camera.params);
    const cv::FileStorage storage((folder / "c.yaml").string(), cv::FileStorage::READ);
    ASSERT_TRUE(storage.isOpened());
    cv::Mat K, d;
    storage["camera_matrix"] >> K;
    storage["distortion_coefficients"] >> d;
    ASSERT_EQ(K.size(), cv::Size(3, 3));
    EXPECT_EQ(K.at<double>(0, 0), camera.params[0]);
    EXPECT_EQ(K.at<double>(0, 2), camera.params[2] - 0.5);
    EXPECT_EQ(d.total(), camera.model == CameraModel::kOpenCVFisheye ? 4u : 5u);
  }
  // One focal length becomes two: the same camera in OpenCV's model.
  WriteCameraYaml({CameraModel::kRadial, 640, 480, {500, 320, 240, -0.1, 0.02}}, folder / "c.yaml");
  EXPECT_EQ(ReadCameraYaml(folder / "c.yaml").params, (std::vector<double>{500, 500, 320, 240, -0.1, 0.02, 0, 0}));
}

TEST(CameraYaml, WhatColmapCannotHoldIsRefusedWithAWayOut) {
  const TempFolder folder;
  const auto refused = [&](const std::string& text, const char* reason) {
    Write(folder / "c.yaml", text);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadCameraYaml(folder / "c.yaml"));
  };
  refused(Replaced(kRos, "-2e-3, 0.0]", "-2e-3, 0.3]"), "k3");
  refused(Replaced(kRos, "500.5, 0.,", "500.5, 0.7,"), "skew");
  refused(Replaced(kRos, "1e-3, -2e-3, 0.0]", "1e-3]"), "3 distortion coefficients");
  refused(Replaced(kRos, "-2e-3, 0.0]", "-2e-3, 0.0, 0, 0.2, 0]"), "coefficient 7");
  refused(Replaced(kRos, "plumb_bob", "ocam"), "ocam");
  refused(Replaced(kRos, "plumb_bob", "fisheye"), "4 distortion coefficients");
  refused(Replaced(kRos, "image_width: 640", "image_width: wide"), "image_width");
  refused(Replaced(kRos, "image_width: 640\n", ""), "image_width");
  refused(Replaced(kRos, "500.5", "-500.5"), "focal length");
  refused(Replaced(kRos, "500.5", ".Nan"), "no number");
  refused(Replaced(kRos, "500.5", "nan"), "no number");
  refused(Replaced(kRos, ", 1.]", "]"), "9 numbers");
  refused(Replaced(kRos, "0., 0., 1.]", "0., 0., 1."), "camera_matrix");
  refused("", "image_width");
}

TEST(CameraYaml, OpenCvsOwnCalibrationIsReadButForItsK3) {
  const fs::path file = SharedData("boards-stereo/left_intrinsics.yml");
  if (!fs::exists(file)) GTEST_SKIP() << "no " << file;
  EXPECT_REFUSED(ExitCode::kCorruptInput, "k3", ReadCameraYaml(file));
  const TempFolder folder;
  Write(folder / "c.yaml", Replaced(Read(file), "2.3839153080878486e-01", "0."));
  const Camera camera = ReadCameraYaml(folder / "c.yaml");
  EXPECT_EQ(camera.FocalPx().x(), 5.3591573396163199e+02);
  EXPECT_EQ(camera.PrincipalPointPx().x(), 3.4228315473308373e+02 + 0.5);
  EXPECT_EQ(camera.params[4], -2.6637260909660682e-01);
}

TEST(CameraYaml, SkewIsWrittenAndRefusedWhereItCannotBeHeld) {
  const lumi::TemporaryFolder folder;
  Camera camera{CameraModel::kPlumbBob, 640, 480, {600, 610, 320.5, 240.5, 0, -0.2, 0.05, 1e-3, -2e-3, 0}};
  WriteCameraYaml(camera, folder / "plain.yaml");
  const Camera read = ReadCameraYaml(folder / "plain.yaml");
  EXPECT_EQ(read.params, (std::vector<double>{600, 610, 320.5, 240.5, -0.2, 0.05, 1e-3, -2e-3}));
  camera.params[4] = 2.5;
  WriteCameraYaml(camera, folder / "skew.yaml");
  EXPECT_NE(ReadText(folder / "skew.yaml").find("data: [600, 2.5, 320, 0, 610, 240, 0, 0, 1]"), std::string::npos);
  EXPECT_THROW(ReadCameraYaml(folder / "skew.yaml"), InputError);
}

TEST(CameraYaml, AllThatACalibrationKnowsComesBack) {
  const lumi::TemporaryFolder folder;
  const Camera camera{CameraModel::kPlumbBob, 640, 480, {600, 610, 320.5, 240.5, 2.5, -0.2, 0.05, 1e-3, -2e-3, 0.01}};
  WriteCameraYaml(camera, folder / "c.yaml");
  const CameraYaml read = ReadWholeCameraYaml(folder / "c.yaml");
  EXPECT_EQ(read.camera.model, CameraModel::kPlumbBob);
  EXPECT_TRUE(read.says_distortion);
  EXPECT_EQ(read.camera.params, camera.params);
  Write(folder / "plain.yaml",
        "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [600, 0, 320, 0, 610, 240, 0, 0, 1]\n");
  EXPECT_FALSE(ReadWholeCameraYaml(folder / "plain.yaml").says_distortion);
  EXPECT_TRUE(ReadCameraYaml(folder / "plain.yaml").IsPinhole());
}

}  // namespace
}  // namespace lumi::test
