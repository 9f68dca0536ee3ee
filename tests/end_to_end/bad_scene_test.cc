// Scenes and workspaces that are corrupt, lie about themselves, or come from the future.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <tuple>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/mesh_io.h"
#include "tests/support/bad_input.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

void Overwrite(const fs::path& file, std::streamoff at, const void* bytes, std::size_t size) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(at);
  stream.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
}

std::string ReplaceOnce(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

class BadWorkspace : public testing::Test {
 protected:
  BadWorkspace() : scene_(MakeSmallScene(workspace_ / "images", 5)) { WriteColmapModel(scene_, workspace_ / "sparse"); }
  void ExpectCorrupt(const std::string& file) const {
    const fs::path output = folder_ / "scene";
    ExpectRefusal({{"lumi-pipeline", workspace_.string(), "-o", output.string()}, 3, {file}, output, {workspace_}});
  }
  TemporaryFolder folder_;
  fs::path workspace_ = folder_ / "workspace";
  Scene scene_;
};

TEST_F(BadWorkspace, CountsLargerThanTheFile) {
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteColmapModel(scene_, workspace_ / "sparse");
    for (const std::uint64_t lie :
         {std::uint64_t(1) << 60, std::uint64_t(100000), std::numeric_limits<std::uint64_t>::max()}) {
      Overwrite(workspace_ / "sparse" / file, 0, &lie, sizeof lie);
      ExpectCorrupt(file);
    }
  }
}

TEST_F(BadWorkspace, FilesCutOff) {
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteColmapModel(scene_, workspace_ / "sparse");
    const fs::path path = workspace_ / "sparse" / file;
    fs::resize_file(path, fs::file_size(path) - 5);
    ExpectCorrupt(file);
  }
}

TEST_F(BadWorkspace, IsRefusedByLumiRenderToo) {
  fs::resize_file(workspace_ / "sparse/images.bin", 40);
  ExpectRefusal({{"lumi-render", workspace_.string(), "-o", (folder_ / "out").string()},
                 3,
                 {"images.bin"},
                 folder_ / "out",
                 {workspace_}});
}

TEST_F(BadWorkspace, CamerasThatDoNotFitTheirPhotos) {
  scene_.cameras[0] = scene_.cameras[0].Scaled(128, 96);
  WriteColmapModel(scene_, workspace_ / "sparse");
  const fs::path output = folder_ / "scene";
  ExpectRefusal({{"lumi-pipeline", workspace_.string(), "-o", output.string()},
                 3,
                 {"photo10.png", "--rescale-cameras"},
                 output,
                 {workspace_}});
}

TEST_F(BadWorkspace, APhotoThatIsMissing) {
  fs::remove(workspace_ / "images/photo12.png");
  ExpectCorrupt("photo12.png");
}

TEST_F(BadWorkspace, ReconstructionOptionsForAWorkspaceAreRefused) {
  const fs::path output = folder_ / "scene";
  ExpectRefusal({{"lumi-pipeline", workspace_.string(), "-o", output.string(), "--backend", "colmap"},
                 2,
                 {"--backend"},
                 output,
                 {workspace_}});
}

class BadScene : public testing::Test {
 protected:
  BadScene() {
    Scene scene = MakeSmallScene(path_ / "images", 5);
    scene.active_proxy = "wall";
    WriteScene(scene, path_);
    wall_.vertices = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
    wall_.faces = {{0, 1, 2}, {0, 2, 3}};
    WriteMesh(path_ / "proxies/wall.ply", wall_);
  }
  void ExpectRenderRefuses(const std::string& name) const {
    const fs::path output = folder_ / "out";
    ExpectRefusal({{"lumi-render", path_.string(), "-o", output.string()}, 3, {name}, output, {path_}});
  }
  TemporaryFolder folder_;
  fs::path path_ = folder_ / "scene";
  Mesh wall_;
};

TEST_F(BadScene, AManifestOfANewerVersion) {
  const fs::path manifest = path_ / "lumigraph.json";
  WriteTextAtomically(manifest, ReplaceOnce(ReadText(manifest), "\"version\": 1", "\"version\": 2"));
  ExpectRenderRefuses("lumigraph.json");
  ExpectRefusal({{"lumi-pipeline", path_.string()}, 3, {"lumigraph.json", "version"}, path_, {}});
  ExpectRefusal({{"lumi-pipeline", path_.string(), "-o", (folder_ / "copy").string()},
                 3,
                 {"lumigraph.json"},
                 folder_ / "copy",
                 {path_}});
  ExpectRefusal({{"lumi-proxy", "plane", path_.string()}, 3, {"lumigraph.json"}, path_, {}});
}

TEST_F(BadScene, AManifestThatIsNoJson) {
  const fs::path manifest = path_ / "lumigraph.json";
  fs::resize_file(manifest, fs::file_size(manifest) / 2);
  ExpectRenderRefuses("lumigraph.json");
  ExpectRefusal({{"lumi-pipeline", path_.string()}, 3, {"lumigraph.json"}, path_, {}});
}

TEST_F(BadScene, AMeshWithNaN) {
  WriteTextAtomically(
      path_ / "proxies/wall.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\nnan 1 0\n1 0 0\n3 0 1 2\n");
  ExpectRenderRefuses("wall.ply");
}

TEST_F(BadScene, AMeshWithIndicesOutOfRange) {
  for (const char* face : {"3 0 1 3", "3 0 1 -1", "3 0 1 2147483647"}) {
    WriteTextAtomically(
        path_ / "proxies/wall.ply",
        std::string("ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
                    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n0 1 0\n1 0 0\n") +
            face + "\n");
    ExpectRenderRefuses("wall.ply");
  }
}

TEST_F(BadScene, AMeshThatClaimsMoreThanItsFileHolds) {
  WriteTextAtomically(path_ / "proxies/wall.ply",
                      "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty double x\nproperty "
                      "double y\nproperty double z\n"
                      "element face 1\nproperty list uchar int vertex_indices\nend_header\n");
  ExpectRenderRefuses("wall.ply");
}

TEST_F(BadScene, APhotoCutOff) {
  const fs::path photo = path_ / "images/photo12.png";
  fs::resize_file(photo, fs::file_size(photo) - 20);
  ExpectRenderRefuses("photo12.png");
}

TEST_F(BadScene, AProxyThatIsNotThere) {
  const fs::path output = folder_ / "out";
  ExpectRefusal({{"lumi-render", path_.string(), "-o", output.string(), "--proxy", "hull"},
                 2,
                 {"hull", "wall"},
                 output,
                 {path_}});
}

TEST_F(BadScene, OptionsThatCannotBeAreRefusedBeforeAnythingIsRead) {
  const fs::path output = folder_ / "out";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--k", "0"}, "--k"},
      {{"--k", "17"}, "--k"},
      {{"--budget-ms", "-5"}, "--budget-ms"},
      {{"--resolution", "sharpness"}, "--resolution"},
      {{"--grid", "1"}, "--grid"},
      {{"--grid", "25"}, "--grid"},
      {{"--grid", "8x1"}, "--grid"},
      {{"--width", "0"}, "--width"},
      {{"--width", "32769"}, "--width"},
      {{"--height", "-1"}, "--height"},
      {{"--alpha", "-1"}, "--alpha"},
      {{"--alpha", "1e300"}, "--alpha"},
      {{"--r-min-deg", "6"}, "--r-min-deg"},
      {{"--effects", "fov,shine"}, "shine"},
      {{"--similarity", "full", "--correlation", "inverse"}, "--correlation"},
      {{"--similarity", "full", "--grid", "8x8", "--sampling", "candidates"}, "--sampling"},
      {{"--backend", "gl", "--similarity", "full"}, "--backend cpu"},
      {{"--backend", "gl", "--similarity", "full", "--grid", "pixel"}, "--grid"},
      {{"--phase", "0.5"}, "--phase"},
      {{"--show", "x-ray"}, "--show"},
      {{"--show", "cameras"}, "--view"},
      {{"--of", "photo00.png"}, "--of"},
      {{"--phase", "0.5", "--time-s", "1"}, "--time-s"},
      {{"--grid", "25x25", "--k", "all"}, "--sampling interpolated"},
      {{"--show", "tessellation"}, "--grid"},
      {{"--show", "tessellation", "--k", "all", "--grid", "8x8"}, "--sampling"},
      {{"--holdout", "1"}, "--holdout"},
      {{"--holdout", "every"}, "--holdout"},
      {{"--holdout", "each", "--fold", "choose"}, "--fold"},
      {{"--holdout", "4", "--seen-proxy", "nowhere"}, "nowhere"},
      {{"--view", "photo10", "--seen-proxy", "plane"}, "--seen-proxy"},
      {{"--holdout", "4", "--height", "24"}, "--height"},
      {{"--holdout", "4", "--format", "png"}, "--format"},
      {{"--holdout", "4", "--video"}, "--video"},
      {{"--holdout", "4", "--seconds", "2"}, "--seconds"},
      {{"--view", "photo10", "--fold", "report"}, "--fold"},
      {{"--view", "photo10", "--video"}, "--video"},
      {{"--view", "photo10", "--fps", "25"}, "--fps"},
      {{"--view", "photo10", "--show", "difference", "--format", "exr"}, "--format"}};
  for (const auto& [options, named] : cases) {
    std::vector<std::string> argv = {"lumi-render", path_.string(), "-o", output.string()};
    argv.insert(argv.end(), options.begin(), options.end());
    // The scene has no period: that is the data's, not the line's.
    ExpectRefusal({argv, named == "--phase" ? 1 : 2, {named}, output, {path_}});
  }
}

TEST_F(BadScene, ASettingsFileIsHeldToWhatTheLineIsHeldTo) {
  const fs::path output = folder_ / "out", file = folder_ / "settings.json";
  const std::vector<std::tuple<std::string, int, std::string>> cases = {
      {"{\"backend\": \"foo\"}", 3, "foo"},
      {"{\"backend\": 1}", 3, "settings.json"},
      {"{\"resolution\": 1}", 3, "--resolution"},
      {"{\"similarity\": \"full\", \"correlation\": \"inverse\"}", 2, "--correlation"},
      {"{\"similarity\": \"full\", \"grid\": \"8x8\", \"sampling\": \"candidates\"}", 2, "--sampling"},
      {"{\"k\": \"all\", \"grid\": \"8x8\"}", 2, "--sampling"}};
  for (const auto& [text, exit_code, named] : cases) {
    WriteTextAtomically(file, text);
    ExpectRefusal({{"lumi-render", path_.string(), "-o", output.string(), "--settings", file.string()},
                   exit_code,
                   {named},
                   output,
                   {path_}});
  }
  // A summary's settings say everything; the line's --similarity full is said of all of it.
  WriteTextAtomically(file, "{\"similarity\": \"identity\", \"correlation\": \"inverse\"}");
  const ProgramResult done = RunProgram({"lumi-render", path_.string(), "-o", output.string(), "--settings",
                                         file.string(), "--similarity", "full", "--view", "photo12", "--width", "16"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

// Whether the output is missing, or is somebody's folder, is the second question.
TEST_F(BadScene, MeasuringCommandsLookAtTheirOptionsBeforeTheirOutput) {
  const fs::path output = folder_ / "photos";
  WriteTextAtomically(output / "holiday.txt", "not ours");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--width", "0"}, "--width"},
      {{"--reference-width", "0"}, "--reference-width"},
      {{"--views", "0"}, "--views"},
      {{"--repeats", "0"}, "--repeats"},
      {{"--holdout", "1"}, "--holdout"},
      {{"--budget-ms", "5"}, "--budget-ms"},
      {{"--phase", "0.5"}, "--phase"},
      {{"--k", "0"}, "--k"},
      {{"--grid", "25"}, "--grid"},
      {{"--alpha", "-1"}, "--alpha"},
      {{"--effects", "shine"}, "shine"},
      {{"--proxy", "wall", "--proxy", "wall"}, "--proxy"},
      {{"--ablation", "--properties"}, "--ablation"},
      {{}, "holiday.txt"}};
  for (const auto& [options, named] : cases) {
    std::vector<std::string> argv = {"lumi-render", "tradeoff", path_.string(), "-o", output.string()};
    argv.insert(argv.end(), options.begin(), options.end());
    ExpectRefusal({argv, 2, {named}, {}, {path_, output}});
  }
  ExpectRefusal({{"lumi-render", "tradeoff", path_.string(), "--views", "0"}, 2, {"--views"}, {}, {path_}});
  ExpectRefusal(
      {{"lumi-render", "tradeoff", path_.string(), "--ablation", "--views", "0"}, 2, {"--views"}, {}, {path_}});
  ExpectRefusal({{"lumi-render", "tradeoff", path_.string()}, 2, {"-o"}, {}, {path_}});
  ExpectRefusal({{"lumi-render", path_.string(), "--alpha", "-1"}, 2, {"--alpha"}, {}, {path_}});
  ExpectRefusal({{"lumi-render", path_.string()}, 2, {"-o"}, {}, {path_}});
}

}  // namespace
}  // namespace lumi
