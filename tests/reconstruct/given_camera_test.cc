#include "reconstruct/given_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Said : public ProgressSink {
 public:
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& text) override { lines.push_back(text); }
  std::vector<std::string> lines;
};

constexpr int kWidthPx = 80, kHeightPx = 60;

// A lens with skew, and a photo through it in which a pixel's colour tells the ray that it is on: exact to a rounding
// of 1/255.
Camera Skewed() { return {CameraModel::kPlumbBob, kWidthPx, kHeightPx, {90, 92, 41, 29, 3, -0.2, 0.05, 0, 0, 0}}; }
constexpr double kRange = 0.7;  // colours reach from -kRange to kRange on z = 1
double Colour(double x) { return 255 * (0.5 + 0.5 * x / kRange); }

class GivenCameraTest : public testing::Test {
 protected:
  GivenCameraTest() {
    options_.input = folder_ / "photos";
    options_.camera_yaml = folder_ / "camera.yaml";
    capture_.folder = options_.input;
    for (const char* name : {"a.png", "b.png"}) {
      InputPhoto& added = capture_.photos.emplace_back();
      added.name = name;
      added.width_px = kWidthPx;
      added.height_px = kHeightPx;
    }
    Image8 photo(kWidthPx, kHeightPx, 3);
    for (int y = 0; y < kHeightPx; ++y)
      for (int x = 0; x < kWidthPx; ++x) {
        const Eigen::Vector2d ray = *Skewed().Normalized({x + 0.5, y + 0.5});
        photo.At(x, y, 0) = static_cast<std::uint8_t>(std::lround(Colour(ray.x())));
        photo.At(x, y, 1) = static_cast<std::uint8_t>(std::lround(Colour(ray.y())));
      }
    for (const InputPhoto& p : capture_.photos) WriteImage(capture_.folder / p.name, photo);
  }
  GivenCamera Fit() { return FitGivenCamera(options_, capture_, folder_ / "work", said_); }
  // The refusal's text; empty where there is none.
  std::string Refusal(ExitCode code) {
    try {
      Fit();
      return {};
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), code);
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      EXPECT_FALSE(fs::exists(folder_ / "work"));
      return e.what();
    }
  }
  const TemporaryFolder folder_;
  ReconstructOptions options_;
  Capture capture_;
  Said said_;
};

TEST_F(GivenCameraTest, OfThePhotosOwnSizeItIsTakenAsItIs) {
  WriteCameraYaml(Camera::Pinhole(kWidthPx, kHeightPx, 90, 92, 41, 29), options_.camera_yaml);
  const GivenCamera given = Fit();
  EXPECT_EQ(given.yaml, options_.camera_yaml);
  EXPECT_EQ(given.capture.folder, capture_.folder);
  EXPECT_FALSE(given.resampled);
  EXPECT_TRUE(said_.lines.empty());
  EXPECT_FALSE(fs::exists(folder_ / "work"));
}

TEST_F(GivenCameraTest, OfTheSameShapeItIsScaledAndThatIsSaidOnce) {
  WriteCameraYaml(
      {CameraModel::kPlumbBob, 4 * kWidthPx, 4 * kHeightPx, {360, 368, 164, 116, 0, -0.2, 0.05, 1e-3, 0, 0}},
      options_.camera_yaml);
  const Camera camera = ReadCameraYaml(Fit().yaml);
  EXPECT_EQ(camera.width_px, kWidthPx);
  EXPECT_EQ(camera.params, (std::vector<double>{90, 92, 41, 29, -0.2, 0.05, 1e-3, 0}));
  ASSERT_EQ(said_.lines.size(), 1U);
  EXPECT_THAT(said_.lines[0], testing::AllOf(HasSubstr("320x240"), HasSubstr("80x60"), HasSubstr("scaled")));
  // A pixel of rounding is no other shape.
  EXPECT_TRUE(SameShape(4032, 3024, 1000, 749));
  EXPECT_FALSE(SameShape(4032, 3024, 1000, 740));
  EXPECT_FALSE(SameShape(4032, 3024, 1000, 562));
}

TEST_F(GivenCameraTest, OfAnotherShapeItIsRefusedUnlessAskedFor) {
  WriteCameraYaml(Camera::Pinhole(80, 45, 90, 92, 41, 29), options_.camera_yaml);
  EXPECT_THAT(Refusal(ExitCode::kDataRefused), testing::AllOf(HasSubstr("80x45"), HasSubstr("80x60")));
  options_.rescale_cameras = true;
  EXPECT_EQ(Refusal(ExitCode::kDataRefused), "");
  options_.rescale_cameras = false;
  WriteCameraYaml(Camera::Pinhole(kHeightPx, kWidthPx, 90, 92, 41, 29), options_.camera_yaml);
  fs::remove_all(folder_ / "work");
  EXPECT_THAT(Refusal(ExitCode::kDataRefused), HasSubstr("turned"));
}

TEST_F(GivenCameraTest, ABrokenFileIsRefused) {
  WriteCameraYaml(Skewed(), options_.camera_yaml);
  const std::string good = ReadText(options_.camera_yaml);
  const auto with = [&](const std::string& from, const std::string& to) {
    WriteTextAtomically(options_.camera_yaml, std::string(good).replace(good.find(from), from.size(), to));
    return Refusal(ExitCode::kCorruptInput);
  };
  EXPECT_THAT(with("[90", "[.nan"), HasSubstr("no number"));
  EXPECT_THAT(with("[-0.2", "[inf"), HasSubstr("no number"));
  EXPECT_THAT(with("[90", "[-90"), HasSubstr("focal"));
  EXPECT_THAT(with("[90, ", "["), HasSubstr("9 numbers"));
  EXPECT_THAT(with("[-0.2, 0.05, 0, 0, 0]", "[-0.2, 0.05]"), HasSubstr("2 distortion coefficients"));
  EXPECT_THAT(with("image_width: 80\n", ""), HasSubstr("image_width"));
}

TEST_F(GivenCameraTest, WithoutDistortionItIsSaidThatThereIsNone) {
  WriteTextAtomically(options_.camera_yaml,
                      "image_width: 80\nimage_height: 60\ncamera_matrix:\n  data: [90, 0, 41, 0, 92, 29, 0, 0, 1]\n");
  Fit();
  ASSERT_EQ(said_.lines.size(), 1U);
  EXPECT_THAT(said_.lines[0], HasSubstr("no distortion"));
}

TEST_F(GivenCameraTest, SkewAndK3AreResampledAway) {
  WriteCameraYaml(Skewed(), options_.camera_yaml);
  options_.masks = folder_ / "masks";
  Image8 mask(kWidthPx, kHeightPx, 1, 255);
  for (int y = 0; y < kHeightPx; ++y)
    for (int x = 0; x < kWidthPx; ++x)
      if (Skewed().Normalized({x + 0.5, y + 0.5})->x() < 0) mask.At(x, y, 0) = 0;
  WriteImage(options_.masks / "a.png.png", mask);

  const GivenCamera given = Fit();
  ASSERT_TRUE(given.resampled);
  EXPECT_EQ(given.originals, capture_.folder);
  ASSERT_EQ(said_.lines.size(), 1U);
  EXPECT_THAT(said_.lines[0], HasSubstr("skew"));
  const Camera pinhole = ReadCameraYaml(given.yaml);
  ASSERT_TRUE(pinhole.IsPinhole());
  const Image8 photo = ReadImage8(given.capture.folder / "b.png"), new_mask = ReadImage8(given.masks / "a.png.png");
  ASSERT_EQ(photo.width, kWidthPx);
  for (int y = 2; y < kHeightPx - 2; ++y)
    for (int x = 2; x < kWidthPx - 2; ++x) {
      const Eigen::Vector2d ray = *pinhole.Normalized({x + 0.5, y + 0.5});
      // Two code values: 1/255 of the range, a 20th of a pixel of this lens is 0.4 of one.
      ASSERT_NEAR(photo.At(x, y, 0), Colour(ray.x()), 2) << x << " " << y;
      ASSERT_NEAR(photo.At(x, y, 1), Colour(ray.y()), 2) << x << " " << y;
      if (std::abs(ray.x()) > 1.0 / 90) {
        ASSERT_EQ(new_mask.At(x, y, 0), ray.x() < 0 ? 0 : 255) << x << " " << y;
      }
    }

  // A second run keeps what is there, another lens does not.
  const auto time = fs::last_write_time(given.capture.folder / "b.png");
  Fit();
  EXPECT_EQ(fs::last_write_time(given.capture.folder / "b.png"), time);
  Camera other = Skewed();
  other.params[4] = 0;
  other.params[9] = 0.01;
  WriteCameraYaml(other, options_.camera_yaml);
  said_.lines.clear();
  Fit();
  EXPECT_NE(fs::last_write_time(given.capture.folder / "b.png"), time);
  EXPECT_THAT(said_.lines.at(0), HasSubstr("k3"));
  // The features of a database are those of the photos as they were.
  options_.database = folder_ / "database.db";
  fs::remove_all(folder_ / "work");
  EXPECT_THAT(Refusal(ExitCode::kUsage), HasSubstr("--database"));
}

}  // namespace
}  // namespace lumi
