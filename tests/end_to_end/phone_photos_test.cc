// Photos as a phone hands them over: held upright or across, some as 16-bit TIFF, with masks drawn over what one sees.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "reconstruct/colmap_database.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/angle.h"
#include "scene/model/orientation.h"
#include "tests/support/bad_input.h"
#include "tests/support/child_program.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kPhotos = 12, kFocal35 = 34;
constexpr int kMaskedShare = 5;  // one in so many columns of the stored photo is masked, from the left

void WriteDeepTiff(const fs::path& path, const Image8& image) {
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT16);
  spec.attribute("Make", "Acme");
  spec.attribute("Model", "Phone 7");
  spec.attribute("Exif:FocalLengthIn35mmFilm", kFocal35);
  const auto out = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(out && out->open(path.string(), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, image.data.data()) && out->close());
}

TEST(PhonePhotos, HeldUprightOrAcrossInTiffOrJpegWithMasksOfAnyName) {
  const SimulatedCapture capture("desk", kPhotos, 480, {"--portrait-every", "2"});
  const fs::path photos = capture / "photos", masks = capture / "drawn", scene = capture / "scene";
  OpenOptions as_they_are;
  as_they_are.undistort = false;
  const Scene truth = OpenScene(capture.path(), as_they_are, SilentProgress());
  fs::create_directories(photos);
  int across = 0;
  for (const View& view : truth.views) {
    const fs::path file = truth.ImagePath(view);
    const Image8 photo = ReadImage8(file);
    Image8 mask(photo.width, photo.height, 1, 255);
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width / kMaskedShare; ++x) mask.At(x, y, 0) = 0;
    if (view.orientation == 1) {
      WriteDeepTiff(photos / (file.stem().string() + ".TIF"), photo);
      WriteImage(masks / (file.stem().string() + ".png"), mask);
      ++across;
    } else {
      fs::copy_file(file, photos / file.filename());
      WriteImage(masks / (file.filename().string() + ".PNG"), UprightPicture(mask, view.orientation));
    }
  }
  ASSERT_EQ(across, kPhotos / 2);

  const ProgramResult result =
      RunProgram({"lumi-pipeline", photos.string(), "-o", scene.string(), "--masks", masks.string(), "--holdout", "4",
                  "--no-video", "--quality", "low", "--proxy-minutes", "0", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Scene made = OpenScene(scene, {}, SilentProgress());
  ASSERT_GE(made.views.size(), kPhotos - 1U);

  // Up is up: against the truth's, which is +z, in every photo's own frame.
  std::map<std::string, const View*> true_view;
  for (const View& view : truth.views) true_view[fs::path(view.name).stem().string()] = &view;
  constexpr double kUpDeg = 2;
  for (const View& view : made.views) {
    const View& other = *true_view.at(view.name.substr(0, view.name.find('.')));
    EXPECT_EQ(view.orientation, other.orientation) << view.name;
    const Eigen::Vector3d up = view.cam_from_world.rotation * made.up,
                          true_up = other.cam_from_world.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_LT(AngleBetween(up, true_up) * kDegPerRad, kUpDeg) << view.name;
  }

  // Cameras of the copies begin at the focal length that EXIF gives; what is masked has no features.
  const ColmapDatabase database(scene / "colmap/database.db");
  std::map<std::int64_t, DatabaseCamera> cameras;
  for (const DatabaseCamera& camera : database.Cameras()) cameras[camera.id] = camera;
  for (const DatabaseImage& image : database.Images()) {
    const DatabaseCamera& camera = cameras.at(image.camera_id);
    const bool deep = image.name.ends_with(".TIF.png");
    EXPECT_EQ(camera.focal_is_known, deep) << image.name;
    if (deep) {
      EXPECT_NEAR(camera.camera.FocalPx().x(), 480 * kFocal35 / 35.0, 0.01);
    }
    const auto features = database.Keypoints(image.id);
    EXPECT_GT(features.size(), 50U);
    constexpr double kEdgePx = 1;  // a feature's pixel decides, rounded
    for (const Eigen::Vector2d& x : features)
      EXPECT_GE(x.x(), camera.camera.width_px / kMaskedShare - kEdgePx) << image.name;
  }
  for (const View& view : made.views) {
    const fs::path mask = FindMask(scene / "masks", view.name);
    ASSERT_FALSE(mask.empty()) << view.name;
    EXPECT_EQ(ReadImageInfo(mask).width, made.CameraOf(view).width_px);
  }
}

// Two walks past the same houses, one after the other.
TEST(PhonePhotos, ClipsOfOnePlaceBecomeOneScene) {
  const TemporaryFolder folder;
  const fs::path clips = folder / "clips", scene = folder / "scene";
  fs::create_directories(clips);
  const std::pair<const char*, std::vector<std::string>> walks[] = {{"first", {}},
                                                                    {"second", {"--shake", "1.6", "--seed", "7"}}};
  for (const auto& [name, more] : walks) {
    std::vector<std::string> simulate{"lumi-simulate", "--example", "plaza",   "--views", "48",
                                      "--width",       "320",       "--video", "-o",      (folder / name).string(),
                                      "--quiet"};
    simulate.insert(simulate.end(), more.begin(), more.end());
    ASSERT_EQ(RunProgram(simulate).exit_code, 0);
    fs::copy_file(folder / name / "video.mp4", clips / (std::string(name) + ".mp4"));
  }
  const ProgramResult result =
      RunProgram({"lumi-reconstruct", clips.string(), "--clips", "-o", scene.string(), "--quality", "low", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary["images_registered"], summary["images_total"]) << result.out;
  EXPECT_EQ(summary["keyframes"], summary["images_total"]);
  EXPECT_EQ(summary["cameras"], 2);
  std::map<std::string, int> views_of;
  for (const View& view : OpenScene(scene, {}, SilentProgress()).views) {
    EXPECT_FALSE(view.time_s) << view.name;
    ++views_of[view.name.substr(0, view.name.find('/'))];
  }
  EXPECT_GE(views_of["first"], 3);
  EXPECT_GE(views_of["second"], 3);
  // Named one by one they are the same capture, and lumi-pipeline takes them so.
  const ProgramResult named = RunProgram(
      {"lumi-pipeline", (clips / "first.mp4").string(), (clips / "second.mp4").string(), "-o",
       (folder / "named").string(), "--quality", "low", "--proxy", "plane", "--holdout", "0", "--no-video", "--json"});
  ASSERT_EQ(named.exit_code, 0) << named.err;
  const json cameras = json::parse(named.out)["stages"][0]["summary"];
  EXPECT_EQ(cameras["images_total"], summary["images_total"]);
  EXPECT_EQ(cameras["cameras"], 2);
  ExpectRefusal(
      {{"lumi-pipeline", (clips / "first.mp4").string(), folder.path().string(), "-o", (folder / "other").string()},
       2,
       {"is no video: several inputs are videos of one place"},
       folder / "other",
       {clips}});
  ExpectRefusal({{"lumi-pipeline", (clips / "first.mp4").string(), (clips / "second.mp4").string(), "--stabilize",
                  "smooth", "-o", (folder / "other.mp4").string()},
                 2,
                 {"--stabilize takes one video, and 2 were given"},
                 folder / "other.mp4",
                 {clips}});
  // As cameras on tripods they are none, and the message says what they may be.
  const ProgramResult refused =
      RunProgram({"lumi-reconstruct", clips.string(), "-o", (folder / "other").string(), "--quality", "low"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, testing::HasSubstr("--clips"));
}

TEST(PhonePhotos, Of360DegreesAreRefusedWithWhatToDo) {
  const TemporaryFolder folder;
  const fs::path photos = folder / "photos", scene = folder / "scene";
  for (int i = 0; i < 3; ++i) {
    Image8 around(512, 256, 3);
    for (int y = 0; y < around.height; ++y)
      for (int x = 0; x < around.width; ++x) {
        const double u = 2 * M_PI * (x + 0.5) / around.width, v = M_PI * (y + 0.5) / around.height;
        const Eigen::Vector3d d(std::sin(v) * std::cos(u + i), std::sin(v) * std::sin(u + i), std::cos(v));
        const double detail = std::sin(23 * d.x() + 5 * d.z()) + std::sin(21 * d.y() - 3 * d.z()) +
                              std::sin(15 * d.x() - 16 * d.y() + 2 * d.z());
        for (int c = 0; c < 3; ++c) around.At(x, y, c) = static_cast<std::uint8_t>(128 + 35 * detail);
      }
    WriteImage(photos / ("around" + std::to_string(i) + ".jpg"), around);
  }
  ExpectRefusal({{"lumi-reconstruct", photos.string(), "-o", scene.string()},
                 1,
                 {"around0.jpg", "360-degree", "v360"},
                 scene,
                 {photos}});
}

}  // namespace
}  // namespace lumi
