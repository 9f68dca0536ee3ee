// The same captures as a phone would write them and as they were simulated: what comes out may differ by no more than
// their codecs do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "scene/geometry/angle.h"
#include "scene/model/orientation.h"
#include "simulate/examples.h"
#include "tests/support/child_program.h"
#include "tests/support/phone_files.h"
#include "tests/support/quick_lamp.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kPhotos = 24;
constexpr double kUpDeg = 2;
// Two runs over one small capture differ by some tenths (COLMAP draws at random, and the mesh through few points with
// it); HEIC at a quality of 95 adds.
constexpr double kSamePsnrDb = 1;

json RunJson(std::vector<std::string> argv) {
  argv.insert(argv.end(), {"--json", "--quiet"});
  const ProgramResult run = RunProgram(argv);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? json::parse(run.out) : json();
}
const json& StageNamed(const json& summary, const std::string& name) {
  for (const json& stage : summary.at("stages"))
    if (stage.at("name") == name) return stage.at("summary");
  throw std::runtime_error("no stage " + name);
}

TEST(PhoneCapture, HeicPhotosUprightAndAcrossMakeTheSceneOfTheOriginals) {
  if (!test::CanWriteHeic()) GTEST_SKIP() << "OpenImageIO's libheif has no HEVC encoder here";
  const SimulatedCapture capture("desk", kPhotos, 480, {"--portrait-every", "2"});
  const fs::path phone = capture / "phone";
  OpenOptions as_they_are;
  as_they_are.undistort = false;
  const Scene truth = OpenScene(capture.path(), as_they_are, SilentProgress());
  std::map<std::string, Eigen::Vector3d> true_up;  // in each photo as one looks at it
  const double longer = 480;
  for (const View& view : truth.views) {
    const fs::path file = truth.ImagePath(view), heic = phone / (file.stem().string() + ".HEIC");
    const Image8 photo = ReadImage8(file);
    true_up[file.stem()] = UprightPose(view.cam_from_world, view.orientation).rotation * Eigen::Vector3d::UnitZ();
    const int focal_35mm = static_cast<int>(std::lround(truth.CameraOf(view).FocalPx().x() * 36 / longer));
    test::WriteHeic(heic, photo, view.orientation, focal_35mm);
    const ImageInfo info = ReadImageInfo(heic);
    const bool turned = view.orientation > 4;
    ASSERT_EQ(info.width, turned ? photo.height : photo.width) << "the container's turn is not heeded";
    EXPECT_EQ(info.orientation, 1);
    // The picture is the one that EXIF's orientation makes of the original.
    const Image8 upright = UprightPicture(photo, view.orientation), read = ReadImage8(heic);
    double difference = 0;
    for (std::size_t i = 0; i < read.data.size(); ++i) difference += std::abs(int{read.data[i]} - int{upright.data[i]});
    EXPECT_LT(difference / static_cast<double>(read.data.size()), 3) << heic;
  }
  std::map<std::string, double> psnr_db;
  for (const fs::path& photos : {capture.photos(), phone}) {
    const fs::path scene = capture / (photos.filename().string() + "-scene");
    const json summary = RunJson({"lumi-pipeline", photos.string(), "-o", scene.string(), "--holdout", "8",
                                  "--no-video", "--proxy-minutes", "0"});
    ASSERT_TRUE(summary.is_object());
    EXPECT_EQ(StageNamed(summary, "reconstruct")["images_registered"], kPhotos);
    psnr_db[photos.filename()] = StageNamed(summary, "holdout")["psnr_mean_db"];
    // Up is where it was, whichever way the pixels lie.
    const Scene made = OpenScene(scene, {}, SilentProgress());
    for (const View& view : made.views) {
      const Eigen::Vector3d up = UprightPose(view.cam_from_world, view.orientation).rotation * made.up;
      EXPECT_LT(AngleBetween(up, true_up.at(view.name.substr(0, view.name.find('.')))) * kDegPerRad, kUpDeg)
          << view.name;
    }
  }
  std::printf("held out: originals %.2f dB, HEIC %.2f dB\n", psnr_db["images"], psnr_db["phone"]);
  // HEIC may do better: it tells the focal length, which the originals do not.
  EXPECT_GT(psnr_db["phone"], psnr_db["images"] - kSamePsnrDb);
}

// HEVC by BT.709, stored on its side, of uneven frame times, against the film it was made of.
class PhoneFilm : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::CanWriteHevc()) GTEST_SKIP() << "ffmpeg has no libx265 here";
  }
  fs::path Simulated(const json& scene) {
    WriteTextAtomically(folder_ / "scene.json", scene.dump());
    const fs::path capture = folder_ / "capture";
    EXPECT_EQ(
        RunProgram({"lumi-simulate", folder_ / "scene.json", "--video", "--quiet", "-o", capture.string()}).exit_code,
        0);
    return capture;
  }
  const TemporaryFolder folder_;
};

TEST_F(PhoneFilm, IsSteadiedAsItsOriginal) {
  json scene = json::parse(ExampleJson("plaza"));
  scene["cameras"][0]["size"] = {320, 240};
  scene["path"]["views"] = 120;
  const fs::path capture = Simulated(scene);
  const fs::path original = capture / "video.mp4", phone = folder_ / "phone.mp4";
  test::WritePhoneFilm(original, "not(eq(mod(n,29),11))", phone);  // one frame of 29 was dropped
  ASSERT_FALSE(ReadVideoTimes(phone).constant);
  ASSERT_EQ(VideoReader(phone).width(), VideoReader(original).width());
  std::map<std::string, json> videos;  // as filmed, steadied
  for (const fs::path& film : {original, phone}) {
    const json summary = RunJson({"lumi-pipeline", film.string(), "--stabilize", "smooth", "-o",
                                  folder_ / (film.stem().string() + "-steady.mp4")});
    ASSERT_TRUE(summary.is_object());
    videos[film.stem()] = summary["score"]["videos"];
    const VideoReader steady(folder_ / (film.stem().string() + "-steady.mp4"));
    EXPECT_EQ(steady.width(), VideoReader(film).width());
  }
  const auto figure = [&](const char* film, int which, const char* key) {
    return videos.at(film).at(static_cast<std::size_t>(which)).at(key).get<double>();
  };
  for (const char* key : {"jitter_px", "stability", "distortion"})
    std::printf("%-10s filmed %.4f, phone %.4f; steadied %.4f, phone %.4f\n", key, figure("video", 0, key),
                figure("phone", 0, key), figure("video", 1, key), figure("phone", 1, key));
  EXPECT_NEAR(figure("phone", 1, "jitter_px"), figure("video", 1, "jitter_px"), 0.05);
  EXPECT_NEAR(figure("phone", 1, "stability"), figure("video", 1, "stability"), 0.03);
  EXPECT_LT(figure("phone", 1, "jitter_px"), 0.3 * figure("phone", 0, "jitter_px"));
}

TEST_F(PhoneFilm, HasThePeriodOfItsOriginal) {
  constexpr double kPeriodFrames = 15.37;
  json lamp = QuickLamp(320, 240, kPeriodFrames);
  lamp["path"]["views"] = 96;
  lamp["fixed_video"]["frames"] = 90;
  const fs::path capture = Simulated(lamp), phone = folder_ / "phone.mp4", fixed = folder_ / "phone-fixed.mp4",
                 scene = folder_ / "scene";
  test::WritePhoneFilm(capture / "video.mp4", "not(eq(mod(n,29),11))", phone);
  test::WritePhoneFilm(capture / "fixed.mp4", "not(eq(mod(n,31),7))", fixed);
  const json summary = RunJson({"lumi-pipeline", phone.string(), "--periodic", "--fixed-video", fixed.string(), "-o",
                                scene.string(), "--quality", "low", "--no-video", "--proxy-minutes", "0"});
  ASSERT_TRUE(summary.is_object());
  EXPECT_NEAR(StageNamed(summary, "timeperiodic")["period_s"].get<double>(), kPeriodFrames / 30,
              1e-3 * kPeriodFrames / 30);
  const Scene made = OpenScene(scene, {}, SilentProgress());
  EXPECT_GT(made.views.size(), 60U);
  ASSERT_TRUE(made.period_s);
  std::printf("period %.5f s for %.5f, %zu views, held out %.2f dB\n", *made.period_s, kPeriodFrames / 30,
              made.views.size(), StageNamed(summary, "holdout")["psnr_mean_db"].get<double>());
}

}  // namespace
}  // namespace lumi
