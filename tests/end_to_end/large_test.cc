// Inputs far larger than usual: refused, or done, within memory that is known before (docs/large.md).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iostream>
#include <memory>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Large : public testing::Test {
 protected:
  static void SetUpTestSuite() { capture_ = std::make_unique<SimulatedCapture>("desk", 4, 96); }
  static void TearDownTestSuite() { capture_.reset(); }
  static fs::path Scene() { return capture_->path(); }

  // With so many kilobytes of memory to be had: as `ulimit -v` has it.
  static ProgramResult RunWithin(std::uint64_t kilobytes, std::vector<std::string> argv) {
    argv[0] = (fs::path(LUMI_BIN_DIR) / argv[0]).string();
    argv.insert(argv.begin(), {"/bin/sh", "-c", "ulimit -v " + std::to_string(kilobytes) + " && exec \"$0\" \"$@\""});
    return RunProgram(argv);
  }
  // Reads every frame: some hundred a second, and fewer on a busy machine.
  static ProgramResult RunForHours(const std::vector<std::string>& argv) {
    constexpr double kLimitS = 4 * 3600;
    return ChildProgram(argv).Wait(kLimitS);
  }
  static void Print(const std::string& what, const ProgramResult& run) {
    std::cout << what << ": " << run.peak_memory_mb << " MB, " << run.seconds << " s\n";
  }

  static std::unique_ptr<SimulatedCapture> capture_;
  TemporaryFolder folder_;
};
std::unique_ptr<SimulatedCapture> Large::capture_;

// Vertices of 12 bytes, triangles of 13; the file is as long as they say, and holds nothing but zeros.
void WriteEmptyPly(const fs::path& file, std::uint64_t vertices, std::uint64_t faces) {
  std::ofstream(file, std::ios::binary) << "ply\nformat binary_little_endian 1.0\nelement vertex " << vertices
                                        << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
                                        << faces << "\nproperty list uchar int vertex_indices\nend_header\n";
  fs::resize_file(file, fs::file_size(file) + 12 * vertices + 13 * faces);
}

TEST_F(Large, AMeshOfFourGigabytesThatDoesNotFitIsRefusedBeforeItIsRead) {
  const fs::path mesh = folder_ / "large.ply";
  WriteEmptyPly(mesh, 100'000'000, 220'000'000);
  EXPECT_GT(fs::file_size(mesh), 4'000'000'000U);
  const std::vector<std::vector<std::string>> programs{
      {"lumi-proxy", "import", mesh, Scene()},
      {"lumi-render", Scene(), "-o", folder_ / "out", "--proxy", mesh, "--view", "0"}};
  for (const std::vector<std::string>& argv : programs) {
    const ProgramResult run = RunWithin(4'000'000, argv);
    Print("4 GB PLY, refused by " + argv[0], run);
    EXPECT_EQ(run.exit_code, 4) << run.err;
    EXPECT_THAT(run.err, HasSubstr("large.ply"));
    EXPECT_THAT(run.err, HasSubstr("GB of memory"));
    EXPECT_LT(run.peak_memory_mb, 400);
  }
}

TEST_F(Large, PhotosOfSixtyMegapixelsTakeTheMemoryThatIsSaid) {
  // A workspace whose photos are 9504 x 7128 pixels.
  constexpr int kScale = 99;
  const fs::path workspace = folder_ / "workspace";
  lumi::Scene scene = OpenScene(Scene(), {}, SilentProgress());
  for (Camera& camera : scene.cameras) camera = camera.Scaled(kScale * camera.width_px, kScale * camera.height_px);
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.x_px *= kScale;
  const int width = scene.cameras[0].width_px, height = scene.cameras[0].height_px;
  ASSERT_GT(static_cast<double>(width) * height, 60e6);
  for (const View& view : scene.views)
    WriteImage(workspace / "images" / view.name, Resize(ReadImage8(scene.ImagePath(view)), width, height));
  WriteColmapModel(scene, workspace / "sparse");
  constexpr int kThreads = 2;
  // docs/large.md: 9 bytes a pixel a thread, four photos as they are drawn, and 600 MB beside.
  const double photo_mb = static_cast<double>(width) * height / 1e6;
  const ProgramResult made =
      RunProgram({"lumi-pipeline", workspace, "-o", folder_ / "scene", "--proxy", "plane", "--holdout", "0",
                  "--no-video", "--no-web", "--threads", std::to_string(kThreads)});
  Print("4 photos of 68 megapixels, a scene", made);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LT(made.peak_memory_mb, 600 + 9 * photo_mb * kThreads);
  const ProgramResult drawn =
      RunProgram({"lumi-render", folder_ / "scene", "-o", folder_ / "out", "--view", "0", "--width", "640"});
  Print("4 photos of 68 megapixels, a picture", drawn);
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_LT(drawn.peak_memory_mb, 600 + 9 * photo_mb * kThreads + 4 * 5.4 * photo_mb);
  // A page holds the photos twice; where they do not fit, halved.
  const std::vector<std::string> page{"lumi-export",         "web",       folder_ / "scene",       "-o",
                                      folder_ / "page.html", "--threads", std::to_string(kThreads)};
  const ProgramResult whole = RunProgram(page);
  Print("4 photos of 68 megapixels, a page", whole);
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_LT(whole.peak_memory_mb, 600 + 9 * photo_mb * kThreads + 2 * 4 * 5.4 * photo_mb);
  fs::remove(folder_ / "page.html");
  const ProgramResult halved = RunWithin(4'000'000, page);
  Print("4 photos of 68 megapixels, a page within 4 GB of addresses", halved);
  ASSERT_EQ(halved.exit_code, 0) << halved.err;
  EXPECT_THAT(halved.err, HasSubstr("they are halved"));
  EXPECT_LT(halved.peak_memory_mb, whole.peak_memory_mb);
  EXPECT_TRUE(fs::exists(folder_ / "page.html"));
}

TEST_F(Large, AHundredThousandPhotosAreListedInLittleMemory) {
  const fs::path photos = folder_ / "photos";
  const auto name = [&](int i) { return photos / (std::to_string(1'000'000 + i).substr(1) + ".png"); };
  constexpr int kLinks = 50'000;  // to one file; ext4 allows 65,000
  for (int i = 0; i < 100'000; ++i)
    if (i % kLinks == 0)
      WriteImage(name(i), Image8(16, 12, 3, 90));
    else
      fs::create_hard_link(name(i - i % kLinks), name(i));
  const ProgramResult boards =
      RunProgram({"lumi-calibrate", photos, "--board", "9x6", "-o", folder_ / "camera.yaml", "--quiet"});
  Print("100,000 photos, calibrate", boards);
  EXPECT_EQ(boards.exit_code, 1) << boards.err;
  EXPECT_THAT(boards.err, HasSubstr("100000 photos"));
  EXPECT_LT(boards.peak_memory_mb, 500);
}

TEST_F(Large, AFilmOfTwoHoursIsRefusedOrReadFrameByFrame) {
  if (!FindProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  const fs::path film = folder_ / "film.mp4";
  const SubprocessResult written =
      RunSubprocess({"ffmpeg", "-v", "error", "-f", "lavfi", "-i", "testsrc=size=96x64:rate=30", "-t", "7200", "-c:v",
                     "libx264", "-preset", "ultrafast", "-pix_fmt", "yuv420p", film.string()});
  ASSERT_EQ(written.exit_code, 0) << written.out;
  const ProgramResult period = RunProgram({"lumi-timeperiodic", "period", film});
  Print("two hours, period", period);
  EXPECT_EQ(period.exit_code, 1) << period.err;
  EXPECT_THAT(period.err, HasSubstr("more than 100000 frames"));
  EXPECT_LT(period.peak_memory_mb, 300) << "before a frame is decoded";
  const ProgramResult score = RunForHours({"lumi-stabilize", "score", film, "--quiet"});
  Print("two hours, score", score);
  EXPECT_EQ(score.exit_code, 0) << score.err;
  EXPECT_LT(score.peak_memory_mb, 500);
  const ProgramResult boards =
      RunForHours({"lumi-calibrate", film, "--board", "9x6", "-o", folder_ / "camera.yaml", "--quiet"});
  Print("two hours, calibrate", boards);
  EXPECT_EQ(boards.exit_code, 1) << boards.err;
  EXPECT_LT(boards.peak_memory_mb, 500);
}

}  // namespace
}  // namespace lumi
