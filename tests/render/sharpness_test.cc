#include "render/effects/sharpness.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "scene/files/image_io.h"

namespace lumi {
namespace {

// How one photo of a wall was taken.
struct Shot {
  Eigen::Vector2d motion_px = {0, 0};  // of a photo of full size, during the exposure
  double defocus_px = 0;               // radius of the circle of confusion
  double gain = 1, noise = 0;
  double blurred_from = 0;  // the part of the photo left of this share of its width stays sharp
  int shrink = 1;           // 2: half the size
  bool plain = false;       // of a wall without anything on it
};

constexpr int kWallWidth = 192, kWallHeight = 144;
constexpr double kWallFocalPx = 170;

// Cells of grey over three octaves, the finest about two pixels wide.
double Wall(const Eigen::Vector2d& x) {
  double value = 128;
  std::uint32_t octave = 0;
  for (const double size : {0.25, 0.1, 0.045}) {
    const auto hash = [&](double cell_x, double cell_y) {
      std::uint32_t h = static_cast<std::uint32_t>(static_cast<int>(cell_x) * 73856093) ^
                        static_cast<std::uint32_t>(static_cast<int>(cell_y) * 19349663) ^ (octave * 83492791U);
      h = (h ^ (h >> 13)) * 1274126177U;
      return static_cast<double>((h ^ (h >> 16)) & 1023) / 1023 - 0.5;
    };
    value += 70 * hash(std::floor(x.x() / size), std::floor(x.y() / size));
    ++octave;
  }
  return value;
}

Image8 Take(const RenderView& view, const Shot& shot, std::uint32_t seed) {
  constexpr int kSide = 6, kMoments = kSide * kSide;
  constexpr double kGoldenAngle = 2.399963229728653;
  // Each moment at another place in the pixel, as the simulator has them.
  std::vector<Eigen::Vector3d> sharp, blurred;
  for (int m = 0; m < kMoments; ++m) {
    const Eigen::Vector2d in_pixel((m % kSide + 0.5) / kSide, (m / kSide + 0.5) / kSide);
    const double time = ((7 * m + 3) % kMoments + 0.5) / kMoments, angle = kGoldenAngle * m;
    const Eigen::Vector2d way = (time - 0.5) * shot.motion_px +
                                shot.defocus_px * std::sqrt(time) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    sharp.push_back(in_pixel.homogeneous());
    blurred.push_back((in_pixel + way / shot.shrink).homogeneous());
  }
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise(0, 1);
  const Eigen::Matrix3d direction = view.P.leftCols<3>().inverse();
  Image8 photo(view.size_px.x(), view.size_px.y(), 3);
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      double sum = 0;
      for (const Eigen::Vector3d& at : x >= shot.blurred_from * photo.width ? blurred : sharp) {
        const Eigen::Vector3d d = direction * (at + Eigen::Vector3d(x, y, 0));
        sum += shot.plain ? 128 : Wall((view.centre - view.centre.z() / d.z() * d).head<2>());
      }
      for (int c = 0; c < 3; ++c)
        photo.At(x, y, c) = static_cast<std::uint8_t>(
            std::lround(std::clamp(shot.gain * sum / kMoments + shot.noise * noise(engine), 0.0, 255.0)));
    }
  return photo;
}

struct WallCapture {
  Scene scene;
  std::vector<Photo> photos;

  explicit WallCapture(const std::vector<Shot>& shots, int points = 500) {
    for (std::size_t v = 0; v < shots.size(); ++v) {
      const Shot& shot = shots[v];
      const double s = 1.0 / shot.shrink;
      scene.cameras.push_back(Camera::Pinhole(kWallWidth / shot.shrink, kWallHeight / shot.shrink, s * kWallFocalPx,
                                              s * kWallFocalPx, 0.5 * s * kWallWidth, 0.5 * s * kWallHeight));
      View view;
      view.name = "view" + std::to_string(100 + v) + ".png";
      view.camera = {static_cast<int>(v)};
      const double i = static_cast<double>(v);
      view.cam_from_world =
          LookAt({0.12 * i - 0.4, 0.2 * std::sin(2.0 * i), -4 - 0.1 * std::cos(3.0 * i)}, {0.1, 0, 0}, {0, -1, 0});
      scene.views.push_back(view);
      Photo photo;
      photo.levels = BuildPyramid(Take(MakeRenderView(scene, view), shot, static_cast<std::uint32_t>(v)));
      photos.push_back(std::move(photo));
    }
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < points; ++i) {
      Point p;
      p.x_in_world = {2 * u(engine), 1.5 * u(engine), 0};
      for (std::size_t v = 0; v < shots.size(); ++v) {
        const RenderView view = MakeRenderView(scene, scene.views[v]);
        const auto x = Project(view.P, p.x_in_world);
        if (x && x->minCoeff() > 0 && x->x() < view.size_px.x() && x->y() < view.size_px.y())
          p.track.push_back({{static_cast<int>(v)}, *x});
      }
      scene.points.push_back(p);
    }
    UpdateFrameOfReference(scene);
  }

  Sharpness Estimate() const { return EstimateSharpness(scene, photos); }
};

Shot Moved(double px, double angle_rad) {
  Shot shot;
  shot.motion_px = px * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
  return shot;
}

Shot OutOfFocus(double px) {
  Shot shot;
  shot.defocus_px = px;
  return shot;
}

void ExpectAllSharp(const Sharpness& s) {
  EXPECT_FALSE(s.Differ());
  EXPECT_EQ(s.share, 0);
  for (std::size_t v = 0; v < s.grid.size(); ++v) {
    EXPECT_GT(s.of_photo[v], 0.95) << v;
    ASSERT_EQ(s.grid[v].value.size(), static_cast<std::size_t>(s.grid[v].columns * s.grid[v].rows));
    for (const float value : s.grid[v].value) EXPECT_GT(value, 0.85F) << v;
  }
}

TEST(Sharpness, PhotosThatAreAllSharpDoNotDiffer) { ExpectAllSharp(WallCapture(std::vector<Shot>(9)).Estimate()); }

TEST(Sharpness, BlurredPhotosAreFound) {
  std::vector<Shot> shots(9);
  shots[1] = Moved(5, 0);
  shots[4] = Moved(5, 1.0);
  shots[7] = OutOfFocus(2);
  const Sharpness s = WallCapture(shots).Estimate();
  EXPECT_TRUE(s.Differ());
  EXPECT_NEAR(s.share, 3.0 / 9, 1e-9);
  for (std::size_t v = 0; v < shots.size(); ++v)
    if (v % 3 == 1)
      EXPECT_LT(s.of_photo[v], 0.7) << v;
    else
      EXPECT_GT(s.of_photo[v], 0.95) << v;
  EXPECT_LT(s.typical, 0.7);
}

TEST(Sharpness, MoreBlurIsLessSharp) {
  std::vector<Shot> shots(10);
  for (std::size_t i = 0; i < 4; ++i) {
    const double px = std::exp2(static_cast<double>(i) + 1);  // 2 to 16
    shots[i + 1] = Moved(px, 0.5);
    shots[i + 5] = OutOfFocus(0.5 * px);
  }
  const Sharpness s = WallCapture(shots).Estimate();
  for (const std::size_t first : {1U, 5U})
    for (std::size_t v = first; v < first + 3; ++v) EXPECT_GT(s.of_photo[v], s.of_photo[v + 1] + 0.02) << v;
  EXPECT_GT(s.of_photo[0], 0.95);
  EXPECT_GT(s.of_photo[9], 0.95);
}

TEST(Sharpness, ExposureIsNoBlur) {
  std::vector<Shot> shots(9);
  shots[2] = shots[5] = Moved(5, 0.8);
  const Sharpness plain = WallCapture(shots).Estimate();
  for (std::size_t v = 0; v < shots.size(); ++v) shots[v].gain = v % 2 == 0 ? 0.75 : 1.1;
  const Sharpness exposed = WallCapture(shots).Estimate();
  for (std::size_t v = 0; v < shots.size(); ++v) EXPECT_NEAR(exposed.of_photo[v], plain.of_photo[v], 0.05) << v;
}

// What a photo with larger pixels could not show is not asked of those that are compared with it.
TEST(Sharpness, ASmallerPhotoIsNoBlur) {
  std::vector<Shot> shots(9);
  shots[2] = shots[5] = Moved(8, 0.8);
  for (const std::size_t v : {1U, 2U}) shots[v].shrink = 2;
  const Sharpness s = WallCapture(shots).Estimate();
  for (std::size_t v = 0; v < shots.size(); ++v)
    if (v == 2 || v == 5)
      EXPECT_LT(s.of_photo[v], 0.75) << v;
    else
      EXPECT_GT(s.of_photo[v], 0.95) << v;
  EXPECT_NEAR(s.of_photo[2], s.of_photo[5], 0.1) << "the same blur, at half the size";
}

TEST(Sharpness, NoiseIsNoDetail) {
  std::vector<Shot> shots(9);
  for (Shot& shot : shots) shot.noise = 2;
  shots[3].noise = 6;
  shots[5] = Moved(6, 0.3);
  shots[5].noise = 6;
  const Sharpness s = WallCapture(shots).Estimate();
  for (std::size_t v = 0; v < shots.size(); ++v)
    if (v == 5)
      EXPECT_LT(s.of_photo[v], 0.75);
    else
      EXPECT_GT(s.of_photo[v], 0.9) << v;
}

TEST(Sharpness, APhotoMayBeSharpInPartOnly) {
  std::vector<Shot> shots(9);
  shots[4] = Moved(7, 0.2);
  shots[4].blurred_from = 0.5;
  const Sharpness s = WallCapture(shots).Estimate();
  const PhotoGrid& grid = s.grid[4];
  EXPECT_GT(grid.At(0.15F, 0.5F), 0.8F);
  EXPECT_LT(grid.At(0.85F, 0.5F), 0.65F);
}

TEST(Sharpness, AGridIsBilinearBetweenItsCells) {
  const PhotoGrid grid{2, 1, {0.2F, 0.6F}};
  EXPECT_FLOAT_EQ(grid.At(0.25F, 0.9F), 0.2F);
  EXPECT_FLOAT_EQ(grid.At(0.5F, 0.0F), 0.4F);
  EXPECT_FLOAT_EQ(grid.At(1.0F, 0.5F), 0.6F);
  EXPECT_FLOAT_EQ(PhotoGrid().At(0.3F, 0.7F), 1.0F);
}

TEST(Sharpness, OfTwoPhotosOneIsSharper) {
  const Sharpness s = WallCapture({Shot{}, Moved(6, 0.7)}).Estimate();
  EXPECT_TRUE(s.Differ());
  EXPECT_GT(s.of_photo[0], 0.95);
  EXPECT_LT(s.of_photo[1], 0.7);
}

TEST(Sharpness, PhotosThatAreAllBlurredAlikeDoNotDiffer) {
  ExpectAllSharp(WallCapture(std::vector<Shot>(6, Moved(6, 0.7))).Estimate());
}

TEST(Sharpness, WhereNothingIsKnownPhotosCountAsSharp) {
  std::vector<Shot> dark(4);  // too dark, then without texture, then with noise alone
  for (Shot& shot : dark) shot.gain = 0;
  ExpectAllSharp(WallCapture(dark).Estimate());
  std::vector<Shot> plain(4);
  for (Shot& shot : plain) shot.plain = true;
  ExpectAllSharp(WallCapture(plain).Estimate());
  for (std::size_t v = 0; v < plain.size(); ++v) plain[v].noise = 2.0 + 2.0 * static_cast<double>(v);
  ExpectAllSharp(WallCapture(plain).Estimate());
  const std::vector<Shot> blurred = {Shot{}, Moved(6, 0.7), Shot{}};
  ExpectAllSharp(WallCapture(blurred, 0).Estimate());
  ExpectAllSharp(WallCapture(blurred, 1).Estimate());
}

TEST(Sharpness, APhotoThatIsNotThereCountsAsSharp) {
  std::vector<Shot> shots(6);
  shots[1] = shots[3] = Moved(6, 0.7);
  WallCapture capture(shots);
  capture.photos[1] = Photo();
  const Sharpness s = capture.Estimate();
  EXPECT_EQ(s.of_photo[1], 1);
  EXPECT_LT(s.of_photo[3], 0.7);
  EXPECT_NEAR(s.share, 1.0 / 5, 1e-9);
}

TEST(Sharpness, NeedsNoMetric) {
  std::vector<Shot> shots(6);
  shots[1] = shots[4] = Moved(6, 0.7);
  WallCapture capture(shots);
  for (View& view : capture.scene.views) {
    view.P = MakeRenderView(capture.scene, view).P;
    view.size_px = {kWallWidth, kWallHeight};
  }
  capture.scene.frame = Frame::kProjective;
  const Sharpness s = capture.Estimate();
  for (std::size_t v = 0; v < shots.size(); ++v) EXPECT_EQ(s.of_photo[v] < 0.7, v % 3 == 1) << v;
}

TEST(Sharpness, PhotosReadOneByOneGiveTheSame) {
  std::vector<Shot> shots(4);
  shots[2] = Moved(5, 0.4);
  WallCapture capture(shots);
  capture.scene.image_folder =
      std::filesystem::temp_directory_path() / ("lumi_sharpness_" + std::to_string(::getpid()));
  std::filesystem::create_directories(capture.scene.image_folder);
  for (std::size_t v = 0; v < shots.size(); ++v)
    WriteImage(capture.scene.ImagePath(capture.scene.views[v]), capture.photos[v].levels[0]);
  const Sharpness in_memory = capture.Estimate(), read = EstimateSharpness(capture.scene, SilentProgress());
  std::filesystem::remove_all(capture.scene.image_folder);
  EXPECT_EQ(in_memory.of_photo, read.of_photo);
  for (std::size_t v = 0; v < shots.size(); ++v) EXPECT_EQ(in_memory.grid[v].value, read.grid[v].value);
}

}  // namespace
}  // namespace lumi
