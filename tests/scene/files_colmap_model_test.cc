#include "scene/files/colmap_model.h"

#include <cstring>
#include <limits>

#include "files_test_util.h"
#include "scene/program/subprocess.h"

namespace lumi::test {
namespace {

constexpr double kNormalised = 1e-15;  // of a unit quaternion that is normalised once more

constexpr CameraModel kAllModels[] = {CameraModel::kSimplePinhole, CameraModel::kPinhole, CameraModel::kSimpleRadial,
                                      CameraModel::kRadial,        CameraModel::kOpenCV,  CameraModel::kOpenCVFisheye};

TEST(ColmapModel, EveryCameraModelComesBackFromBothFormats) {
  for (const CameraModel model : kAllModels)
    for (const ColmapFormat format : {ColmapFormat::kBinary, ColmapFormat::kText}) {
      SCOPED_TRACE(std::string(Name(model)));
      const TempFolder folder;
      const Scene scene = SmallScene(20, model);
      WriteColmapModel(scene, folder / "sparse/0", format);
      EXPECT_EQ(CountFiles(folder / "sparse/0"), 3u);
      ASSERT_EQ(FindColmapModel(folder.path()), folder / "sparse/0");
      ExpectSame(ReadColmapModel(*FindColmapModel(folder.path())), scene, kNormalised);
    }
}

TEST(ColmapModel, WritingInTheOtherFormatReplacesTheModel) {
  const TempFolder folder;
  WriteColmapModel(SmallScene(20), folder.path(), ColmapFormat::kBinary);
  WriteColmapModel(SmallScene(5), folder.path(), ColmapFormat::kText);
  EXPECT_EQ(ReadColmapModel(folder.path()).points.size(), 5u);
  WriteColmapModel(SmallScene(7), folder.path(), ColmapFormat::kBinary);
  EXPECT_EQ(ReadColmapModel(folder.path()).points.size(), 7u);
}

TEST(ColmapModel, PointsMayBeMissing) {
  const TempFolder folder;
  for (const ColmapFormat format : {ColmapFormat::kBinary, ColmapFormat::kText}) {
    WriteColmapModel(SmallScene(20), folder.path(), format);
    fs::remove(folder / (format == ColmapFormat::kBinary ? "points3D.bin" : "points3D.txt"));
    const Scene scene = ReadColmapModel(folder.path());
    EXPECT_EQ(scene.points.size(), 0u);
    EXPECT_EQ(scene.views.size(), 4u);
  }
}

TEST(ColmapModel, ViewsAreSortedByNameWhateverTheirIds) {
  const TempFolder folder;
  Write(folder / "cameras.txt", "# Camera list\n7 SIMPLE_PINHOLE 640 480 500 320 240\n");
  Write(folder / "images.txt",
        "# Image list\r\n9 2 0 0 0 1 2 3 7 a photo with blanks.jpg\r\n1.5 2.5 -1 10 20 4 30 40 -1\r\n"
        "3 1 0 0 0 0 0 0 7 Z.jpg\n\n12 1 0 0 0 0 0 5 7 last.jpg");
  Write(folder / "points3D.txt", "4 1 2 3 10 20 30 -1 9 1\n");
  const Scene scene = ReadColmapModel(folder.path());
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_EQ(scene.views[0].name, "Z.jpg");
  EXPECT_EQ(scene.views[1].name, "a photo with blanks.jpg");
  EXPECT_EQ(scene.views[2].name, "last.jpg");
  EXPECT_DOUBLE_EQ(scene.views[1].cam_from_world.rotation.norm(), 1);
  ASSERT_EQ(scene.points.size(), 1u);
  EXPECT_EQ(scene.points[0].error_px, 0);
  ASSERT_EQ(scene.points[0].track.size(), 1u);
  EXPECT_EQ(scene.points[0].track[0].view, ViewId{1});
  EXPECT_EQ(scene.points[0].track[0].x_px, Eigen::Vector2d(10, 20));
}

struct TextModel {
  std::string cameras = "1 SIMPLE_PINHOLE 640 480 500 320 240\n";
  std::string images = "1 1 0 0 0 0 0 0 1 a.jpg\n10 20 1\n2 1 0 0 0 1 0 0 1 b.jpg\n12 20 1\n";
  std::string points = "1 0 0 5 1 2 3 0.5 1 0 2 0\n";
};

TEST(ColmapModel, BrokenTextIsRefusedWithItsReason) {
  const TempFolder folder;
  const auto write = [&](const TextModel& m) {
    Write(folder / "cameras.txt", m.cameras);
    Write(folder / "images.txt", m.images);
    Write(folder / "points3D.txt", m.points);
  };
  write({});
  EXPECT_EQ(ReadColmapModel(folder.path()).points[0].track.size(), 2u);
  const auto refused = [&](const TextModel& m, const char* reason) {
    write(m);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadColmapModel(folder.path()));
  };
  refused({.cameras = "1 FULL_OPENCV 640 480 500 500 320 240 0 0 0 0 0 0 0 0\n"}, "FULL_OPENCV");
  refused({.cameras = "1 SIMPLE_PINHOLE 640 480 500 320\n"}, "takes 3 parameters, not 2");
  refused({.cameras = "1 SIMPLE_PINHOLE 640 480 nan 320 240\n"}, "finite");
  refused({.cameras = "1 SIMPLE_PINHOLE 0 480 500 320 240\n"}, "0 pixels");
  refused({.cameras = "1 SIMPLE_PINHOLE 640 480 -500 320 240\n"}, "focal length");
  refused({.cameras = TextModel().cameras + TextModel().cameras}, "camera 1 comes twice");
  refused({.images = "1 0 0 0 0 0 0 0 1 a.jpg\n\n"}, "quaternion");
  refused({.images = "1 1 0 0 nan 0 0 0 1 a.jpg\n\n"}, "finite");
  refused({.images = "1 1 0 0 0 0 inf 0 1 a.jpg\n\n"}, "finite");
  refused({.images = "1 1 0 0 0 0 0 0 5 a.jpg\n\n"}, "camera 5");
  refused({.images = "1 1 0 0 0 0 0 0 1\n\n"}, "no name");
  refused({.images = "1 1 0 0 0 0 0 0 1 ../../a.jpg\n\n"}, "leads out");
  refused({.images = "1 1 0 0 0 0 0 0 1 /etc/a.jpg\n\n"}, "leads out");
  refused({.images = "1 1 0 0 0 0 0 0 1 a.jpg\n1 2\n"}, "line 2");
  refused({.images = "1 1 0 0 0 0 0 0 1 a.jpg\nnan 2 1\n"}, "finite");
  refused({.images = "1 1 0 0 0 0 0 0 1 a.jpg\n1 2 99\n"}, "point 99");
  refused({.images = "1 1 0 0 0 0 0 0 1 a.jpg\n\n1 1 0 0 0 0 0 0 1 b.jpg\n\n"}, "image 1 comes twice");
  refused({.images = "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 0 1 a.jpg\n\n"}, "\"a.jpg\" comes twice");
  refused({.images = "# nothing\n"}, "no images");
  refused({.points = "1 0 nan 5 1 2 3 0.5\n"}, "finite");
  refused({.points = "1 0 0 5 1 2 300 0.5\n"}, "colour");
  refused({.points = "1 0 0 5 1 2 3 0.5\n1 0 0 5 1 2 3 0.5\n"}, "point 1 comes twice");
}

template <typename T>
void Patch(const fs::path& file, std::size_t at, T value) {
  std::string bytes = Read(file);
  ASSERT_LE(at + sizeof value, bytes.size());
  std::memcpy(bytes.data() + at, &value, sizeof value);
  Write(file, bytes);
}

TEST(ColmapModel, LyingBinaryCountsAreRefusedBeforeMemoryIsAskedFor) {
  const TempFolder folder;
  const Scene scene = SmallScene(20);
  constexpr std::uint64_t kLies[] = {1000, 1ull << 40, ~0ull, ~0ull / 24 + 2};
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"})
    for (const std::uint64_t lie : kLies) {
      WriteColmapModel(scene, folder.path());
      Patch(folder / name, 0, lie);
      EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadColmapModel(folder.path()));
    }
  for (const std::uint64_t lie : kLies) {
    WriteColmapModel(scene, folder.path());
    Patch(folder / "images.bin", 8 + 4 + 56 + 4 + scene.views[0].name.size() + 1, lie);  // points of the first image
    EXPECT_REFUSED(ExitCode::kCorruptInput, "points of an image", ReadColmapModel(folder.path()));
    WriteColmapModel(scene, folder.path());
    Patch(folder / "points3D.bin", 8 + 8 + 24 + 3 + 8, lie);  // track of the first point
    EXPECT_REFUSED(ExitCode::kCorruptInput, "images of a point", ReadColmapModel(folder.path()));
  }
}

TEST(ColmapModel, BrokenBinaryIsRefusedWithItsReason) {
  const TempFolder folder;
  const auto refused = [&](const char* name, std::size_t at, auto value, const char* reason) {
    WriteColmapModel(SmallScene(20), folder.path());
    Patch(folder / name, at, value);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadColmapModel(folder.path()));
  };
  refused("cameras.bin", 8 + 4, std::int32_t{6}, "FULL_OPENCV");
  refused("cameras.bin", 8 + 4, std::int32_t{-1}, "camera model");
  refused("cameras.bin", 8 + 8, std::uint64_t{1} << 33, "8589934592");
  refused("cameras.bin", 8 + 24, std::numeric_limits<double>::quiet_NaN(), "finite");
  refused("images.bin", 8 + 4, std::numeric_limits<double>::quiet_NaN(), "finite");
  refused("images.bin", 8 + 4 + 56, std::uint32_t{77}, "camera 77");
  refused("points3D.bin", 8 + 8, std::numeric_limits<double>::infinity(), "finite");
  refused("points3D.bin", 8, std::uint64_t{2}, "point 2 comes twice");
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    WriteColmapModel(SmallScene(20), folder.path());
    fs::resize_file(folder / name, fs::file_size(folder / name) - 1);
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadColmapModel(folder.path()));
  }
}

TEST(ColmapModel, ColmapItselfReadsWhatIsWrittenAndItsTextComesBackTheSame) {
  if (!FindProgram("colmap")) GTEST_SKIP() << "colmap is not installed";
  const TempFolder folder;
  Scene scene = SmallScene(50, CameraModel::kOpenCV);
  for (const ColmapFormat format : {ColmapFormat::kBinary, ColmapFormat::kText}) {
    // COLMAP's own text reader ends a name at its first blank; its binary one does not.
    scene.views[0].name = format == ColmapFormat::kText ? "a.jpg" : "a one.jpg";
    WriteColmapModel(scene, folder / "ours", format);
    std::string said;
    SubprocessOptions options;
    options.on_line = [&](const std::string& line) { said += line + "\n"; };
    EXPECT_EQ(RunSubprocess({"colmap", "model_analyzer", "--path", (folder / "ours").string()}, options).exit_code, 0)
        << said;
    EXPECT_NE(said.find("Points: 50"), std::string::npos) << said;
    EXPECT_NE(said.find("Registered images: 4"), std::string::npos) << said;
    const bool to_text = format == ColmapFormat::kBinary;
    fs::create_directories(folder / "theirs");
    EXPECT_EQ(RunSubprocess({"colmap", "model_converter", "--input_path", (folder / "ours").string(), "--output_path",
                             (folder / "theirs").string(), "--output_type", to_text ? "TXT" : "BIN"},
                            options)
                  .exit_code,
              0)
        << said;
    const Scene back = ReadColmapModel(folder / "theirs");
    ASSERT_EQ(back.points.size(), scene.points.size());
    ASSERT_EQ(back.views.size(), scene.views.size());
    constexpr double kColmapTextDigits = 1e-9;  // COLMAP keeps the order of neither points nor tracks, and 17 digits
    for (std::size_t i = 0; i < scene.views.size(); ++i) {
      EXPECT_EQ(back.views[i].name, scene.views[i].name);
      EXPECT_LT((back.views[i].cam_from_world.Matrix() - scene.views[i].cam_from_world.Matrix()).norm(),
                kColmapTextDigits);
    }
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      EXPECT_LT((back.points[i].x_in_world - scene.points[i].x_in_world).norm(), kColmapTextDigits);
      EXPECT_EQ(back.points[i].track.size(), scene.points[i].track.size());
    }
    fs::remove_all(folder / "theirs");
  }
}

TEST(ColmapModel, TheCubesTextModelIsRead) {
  const fs::path cube = SharedData("cube");
  if (!fs::exists(cube)) GTEST_SKIP() << "no " << cube;
  const Scene scene = ReadColmapModel(*FindColmapModel(cube));
  EXPECT_EQ(scene.views.size(), 13u);
  EXPECT_EQ(scene.cameras.at(0).width_px, 1280);
  EXPECT_EQ(scene.cameras.at(0).model, CameraModel::kSimpleRadial);
}

// COLMAP numbers models as it finishes them: sparse/0 may be a scrap.
TEST(ColmapModel, TheLargestOfSeveralIsTaken) {
  for (const ColmapFormat format : {ColmapFormat::kBinary, ColmapFormat::kText}) {
    const TempFolder folder;
    const Scene large = SmallScene(20);
    Scene small = large;
    small.points.clear();
    small.views.resize(1);
    WriteColmapModel(small, folder / "sparse/0", format);
    WriteColmapModel(large, folder / "sparse/2", format);
    WriteColmapModel(small, folder / "sparse/10", format);
    fs::create_directories(folder / "sparse/other");
    const auto models = FindColmapModels(folder.path());
    ASSERT_EQ(models.size(), 3u);
    EXPECT_EQ(models[0].path, folder / "sparse/2");
    EXPECT_EQ(models[0].images, large.views.size());
    EXPECT_EQ(models[1].path, folder / "sparse/0");
    EXPECT_EQ(models[1].images, 1u);
    EXPECT_EQ(models[2].path, folder / "sparse/10");
    EXPECT_EQ(FindColmapModel(folder / "sparse"), folder / "sparse/2");
  }
  const TempFolder empty;
  EXPECT_TRUE(FindColmapModels(empty.path()).empty());
}

}  // namespace
}  // namespace lumi::test
