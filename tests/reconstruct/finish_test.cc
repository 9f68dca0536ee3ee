// The scene folder that a reconstruction leaves: what is beside a photo has moved as the photo has.
#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/finish.h"
#include "reconstruct/known_cameras.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/taken_photos.h"
#include "scene/files/temporary_folder.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

Scene OnePhoto(const fs::path& folder, const std::string& name, const Camera& camera) {
  Scene scene;
  scene.image_folder = folder;
  scene.cameras.push_back(camera);
  View view;
  view.name = name;
  view.camera = {0};
  scene.views.push_back(view);
  return scene;
}

TEST(FinishScene, AMaskIsUndistortedAsItsPhotoIs) {
  // The photo is its own mask: black and white fields, whose borders lie anywhere in the undistorted pixels.
  constexpr int kWidth = 240, kHeight = 180, kField = 6;
  Image8 photo(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) photo.At(x, y, 0) = (x / kField + y / kField) % 2 == 0 ? 255 : 0;
  const TemporaryFolder folder;
  WriteImage(folder / "photos" / "a.png", photo);
  WriteImage(folder / "masks" / "a.png.png", photo);

  Camera camera;
  camera.model = CameraModel::kSimpleRadial;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.params = {200, 0.5 * kWidth + 3.3, 0.5 * kHeight - 2.6, -0.12};
  Scene scene = OnePhoto(folder / "photos", "a.png", camera);
  ReconstructOptions options;
  options.scene = folder / "scene";
  options.masks = folder / "masks";
  ReconstructSummary summary;
  FinishScene(scene, options, summary, SilentProgress());

  const Image8 moved = ReadImage8(folder / "scene" / "images" / "a.png"),
               mask = ReadImage8(folder / "scene" / "masks" / "a.png.png");
  ASSERT_EQ(mask.width, moved.width);
  ASSERT_EQ(mask.height, moved.height);
  // The nearest pixel is white where more than half of what is interpolated is: by a straight border always, at a
  // field's corner nearly.
  int told = 0, apart = 0;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      const int grey = moved.At(x, y, 0);
      if (std::abs(grey - 127.5) < 25) continue;
      ++told;
      apart += (grey > 127) != (mask.At(x, y, 0) > 127);
    }
  EXPECT_GT(told, 30000);
  EXPECT_LT(apart, told / 500);
}

TEST(FinishScene, ARunWithoutMasksLeavesNoneOfAnEarlierRun) {
  const TemporaryFolder folder;
  WriteImage(folder / "photos" / "a.png", Image8(60, 40, 3, 90));
  Scene scene = OnePhoto(folder / "photos", "a.png", Camera::Pinhole(60, 40, 50, 50, 30, 20));
  ReconstructOptions options;
  options.scene = folder / "scene";
  const auto finish = [&] {
    ReconstructSummary summary;
    FinishScene(scene, options, summary, SilentProgress());
  };
  const fs::path mask = folder / "scene" / "masks" / "a.png.png";
  WriteImage(mask, Image8(60, 40, 1, 255));
  finish();
  EXPECT_TRUE(fs::exists(mask)) << "somebody's own";
  Provenance record;
  record.stage = "reconstruct";
  record.outputs["masks"] = Fingerprint(folder / "scene" / "masks");
  WriteProvenance(folder / "scene", record);
  finish();
  EXPECT_FALSE(fs::exists(folder / "scene" / "masks")) << "of the run with --masks before";
}

// A scene as a reconstruction leaves it, of one photo b.png, which was staged from b.heic.
struct StagedScene {
  TemporaryFolder folder;
  Scene written;
  GivenCamera given;
  explicit StagedScene(const Camera& camera) {
    WriteImage(folder / "photos" / "b.png", Image8(camera.width_px, camera.height_px, 3, 90));
    Scene scene = OnePhoto(folder / "photos", "b.png", camera);
    ReconstructOptions options;
    options.scene = folder / "scene";
    ReconstructSummary summary;
    written = FinishScene(scene, options, summary, SilentProgress());
    InputPhoto photo;
    photo.name = "b.png";
    photo.original = "b.heic";
    given.capture.photos.push_back(photo);
  }
  std::map<std::string, Camera> skewed;
  std::vector<TakenPhoto> Noted() {
    NoteHowPhotosWereTaken(written, given, skewed);
    return ReadTakenPhotos(written.image_folder);
  }
};

TEST(FinishScene, PhotosAreNotedAsTheyWereTakenUnderTheUsersNames) {
  const Camera lens{CameraModel::kSimpleRadial, 60, 40, {50, 33, 19, -0.1}};
  StagedScene distorted(lens);
  const std::vector<TakenPhoto> noted = distorted.Noted();
  ASSERT_EQ(noted.size(), 1u);
  EXPECT_EQ(noted[0].name, "b.png");
  EXPECT_EQ(noted[0].taken, "b.heic");
  EXPECT_EQ(noted[0].camera.model, lens.model);
  EXPECT_EQ(noted[0].camera.params, lens.params);
  EXPECT_EQ(noted[0].pinhole.params, distorted.written.cameras[0].params);

  const Camera pinhole = Camera::Pinhole(60, 40, 50, 50, 30, 20);
  StagedScene plain(pinhole);
  ASSERT_EQ(plain.Noted().size(), 1u) << "its name is another";
  EXPECT_EQ(plain.Noted()[0].taken, "b.heic");
  EXPECT_TRUE(plain.Noted()[0].camera.IsPinhole());

  // Of a pose with skew the photo was sheared, about its middle row, and nothing else.
  StagedScene straightened(pinhole);
  straightened.skewed = {{"b.png", WithSkew(HeldView{"b.png", pinhole, {}, {}, 0.02})}};
  const std::vector<TakenPhoto> sheared = straightened.Noted();
  ASSERT_EQ(sheared.size(), 1u);
  EXPECT_EQ(sheared[0].taken, "b.heic");
  for (const Eigen::Vector3d& x : {Eigen::Vector3d(0.2, 0.3, 1), Eigen::Vector3d(-0.4, -0.1, 1)}) {
    const Eigen::Vector2d straight = *pinhole.Project(x);
    EXPECT_LT((*sheared[0].camera.Project(x) - straight - Eigen::Vector2d(0.02 * (straight.y() - 20), 0)).norm(),
              1e-12);
  }

  // Before COLMAP saw them, photos were resampled from a lens that it does not know.
  const Camera skewed{CameraModel::kPlumbBob, 60, 40, {50, 50, 31, 19, 0.8, -0.1, 0.02, 0, 0, 0.01}};
  plain.given.resampled = skewed;
  const std::vector<TakenPhoto> resampled = plain.Noted();
  ASSERT_EQ(resampled.size(), 1u);
  EXPECT_EQ(resampled[0].camera.model, skewed.model);
  EXPECT_EQ(resampled[0].camera.params, skewed.params);
  EXPECT_EQ(resampled[0].pinhole.params, PinholeInside(skewed).params);
}

}  // namespace
}  // namespace lumi
