// Places that nothing can, or may, be written to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/mesh_io.h"
#include "tests/support/bad_input.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

class BadOutput : public testing::Test {
 protected:
  BadOutput() {
    Scene scene = MakeSmallScene(workspace_ / "images", 5);
    WriteColmapModel(scene, workspace_ / "sparse");
  }
  Refusal Run(const fs::path& output, int exit_code, std::vector<std::string> names) const {
    return {{"lumi-pipeline", workspace_.string(), "-o", output.string()},
            exit_code,
            std::move(names),
            output,
            {workspace_}};
  }
  TemporaryFolder folder_;
  fs::path workspace_ = folder_ / "workspace";
};

TEST_F(BadOutput, APlaceWhereNobodyCanWrite) {
  ExpectRefusal(Run("/proc/lumi-scene", 4, {"/proc/lumi-scene"}));
  Refusal photos = Run("/proc/lumi-scene", 4, {"/proc/lumi-scene"});
  photos.argv[1] = (workspace_ / "images").string();
  ExpectRefusal(photos);
}

TEST_F(BadOutput, AFileInTheWay) {
  WriteTextAtomically(folder_ / "scene", "a file");
  ExpectRefusal(Run(folder_ / "scene", 2, {(folder_ / "scene").string()}));
}

TEST_F(BadOutput, SomebodyElsesFolder) {
  WriteTextAtomically(folder_ / "scene/thesis.txt", "years of work");
  ExpectRefusal(Run(folder_ / "scene", 2, {(folder_ / "scene").string(), "thesis.txt"}));
  Refusal photos = Run(folder_ / "scene", 2, {(folder_ / "scene").string(), "thesis.txt"});
  photos.argv[1] = (workspace_ / "images").string();
  ExpectRefusal(photos);
}

TEST_F(BadOutput, PhotosInsideTheOutputOrTheOutputInsideThePhotos) {
  const fs::path photos = workspace_ / "images";
  Refusal refusal = Run(workspace_, 2, {photos.string(), "inside"});
  refusal.argv[1] = photos.string();
  ExpectRefusal(refusal);
  refusal = Run(photos / "scene", 2, {photos.string(), "inside"});
  refusal.argv[1] = photos.string();
  ExpectRefusal(refusal);
  ExpectRefusal(Run(workspace_, 2, {workspace_.string()}));
}

TEST_F(BadOutput, AnotherScenesFolder) {
  const fs::path other = folder_ / "other";
  WriteScene(MakeSmallScene(other / "images", 3), other);
  ExpectRefusal(Run(other, 2, {other.string()}));
}

TEST_F(BadOutput, ASceneThatAnotherProcessIsWriting) {
  const fs::path scene = folder_ / "scene";
  WriteScene(MakeSmallScene(scene / "images", 3), scene);
  const FolderLock lock(scene);
  ExpectRefusal({{"lumi-pipeline", scene.string()}, 4, {scene.string(), std::to_string(::getpid())}, scene, {}});
}

// A file system of one megabyte, gone with the object.
class SmallDisk {
 public:
  explicit SmallDisk(fs::path path) : path_(std::move(path)) {
    fs::create_directories(path_);
    mounted_ = ::mount("none", path_.c_str(), "tmpfs", 0, "size=1m") == 0;
    if (!mounted_) why_ = std::strerror(errno);
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }
  const std::string& why() const { return why_; }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool mounted_ = false;
  std::string why_;
};

Image8 Noise(int width, int height, unsigned seed) {
  Image8 image(width, height, 3);
  for (auto& value : image.data) value = static_cast<std::uint8_t>((seed = seed * 1664525U + 1013904223U) >> 24);
  return image;
}

TEST_F(BadOutput, AFullDiskWhileAWorkspaceIsImported) {
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "a small file system cannot be mounted here: " << disk.why();
  // Distorted photos, resampled to more than fits.
  Scene scene = MakeSmallScene(workspace_ / "images", 5);
  scene.cameras[0] = scene.cameras[0].Scaled(640, 480);
  scene.cameras[0].model = CameraModel::kSimpleRadial;
  scene.cameras[0].params = {600, 320, 240, 0.05};
  for (const View& view : scene.views) WriteImage(scene.ImagePath(view), Noise(640, 480, 7));
  WriteColmapModel(scene, workspace_ / "sparse");
  ExpectRefusal(Run(disk.path() / "scene", 4, {(disk.path() / "scene").string()}));
}

TEST_F(BadOutput, AFullDiskWhilePhotosAreReconstructed) {
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "a small file system cannot be mounted here: " << disk.why();
  const fs::path photos = folder_ / "photos", scene = disk.path() / "scene";
  for (unsigned i = 0; i < 6; ++i) WriteImage(photos / ("p" + std::to_string(i) + ".jpg"), Noise(640, 480, i));
  Refusal refusal{{"lumi-pipeline", photos.string(), "-o", scene.string()}, 4, {}, {}, {photos}};
  ExpectRefusal(refusal);
  EXPECT_FALSE(fs::exists(scene / "lumigraph.json"));
}

TEST_F(BadOutput, AFullDiskWhileFramesAreRendered) {
  const SmallDisk disk(folder_ / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "a small file system cannot be mounted here: " << disk.why();
  const fs::path scene = folder_ / "scene";
  Scene s = MakeSmallScene(scene / "images", 3);
  for (const View& view : s.views) WriteImage(s.ImagePath(view), Noise(64, 48, 3));
  Mesh wall;
  wall.vertices = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
  wall.faces = {{0, 1, 2}, {0, 2, 3}};
  s.active_proxy = "plane";
  WriteScene(s, scene);
  WriteMesh(ProxyPath(scene, "plane"), wall);
  const fs::path frames = disk.path() / "frames";
  ExpectRefusal({{"lumi-render", scene.string(), "-o", frames.string(), "--width", "500", "--seconds", "1"},
                 4,
                 {disk.path().string()},
                 {},
                 {scene}});
  // What is there is whole.
  for (const auto& entry : fs::recursive_directory_iterator(disk.path()))
    if (entry.path().extension() == ".png") {
      EXPECT_NO_THROW(ReadImage8(entry.path())) << entry.path();
    }
}

}  // namespace
}  // namespace lumi
