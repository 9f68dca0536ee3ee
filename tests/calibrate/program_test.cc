// lumi-calibrate as its user runs it: photos and video in, files and JSON out, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "tests/calibrate/rendered_boards.h"
#include "tests/support/bad_input.h"
#include "tests/support/child_program.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

Intrinsics SquareLens() {
  Intrinsics k = NominalIntrinsics(600, kWidthPx, kHeightPx);
  k[kCx] = 333;
  k[kK1] = -0.22;
  k[kK2] = 0.06;
  return k;
}

// Seven boards, one photo without a board and one of another size, rendered once.
const fs::path& Photos() {
  static const TemporaryFolder folder;
  static const fs::path photos = [] {
    const BoardRenderer renderer(SquareLens());
    const std::vector<TruePose> poses = GoodPoses();
    ParallelFor(7, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        TruePose p = poses[i];
        p.distance_mm *= 1.15;
        WriteImage(folder / "photos" / ("photo" + std::to_string(i) + ".png"),
                   renderer(PoseOf(p, SquareLens()), kBoard, 4, static_cast<unsigned>(i)));
      }
    });
    WriteImage(folder / "photos" / "empty.png", Image8(kWidthPx, kHeightPx, 3, 90));
    WriteImage(folder / "photos" / "small.png", Image8(60, 40, 3, 90));
    return folder / "photos";
  }();
  return photos;
}

TEST(Program, WritesCameraReportUndistortedPhotosAndSummary) {
  const TemporaryFolder out;
  const ProgramResult run = RunProgram({"lumi-calibrate", Photos(), "--board", "9x6", "--square-mm", "25", "-o",
                                        out / "camera.yaml", "--undistort", out / "plain", "--tradeoff", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["schema"], "lumi-calibrate");
  EXPECT_EQ(j["views_used"], 7);
  EXPECT_EQ(j["views_refused"].size(), 2U);
  for (const json& refused : j["views_refused"]) EXPECT_FALSE(refused["reason"].get<std::string>().empty());
  EXPECT_NEAR(j["fx"], 600, 3 * j["sigma_fx"].get<double>());
  EXPECT_NEAR(j["cx"], 333, 3 * j["sigma_cx"].get<double>());
  EXPECT_LT(j["rms_px"], j["cross_validated_rms_px"]);
  EXPECT_EQ(j["models"].size(), 18U);
  EXPECT_GE(j["tradeoff"].size(), 3U);
  const Camera camera = ReadCameraYaml(out / "camera.yaml");
  EXPECT_NEAR(camera.FocalPx().x(), j["fx"], 1e-6);
  EXPECT_NEAR(camera.PrincipalPointPx().x(), j["cx"], 1e-6);
  EXPECT_THAT(j["colmap_params"].get<std::string>(), HasSubstr(","));
  const std::string report = ReadText(out / "report.html");
  EXPECT_THAT(report, HasSubstr("</html>"));
  EXPECT_THAT(report, HasSubstr("<svg"));
  EXPECT_THAT(report, testing::Not(HasSubstr("src=")));
  EXPECT_TRUE(fs::exists(out / "camera.tradeoff.json") && fs::exists(out / "camera.tradeoff.svg"));
  EXPECT_EQ(j["undistorted"], 8);
  EXPECT_TRUE(ReadCameraYaml(out / "plain/camera.yaml").IsPinhole());
  EXPECT_EQ(ReadImageInfo(out / "plain/photo3.png").width, kWidthPx);
}

TEST(Program, PicksFramesOfAVideo) {
  const TemporaryFolder out;
  {
    VideoWriter video(out / "boards.mp4", 10);
    for (int i = 0; i < 7; ++i) {
      const Image8 photo = ReadImage8(Photos() / ("photo" + std::to_string(i) + ".png"));
      for (int n = 0; n < 3; ++n) video.Add(photo);
    }
    for (int n = 0; n < 3; ++n) video.Add(ReadImage8(Photos() / "empty.png"));
    video.Finish();
  }
  const ProgramResult run =
      RunProgram({"lumi-calibrate", out / "boards.mp4", "-o", out / "camera.yaml", "--json", "--model", "square-k1k2"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["pictures"], 24);
  EXPECT_EQ(j["views_used"], 7);
  EXPECT_EQ(j["pictures_redundant"], 14);
  EXPECT_EQ(j["pictures_without_board"], 3);
  EXPECT_NEAR(j["fx"], 600, 6);
}

TEST(Program, RefusesWithOneLineAndTheRightCode) {
  const TemporaryFolder files;
  const fs::path out = files / "out" / "camera.yaml";
  const auto refuses = [&](std::vector<std::string> arguments, int code, const std::string& names) {
    std::vector<std::string> argv = {"lumi-calibrate"};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    argv.insert(argv.end(), {"-o", out.string()});
    ExpectRefusal({argv, code, {names}, files / "out", {}});
  };
  fs::create_directories(files / "nothing");
  fs::create_directories(files / "corrupt");
  WriteTextAtomically(files / "corrupt/a.jpg", "no picture");
  WriteTextAtomically(files / "clip.mp4", "no video");
  WriteTextAtomically(files / "text.txt", "text");
  fs::create_directories(files / "empty");
  fs::copy_file(Photos() / "empty.png", files / "empty/empty.png");
  fs::create_directories(files / "one");
  fs::copy_file(Photos() / "photo1.png", files / "one/photo1.png");
  const std::string photos = Photos().string();
  refuses({photos, "--board", "9by6"}, 2, "--board");
  refuses({photos, "--board", "2x6"}, 2, "--board");
  refuses({photos, "--square-mm", "0"}, 2, "--square-mm");
  refuses({photos, "--square-mm", "nan"}, 2, "--square-mm");
  refuses({photos, "--model", "nonsense"}, 2, "nonsense");
  refuses({photos, "--report", (files / "text.txt" / "report.html").string()}, 4, "report.html");
  refuses({photos, "--undistort", (files / "text.txt" / "plain").string()}, 4, "plain");
  refuses({photos, "--model", "thesis", "--fix-aspect"}, 2, "aspect");
  refuses({photos, "--undistort", photos}, 2, "photos");
  refuses({(files / "absent").string()}, 3, "absent");
  refuses({(files / "nothing").string()}, 3, "nothing");
  refuses({(files / "corrupt").string()}, 3, "a.jpg");
  refuses({(files / "clip.mp4").string()}, 3, "clip.mp4");
  refuses({(files / "text.txt").string()}, 3, "text.txt");
  refuses({(files / "empty").string()}, 1, "none of 1 photos");
  refuses({(files / "one").string()}, 1, "one view");
  fs::create_directories(files / "two");
  for (const char* name : {"photo1.png", "photo2.png"}) fs::copy_file(Photos() / name, files / "two" / name);
  refuses({(files / "two").string(), "--board", "8x6"}, 1, "9x6");
  refuses({(files / "two").string()}, 1, "two views");
}

// The undistorted photos' folder has a camera.yaml of its own, without distortion.
TEST(Program, DoesNotWriteTwoCamerasToOneFile) {
  const TemporaryFolder out;
  ExpectRefusal({{"lumi-calibrate", Photos(), "-o", out / "camera.yaml", "--undistort", out / "."},
                 2,
                 {"camera.yaml", "--undistort"},
                 out / "camera.yaml",
                 {}});
}

TEST(Program, LeavesAnothersReportAlone) {
  const TemporaryFolder out;
  WriteTextAtomically(out / "report.html", "mine");
  ExpectRefusal({{"lumi-calibrate", Photos(), "-o", out / "camera.yaml"},
                 2,
                 {"report.html"},
                 out / "camera.yaml",
                 {out / "report.html"}});
}

}  // namespace
}  // namespace lumi::test
