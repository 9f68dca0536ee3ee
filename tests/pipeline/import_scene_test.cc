#include "pipeline/import_scene.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_masks.h"
#include "scene/files/taken_photos.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

const std::vector<double> kDistorted{60, 32, 24, 0.05};  // of a SIMPLE_RADIAL camera

struct Workspace {
  TemporaryFolder folder;
  fs::path path = folder / "workspace";
  fs::path output = folder / "scene";
  Workspace() { WriteColmapModel(MakeSmallScene(path / "images", 5), path / "sparse"); }
  void Distort(const std::vector<double>& camera = kDistorted) const {
    Scene scene = MakeSmallScene(path / "images", 5);
    scene.cameras[0].model = CameraModel::kSimpleRadial;
    scene.cameras[0].params = camera;
    WriteColmapModel(scene, path / "sparse");
  }
  StageResult Import() const { return ImportScene({path, output, false}, SilentProgress()); }
};

TEST(ImportScene, AWorkspaceBecomesASceneAndStaysAsItWas) {
  const Workspace w;
  const std::string before = Fingerprint(w.path);
  const StageResult result = w.Import();
  EXPECT_FALSE(result.reused);
  EXPECT_EQ(Fingerprint(w.path), before);

  const Scene scene = OpenScene(w.output, {}, SilentProgress());
  ASSERT_EQ(scene.views.size(), 5U);
  EXPECT_EQ(scene.points.size(), 40U);
  EXPECT_EQ(scene.views[0].name, "photo10.png");
  EXPECT_EQ(ReadImage8(scene.ImagePath(scene.views[2])).At(5, 5, 0), 50);
  EXPECT_FALSE(fs::exists(w.output / "IMPORT-UNFINISHED"));
  const auto summary = nlohmann::json::parse(result.summary.Text());
  EXPECT_EQ(summary["images_registered"], 5);
  EXPECT_NEAR(summary["mean_reprojection_error_px"].get<double>(), 0.5, 1e-9);
}

TEST(ImportScene, ASecondRunHasNothingToDoUntilThePhotosChange) {
  const Workspace w;
  w.Import();
  EXPECT_TRUE(w.Import().reused);
  WriteImage(w.path / "images/photo11.png", Image8(64, 48, 3, 200));
  EXPECT_FALSE(w.Import().reused);
  EXPECT_EQ(ReadImage8(w.output / "images/photo11.png").At(0, 0, 0), 200);
}

TEST(ImportScene, GoesOnAfterItWasKilled) {
  const Workspace w;
  // What an import killed amid its photos leaves.
  WriteTextAtomically(w.output / "IMPORT-UNFINISHED", "");
  WriteTextAtomically(w.output / ".images-import/photo10.png", "half");
  EXPECT_FALSE(w.Import().reused);
  EXPECT_FALSE(fs::exists(w.output / ".images-import"));
  EXPECT_EQ(OpenScene(w.output, {}, SilentProgress()).views.size(), 5U);
}

TEST(ImportScene, OneThatWasKilledBeforeItsMarkWentRemovesIt) {
  const Workspace w;
  w.Import();
  WriteTextAtomically(w.output / "IMPORT-UNFINISHED", "");
  w.Import();
  EXPECT_FALSE(fs::exists(w.output / "IMPORT-UNFINISHED"));
  EXPECT_TRUE(w.Import().reused);
}

TEST(ImportScene, LeavesSomebodyElsesFolderAlone) {
  const Workspace w;
  WriteTextAtomically(w.output / "thesis.txt", "years of work");
  EXPECT_THROW(w.Import(), UsageError);
  EXPECT_EQ(ReadText(w.output / "thesis.txt"), "years of work");
  EXPECT_EQ(std::distance(fs::directory_iterator(w.output), fs::directory_iterator()), 1);
}

TEST(ImportScene, LeavesASceneThatWasNotImportedAlone) {
  const Workspace w;
  WriteScene(MakeSmallScene(w.output / "images", 3), w.output);
  const std::string before = Fingerprint(w.output);
  EXPECT_THROW(w.Import(), UsageError);
  EXPECT_EQ(Fingerprint(w.output), before);
}

TEST(ImportScene, WhatThePhotosWereBeforeTheyWereUndistortedGoesAlong) {
  const Workspace w;
  w.Distort();
  w.Import();
  const std::vector<TakenPhoto> taken = ReadTakenPhotos(w.output / "images");
  ASSERT_EQ(taken.size(), 5U);
  EXPECT_EQ(taken[0].camera.params, kDistorted);
  // Into another scene: photos that are undistorted already.
  ImportScene({w.output, w.folder / "again", false}, SilentProgress());
  const std::vector<TakenPhoto> again = ReadTakenPhotos(w.folder / "again/images");
  ASSERT_EQ(again.size(), 5U);
  EXPECT_EQ(again[0].camera.params, kDistorted);
}

// Black squares on white.
Image8 Squares() {
  Image8 picture(64, 48, 3, 255);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      for (int c = 0; c < 3; ++c)
        if ((x / 8 + y / 8) % 2 == 0) picture.At(x, y, c) = 0;
  return picture;
}
// The share of the pixels that are black in one and white in the other.
double Unlike(const Image8& a, const Image8& b) {
  int unlike = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) unlike += (a.At(x, y, 0) > 127) != (b.At(x, y, 0) > 127);
  return static_cast<double>(unlike) / (a.width * a.height);
}

TEST(ImportScene, MasksComeAlongAndMoveWithTheirPhotos) {
  const Workspace w;
  w.Distort({60, 32, 24, 0.4});
  WriteImage(w.path / "images/photo11.png", Squares());
  WriteImage(w.path / "masks/photo11.png.png", Squares());
  w.Import();
  const Image8 photo = ReadImage8(w.output / "images/photo11.png"),
               mask = ReadImage8(w.output / "masks/photo11.png.png");
  ASSERT_EQ(mask.width, photo.width);
  ASSERT_EQ(mask.height, photo.height);
  EXPECT_LT(Unlike(photo, mask), 0.08);      // at the squares' edges: one is interpolated
  EXPECT_GT(Unlike(Squares(), mask), 0.12);  // not where it was
  EXPECT_FALSE(fs::exists(w.output / "masks/photo10.png.png"));
  // Where the workspace is used as it is, too.
  const Scene workspace = OpenScene(w.path, {.cache_folder = w.folder / "cache"}, SilentProgress());
  const Image8 same = SceneMasks(workspace).Of(workspace.views[1]);
  ASSERT_EQ(same.width, mask.width);
  EXPECT_EQ(Unlike(same, mask), 0);
  EXPECT_TRUE(SceneMasks(workspace).Of(workspace.views[0]).empty());
  // A scene's own masks are of its photos.
  const Scene scene = OpenScene(w.output, {}, SilentProgress());
  EXPECT_EQ(Unlike(SceneMasks(scene).Of(scene.views[1]), mask), 0);
  ImportScene({w.output, w.folder / "again", false}, SilentProgress());
  EXPECT_EQ(Unlike(ReadImage8(w.folder / "again/masks/photo11.png.png"), mask), 0);
  // Given as the model's folder.
  fs::create_directories(w.folder / "deep");
  fs::rename(w.path / "sparse", w.folder / "deep/0");
  fs::rename(w.folder / "deep", w.path / "sparse");
  ImportScene({w.path / "sparse/0", w.folder / "by-model", false}, SilentProgress());
  EXPECT_EQ(Unlike(ReadImage8(w.folder / "by-model/masks/photo11.png.png"), mask), 0);
  // The user's own stay.
  WriteImage(w.folder / "by-model/masks/photo11.png.png", Image8(64, 48, 3, 200));
  fs::remove(w.path / "masks/photo11.png.png");
  WriteImage(w.path / "masks/photo10.png.png", Squares());
  ImportScene({w.path / "sparse/0", w.folder / "by-model", false}, SilentProgress());
  EXPECT_EQ(ReadImage8(w.folder / "by-model/masks/photo11.png.png").At(0, 0, 0), 200);
  EXPECT_FALSE(fs::exists(w.folder / "by-model/masks/photo10.png.png"));
  // They go with the workspace's.
  w.Import();
  EXPECT_TRUE(w.Import().reused);
  fs::remove_all(w.path / "masks");
  EXPECT_FALSE(w.Import().reused);
  EXPECT_FALSE(fs::exists(w.output / "masks"));
}

TEST(ImportScene, NothingIsLeftWhenAPhotoCannotBeRead) {
  const Workspace w;
  // Distorted photos are read and resampled (others are linked).
  w.Distort();
  // The header, which is looked at first, is whole.
  const fs::path photo = w.path / "images/photo12.png";
  fs::resize_file(photo, fs::file_size(photo) - 20);
  EXPECT_THROW(w.Import(), InputError);
  EXPECT_FALSE(fs::exists(w.output));
}

TEST(ImportScene, CamerasWithoutPointsAreRefusedWithAWayOut) {
  const Workspace w;
  Scene scene = MakeSmallScene(w.path / "images", 5);
  scene.points.clear();
  WriteColmapModel(scene, w.path / "sparse");
  try {
    w.Import();
    FAIL() << "not refused";
  } catch (const DataError& e) {
    EXPECT_NE(e.hint().find("--poses"), std::string::npos) << e.hint();
  }
  EXPECT_FALSE(fs::exists(w.output));
}

}  // namespace
}  // namespace lumi
