#include "pipeline/input_kind.h"

#include <gtest/gtest.h>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

TEST(InputKind, TellsPhotosScenesAndWorkspacesApart) {
  const TemporaryFolder folder;
  const Scene scene = MakeSmallScene(folder / "photos/images", 3);
  EXPECT_EQ(ClassifyInput(folder / "photos"), InputKind::kCapture);
  EXPECT_EQ(ClassifyInput(folder / "photos/images"), InputKind::kCapture);

  WriteColmapModel(scene, folder / "photos/sparse/0");
  EXPECT_EQ(ClassifyInput(folder / "photos"), InputKind::kWorkspace);

  WriteTextAtomically(folder / "photos/lumigraph.json", "{}");
  EXPECT_EQ(ClassifyInput(folder / "photos"), InputKind::kOurScene);

  WriteTextAtomically(folder / "video.mp4", "whatever is in it");
  EXPECT_EQ(ClassifyInput(folder / "video.mp4"), InputKind::kCapture);
  EXPECT_THROW(ClassifyInput(folder / "absent"), UsageError);
}

TEST(InputKind, SeesThroughDotsLinksAndTrailingSlashes) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "a/b");
  fs::create_directory_symlink(folder / "a", folder / "link");
  EXPECT_TRUE(IsWithin(folder / "a/b", folder / "a"));
  EXPECT_TRUE(IsWithin(folder / "a/", folder / "a"));
  EXPECT_TRUE(IsWithin(folder / "a/b/../b", folder / "a/"));
  EXPECT_TRUE(IsWithin(folder / "link/b", folder / "a"));
  EXPECT_TRUE(IsWithin(folder / "a/not-yet-there", folder / "a"));
  EXPECT_FALSE(IsWithin(folder / "a", folder / "a/b"));
  EXPECT_FALSE(IsWithin(folder / "ab", folder / "a"));
}

}  // namespace
}  // namespace lumi
