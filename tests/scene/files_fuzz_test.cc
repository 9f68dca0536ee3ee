// Readers against files that are almost right: bits flipped, cut short, numbers replaced by others, pieces doubled. A
// reader may accept or refuse (an Error with its reason); it may not crash, hang or ask for memory by a count that
// lies.
#include <sys/resource.h>

#include <cstring>
#include <functional>

#include "files_test_util.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/colmap_model.h"
#include "scene/files/mesh_io.h"
#include "scene/files/projective_json.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/files/transforms_json.h"

namespace lumi::test {
namespace {

constexpr int kMutations = 2000;  // a file

std::string Mutated(const std::string& original, std::mt19937& random) {
  std::string bytes = original;
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1)); };
  const int changes = 1 + static_cast<int>(below(3));
  for (int i = 0; i < changes && !bytes.empty(); ++i) switch (below(7)) {
      case 0: bytes[below(bytes.size())] ^= static_cast<char>(1 << below(8)); break;
      case 1: bytes[below(bytes.size())] = static_cast<char>(random()); break;
      case 2: bytes.resize(below(bytes.size())); break;
      case 3: {  // eight bytes of a count or number that lies
        constexpr std::uint64_t kLies[] = {~0ull,         1ull << 63,    1ull << 40, 0x7FF8000000000000ull,
                                           0xFFFFFFFFull, 0x7FFFFFFFull, 0};
        const std::uint64_t lie = kLies[below(std::size(kLies))];
        if (bytes.size() >= 8) std::memcpy(bytes.data() + below(bytes.size() - 7), &lie, 8);
        break;
      }
      case 4: {  // a number in the text
        const std::size_t digit = bytes.find_first_of("0123456789", below(bytes.size()));
        constexpr const char* kNumbers[] = {
            "-1", "99999999999999999999", "1e308", "nan", "-inf", "4294967296", "0", "1e-320", "\"", "]"};
        if (digit != std::string::npos) bytes.replace(digit, 1, kNumbers[below(std::size(kNumbers))]);
        break;
      }
      case 5: bytes.insert(below(bytes.size()), bytes.substr(below(bytes.size()), below(64))); break;
      case 6: bytes.erase(below(bytes.size()), below(64)); break;
    }
  return bytes;
}

long PeakKilobytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

void Fuzz(const fs::path& file, const std::function<void()>& read, int mutations = kMutations) {
  const std::string original = Read(file);
  ASSERT_NO_THROW(read()) << "the file is right before it is changed";
  const long before = PeakKilobytes();
  std::mt19937 random(20020701);
  int refused = 0;
  for (int i = 0; i < mutations; ++i) {
    Write(file, Mutated(original, random));
    try {
      read();
    } catch (const Error& e) {
      ++refused;
      ASSERT_TRUE(e.code() == ExitCode::kCorruptInput || e.code() == ExitCode::kDataRefused ||
                  e.code() == ExitCode::kUsage)
          << e.what();
      ASSERT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    } catch (const std::exception& e) {
      Write(fs::temp_directory_path() / "lumi-fuzz-failure", Read(file));
      FAIL() << "mutation " << i << " of " << file << ": " << e.what();
    }
  }
  Write(file, original);
  EXPECT_GT(refused, mutations / 50) << "the changes are too mild to test anything";
#if !defined(__SANITIZE_ADDRESS__)  // keeps what is freed
  constexpr long kAllowedKilobytes =
      64 << 10;  // the files are a few kilobytes; a picture may decode to 16 million pixels
  EXPECT_LT(PeakKilobytes() - before, kAllowedKilobytes);
#else
  static_cast<void>(before);
#endif
}

TEST(Fuzz, ColmapBinary) {
  const TempFolder folder;
  WriteColmapModel(SmallScene(6, CameraModel::kOpenCV), folder.path());
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"})
    Fuzz(folder / name, [&] { ReadColmapModel(folder.path()); });
}

TEST(Fuzz, ColmapText) {
  const TempFolder folder;
  WriteColmapModel(SmallScene(6, CameraModel::kOpenCV), folder.path(), ColmapFormat::kText);
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"})
    Fuzz(folder / name, [&] { ReadColmapModel(folder.path()); });
}

Mesh SmallMesh() {
  Mesh mesh;
  for (int i = 0; i < 12; ++i) {
    mesh.vertices.emplace_back(std::cos(i), std::sin(i), 0.1 * i);
    mesh.colors.push_back({1, 2, 3});
    if (i >= 2) mesh.faces.push_back({i - 2, i - 1, i});
  }
  return mesh;
}

TEST(Fuzz, Meshes) {
  const TempFolder folder;
  for (const char* name : {"a.ply", "a.obj"}) {
    WriteMesh(folder / name, SmallMesh());
    Fuzz(folder / name, [&] { ReadMesh(folder / name); });
  }
  Write(folder / "ascii.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty list "
        "uchar float w\nelement face 2\n"
        "property list uchar int vertex_indices\nelement edge 1\nproperty int v\nend_header\n0 0 0 1 5\n1 0 0 0\n1 1 0 "
        "0\n0 1 0 2 1 2\n4 0 1 2 3\n3 0 1 3\n7\n");
  Fuzz(folder / "ascii.ply", [&] { ReadMesh(folder / "ascii.ply"); });
}

TEST(Fuzz, Manifest) {
  const TempFolder folder;
  Scene scene = SmallScene(3);
  scene.image_folder = folder / "images";
  for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
  scene.views[0].time_s = 0.5;
  scene.views[0].frame_index = 3;
  scene.period_s = 1.5;
  WriteScene(scene, folder.path());
  OpenOptions options;
  options.check_photos = false;
  Fuzz(folder / "lumigraph.json", [&] { OpenScene(folder.path(), options, SilentProgress()); });
}

TEST(Fuzz, ProjectiveJson) {
  const TempFolder folder;
  Scene scene = SmallScene(6);
  scene.frame = Frame::kQuasiAffine;
  scene.plane_at_infinity = Eigen::Vector4d(0, 0, 0, 1);
  for (View& v : scene.views) {
    v.P = ProjectionMatrix(scene.CameraOf(v).K(), v.cam_from_world);
    v.size_px = {64, 48};
  }
  for (Point& p : scene.points) p.X_in_world = p.x_in_world.homogeneous();
  WriteProjectiveJson(scene, folder / "p.json");
  Fuzz(folder / "p.json", [&] { ReadProjectiveJson(folder / "p.json"); });
}

TEST(Fuzz, TransformsJson) {
  const TempFolder folder;
  Scene scene = SmallScene(0, CameraModel::kOpenCV);
  scene.image_folder = folder / "images";
  for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
  WriteTransformsJson(scene, folder / "transforms.json");
  Fuzz(folder / "transforms.json", [&] { ReadTransformsJson(folder / "transforms.json"); });
}

TEST(Fuzz, CameraYaml) {
  const TempFolder folder;
  WriteCameraYaml(SmallScene(0, CameraModel::kOpenCV).cameras[1], folder / "c.yaml");
  Fuzz(folder / "c.yaml", [&] { ReadCameraYaml(folder / "c.yaml"); });
}

TEST(Fuzz, TakenPhotos) {
  const TempFolder folder;
  const Scene lens = SmallScene(0, CameraModel::kOpenCV);
  std::vector<TakenPhoto> photos;
  for (const View& v : lens.views)
    photos.push_back({v.name, v.name + ".heic", lens.CameraOf(v), Camera::Pinhole(64, 48, 50, 50, 32, 24)});
  WriteTakenPhotos(photos, folder.path());
  Fuzz(folder / ".taken.json", [&] { ReadTakenPhotos(folder.path()); });
}

TEST(Fuzz, Pictures) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg"}) {
    WriteImage(folder / name, ColorfulImage(24, 16));
    Fuzz(
        folder / name, [&] { ReadImage8(folder / name); }, kMutations / 4);
  }
}

}  // namespace
}  // namespace lumi::test
