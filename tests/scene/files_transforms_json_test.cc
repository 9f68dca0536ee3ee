#include "scene/files/transforms_json.h"

#include <fmt/format.h>

#include <numbers>

#include "files_test_util.h"
#include "scene/files/colmap_model.h"

namespace lumi::test {
namespace {

const char* kIdentity = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

TEST(TransformsJson, AnOpenGlCameraLooksDownItsNegativeZAxisWithYUp) {
  const TempFolder folder;
  WriteImage(folder / "images/a.png", ColorfulImage(64, 48));
  // The camera at (1, 2, 3), unrotated in OpenGL's sense: x right, y up, looking along -z of the world.
  Write(folder / "t.json", R"({"fl_x": 50, "w": 64, "h": 48, "frames": [{"file_path": "./images/a.png", "time": 1.5,
        "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}]})");
  const Scene scene = ReadTransformsJson(folder / "t.json");
  ASSERT_EQ(scene.views.size(), 1u);
  const View& view = scene.views[0];
  EXPECT_EQ(view.name, "images/a.png");
  EXPECT_EQ(view.time_s, 1.5);
  EXPECT_TRUE(fs::exists(scene.ImagePath(view)));
  constexpr double kTransformRounding = 1e-14;
  EXPECT_LT((view.CentreInWorld() - Eigen::Vector3d(1, 2, 3)).norm(), kTransformRounding);
  EXPECT_LT((view.cam_from_world * Eigen::Vector3d(1, 2, 3 - 7) - Eigen::Vector3d(0, 0, 7)).norm(), kTransformRounding);
  EXPECT_LT((view.cam_from_world * Eigen::Vector3d(1, 2 + 1, 3) - Eigen::Vector3d(0, -1, 0)).norm(),
            kTransformRounding);
  const Camera& camera = scene.CameraOf(view);
  EXPECT_TRUE(camera.IsPinhole());
  EXPECT_EQ(camera.FocalPx(), Eigen::Vector2d(50, 50));
  EXPECT_EQ(camera.PrincipalPointPx(), Eigen::Vector2d(32, 24));
}

TEST(TransformsJson, FieldsOfViewSizesAndEndingsMayBeLeftToThePhotos) {
  const TempFolder folder;
  WriteImage(folder / "train/r_0.png", ColorfulImage(100, 80));
  Write(folder / "transforms.json",
        fmt::format(R"({{"camera_angle_x": {}, "frames": [{{"file_path": "./train/r_0", "transform_matrix": {}}}]}})",
                    std::numbers::pi / 2, kIdentity));
  const Scene scene = ReadTransformsJson(folder / "transforms.json");
  constexpr double kTransformRounding = 1e-12;
  EXPECT_NEAR(scene.cameras.at(0).FocalPx().x(), 50, kTransformRounding);
  EXPECT_NEAR(scene.cameras.at(0).FocalPx().y(), 50, kTransformRounding);
  EXPECT_EQ(scene.cameras.at(0).width_px, 100);
  EXPECT_EQ(scene.cameras.at(0).height_px, 80);
  EXPECT_EQ(scene.views[0].name, "train/r_0.png");
}

TEST(TransformsJson, WhatIsWrittenComesBackWhereverThePhotosLie) {
  const TempFolder folder;
  for (const CameraModel model :
       {CameraModel::kPinhole, CameraModel::kRadial, CameraModel::kOpenCV, CameraModel::kOpenCVFisheye})
    for (const char* file : {"photos/t.json", "t.json", "elsewhere/t.json"}) {
      Scene scene = SmallScene(0, model);
      scene.image_folder = folder / "photos";
      for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
      scene.views[1].time_s = 0.25;
      scene.views[2].orientation = 8;
      WriteTransformsJson(scene, folder / file);
      const Scene back = ReadTransformsJson(folder / file);
      ASSERT_EQ(back.views.size(), scene.views.size());
      constexpr double kTransformRounding = 1e-13;
      for (std::size_t i = 0; i < scene.views.size(); ++i) {
        EXPECT_TRUE(fs::equivalent(back.ImagePath(back.views[i]), scene.ImagePath(scene.views[i])));
        EXPECT_LT((back.views[i].cam_from_world.Matrix() - scene.views[i].cam_from_world.Matrix()).norm(),
                  kTransformRounding);
        const Eigen::Vector3d x(0.3, -0.2, 1);
        EXPECT_LT((*back.CameraOf(back.views[i]).Project(x) - *scene.CameraOf(scene.views[i]).Project(x)).norm(),
                  kTransformRounding * 64);
        EXPECT_EQ(back.views[i].time_s, scene.views[i].time_s);
        EXPECT_EQ(back.views[i].orientation, scene.views[i].orientation);
      }
      EXPECT_EQ(back.cameras.size(), 2u);
    }
}

TEST(TransformsJson, FramesWithoutPhotoAreLeftOutAndNamed) {
  const TempFolder folder;
  WriteImage(folder / "a.png", ColorfulImage(8, 8));
  Write(folder / "t.json", fmt::format(R"({{"fl_x": 50, "frames": [{{"file_path": "gone.png"}}, )"
                                       R"({{"file_path": "a.png", "transform_matrix": {}}}]}})",
                                       kIdentity));
  std::vector<std::string> skipped;
  EXPECT_EQ(ReadTransformsJson(folder / "t.json", &skipped).views.size(), 1u);
  EXPECT_EQ(skipped, std::vector<std::string>{"gone.png"});
}

TEST(TransformsJson, BrokenFilesAreRefusedWithTheirReason) {
  const TempFolder folder;
  WriteImage(folder / "a.png", ColorfulImage(8, 8));
  const auto refused = [&](const std::string& text, const char* reason) {
    Write(folder / "t.json", text);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadTransformsJson(folder / "t.json"));
  };
  const auto frame = [](const std::string& root, const std::string& matrix) {
    return "{" + root + R"("frames": [{"file_path": "a.png", "transform_matrix": )" + matrix + "}]}";
  };
  refused("{\"frames\": [\n{", "line 2");
  refused("", "no valid JSON");
  refused("[]", "no frames");
  refused("{\"frames\": []}", "no frames");
  refused("{\"frames\": [3]}", "frames[0]");
  refused("{\"frames\": [{}]}", "file_path");
  refused(R"({"frames": [{"file_path": "gone.png"}]})", "none of its 1 photos");
  refused(frame("", kIdentity), "fl_x");
  refused(frame(R"("fl_x": "fifty", )", kIdentity), "fl_x is no number");
  refused(frame(R"("fl_x": -50, )", kIdentity), "focal length");
  refused(frame(R"("camera_angle_x": 4, )", kIdentity), "field of view");
  refused(frame(R"("fl_x": 50, "w": 1e99, "h": 8, )", kIdentity), "size");
  refused(frame(R"("fl_x": 50, "k1": 0.1, "k3": 0.1, )", kIdentity), "k3");
  refused(frame(R"("fl_x": 50, "camera_model": "EQUIRECTANGULAR", )", kIdentity), "EQUIRECTANGULAR");
  refused(frame(R"("fl_x": 50, )", "[[1,0,0,0],[0,1,0,0],[0,0,2,0],[0,0,0,1]]"), "no rotation");
  refused(frame(R"("fl_x": 50, )", "[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "no rotation");
  refused(frame(R"("fl_x": 50, )", "[[1,0,0,0],[0,1,0],[0,0,1,0],[0,0,0,1]]"), "4x4");
  refused(frame(R"("fl_x": 50, )", "[[1,0,0,0],[0,1,0,null],[0,0,1,0],[0,0,0,1]]"), "no number");
  refused(frame(R"("fl_x": 50, )", "7"), "4x4");
}

TEST(TransformsJson, TheFoxIsReadWithItsFiftyPhotos) {
  const fs::path fox = SharedData("fox/transforms.json");
  if (!fs::exists(fox)) GTEST_SKIP() << "no " << fox;
  std::vector<std::string> skipped;
  const Scene scene = ReadTransformsJson(fox, &skipped);
  EXPECT_EQ(scene.views.size(), 50u);
  EXPECT_EQ(skipped.size(), 17u);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].params,
            (std::vector<double>{1375.52, 1374.49, 554.558, 965.268, 0.0578421, -0.0805099, -0.000980296, 0.00015575}));
  // The photographer walked around the fox: neighbours look the same way, and the cameras' views meet.
  for (std::size_t i = 1; i < scene.views.size(); ++i)
    EXPECT_GT(scene.views[i].cam_from_world.R().row(2).dot(scene.views[i - 1].cam_from_world.R().row(2)), 0.7);
  // The file's world has z up: every photo's own up (-y) does too, if the axes were taken right.
  for (const View& view : scene.views) EXPECT_GT(-view.cam_from_world.R().row(1).z(), 0.5) << view.name;
}

}  // namespace
}  // namespace lumi::test
