#include <cmath>

#include "files_test_util.h"
#include "scene/files/colmap_model.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/program/error.h"

namespace lumi::test {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// A world that is a function of direction: what any camera at the origin sees is known in closed form. Never black.
double Brightness(const Eigen::Vector2d& on_plane, int channel) {
  const double u = on_plane.x(), v = on_plane.y();
  return 140 + 60 * std::sin(9 * u + channel) * std::cos(8 * v - channel);
}

Image8 PhotoOf(const Camera& camera) {
  Image8 image(camera.width_px, camera.height_px, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto ray = camera.Normalized({x + 0.5, y + 0.5});
      for (int c = 0; c < 3; ++c)
        image.At(x, y, c) = ray ? static_cast<std::uint8_t>(std::lround(Brightness(*ray, c))) : 0;
    }
  return image;
}

Scene OneView(const TempFolder& folder, const Camera& camera, const std::string& name) {
  Scene scene;
  scene.cameras = {camera};
  scene.image_folder = folder / "photos";
  View view;
  view.name = name;
  view.camera = {0};
  scene.views = {view};
  WriteImage(scene.ImagePath(view), PhotoOf(camera), 100);
  // Points all over the photo, the corners included.
  for (double y = 0.02; y < 1; y += 0.16)
    for (double x = 0.02; x < 1; x += 0.16) {
      const Eigen::Vector2d pixel(x * camera.width_px, y * camera.height_px);
      Point p;
      p.x_in_world = 3.0 * Eigen::Vector3d(camera.Normalized(pixel)->homogeneous());
      p.track = {{{0}, pixel}};
      scene.points.push_back(p);
    }
  return scene;
}

const Camera kLenses[] = {
    {CameraModel::kSimpleRadial, kWidth, kHeight, {300, 160, 120, -0.15}},
    {CameraModel::kSimpleRadial, kWidth, kHeight, {300, 165, 112, 0.12}},
    {CameraModel::kRadial, kWidth, kHeight, {300, 160, 120, -0.2, 0.05}},
    {CameraModel::kOpenCV, kWidth, kHeight, {300, 310, 150, 130, -0.2, 0.05, 4e-3, -6e-3}},
    {CameraModel::kOpenCVFisheye, kWidth, kHeight, {220, 221, 158, 122, 0.02, -0.01, 0.002, -1e-4}},
};

TEST(Undistort, ThePinholePhotoShowsTheWorldWhereItsCameraSaysAndHasNoBlankPixel) {
  for (const Camera& lens : kLenses) {
    SCOPED_TRACE(std::string(Name(lens.model)));
    const TempFolder folder;
    const Scene scene = OneView(folder, lens, "a.png");
    const Scene flat = UndistortPhotos(scene, folder / "images", SilentProgress());
    ASSERT_TRUE(flat.cameras[0].IsPinhole());
    EXPECT_EQ(flat.cameras[0].model, CameraModel::kPinhole);
    const Image8 image = ReadImage8(flat.ImagePath(flat.views[0]));
    ASSERT_EQ(image.width, kWidth);
    ASSERT_EQ(image.height, kHeight);
    double worst = 0, sum = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) {
          const double difference =
              std::abs(image.At(x, y, c) - Brightness(*flat.cameras[0].Normalized({x + 0.5, y + 0.5}), c));
          worst = std::max(worst, difference);
          sum += difference;
        }
    constexpr double kMeanCodes = 0.5;   // rounding of two 8-bit pictures and bicubic interpolation between
    constexpr double kWorstCodes = 4.0;  // at the border half a pixel is repeated: half a pixel of the steepest slope
    EXPECT_LT(sum / (3.0 * kWidth * kHeight), kMeanCodes);
    EXPECT_LT(worst, kWorstCodes);
    // Little is lost: the photo's centre is not blown up.
    constexpr double kMostZoom = 1.35;
    EXPECT_LT(flat.cameras[0].FocalPx().x() / lens.FocalPx().x(), kMostZoom);
  }
}

TEST(Undistort, ObservationsMoveAlong) {
  for (const Camera& lens : kLenses) {
    const TempFolder folder;
    const Scene flat = UndistortPhotos(OneView(folder, lens, "a.jpg"), folder / "images", SilentProgress());
    constexpr double kPixels = 1e-7;
    for (const Point& p : flat.points) {
      ASSERT_EQ(p.track.size(), 1u);
      EXPECT_LT((*flat.cameras[0].Project(p.x_in_world) - p.track[0].x_px).norm(), kPixels);
    }
  }
}

TEST(Undistort, AWideFisheyeIsCutToWhatAPlaneCanShow) {
  const Camera fisheye{CameraModel::kOpenCVFisheye,
                       kWidth,
                       kHeight,
                       {100, 100, 160, 120, 0, 0, 0, 0}};  // 1.6 rad to the side, 2 to the corner
  const TempFolder folder;
  Scene scene;
  scene.cameras = {fisheye};
  scene.image_folder = folder / "photos";
  View view;
  view.name = "a.png";
  view.camera = {0};
  scene.views = {view};
  WriteImage(scene.ImagePath(view), PhotoOf(fisheye));
  const Scene flat = UndistortPhotos(scene, folder / "images", SilentProgress());
  const Image8 image = ReadImage8(flat.ImagePath(flat.views[0]));
  for (std::size_t i = 0; i < image.data.size(); ++i) ASSERT_GT(image.data[i], 40) << "a blank pixel";
}

TEST(Undistort, PinholePhotosAreTakenAsTheyAre) {
  const TempFolder folder;
  const Scene scene = OneView(folder, Camera::Pinhole(kWidth, kHeight, 300, 300, 160, 120), "sub/a.jpg");
  const Scene flat = UndistortPhotos(scene, folder / "images", SilentProgress());
  EXPECT_EQ(Read(flat.ImagePath(flat.views[0])), Read(scene.ImagePath(scene.views[0])));
  EXPECT_EQ(flat.views[0].name, "sub/a.jpg");
  EXPECT_EQ(flat.points[3].track[0].x_px, scene.points[3].track[0].x_px);
}

TEST(Undistort, PhotosThatAreDoneAreNotDoneAgainUnlessTheyOrTheirCameraChange) {
  const TempFolder folder;
  Scene scene = OneView(folder, kLenses[0], "a.png");
  const fs::path output = folder / "images/a.png";
  UndistortPhotos(scene, folder / "images", SilentProgress());
  const auto stamp = fs::last_write_time(output) - std::chrono::hours(1);
  const auto redone = [&] {
    fs::last_write_time(output, stamp);
    UndistortPhotos(scene, folder / "images", SilentProgress());
    return fs::last_write_time(output) != stamp;
  };
  EXPECT_FALSE(redone());
  scene.cameras[0].params[3] = -0.1;
  EXPECT_TRUE(redone());
  EXPECT_FALSE(redone());
  WriteImage(scene.ImagePath(scene.views[0]), PhotoOf(kLenses[1]));
  EXPECT_TRUE(redone());
  fs::resize_file(output, 100);  // half of it lost
  EXPECT_TRUE(redone());
  EXPECT_EQ(ReadImage8(output).width, kWidth);
  Write(folder / "images/.undistorted", "torn");
  EXPECT_TRUE(redone());
  EXPECT_FALSE(redone());
}

TEST(Undistort, ATruncatedPhotoOrAnotherSizeStopsByName) {
  const TempFolder folder;
  const Scene scene = OneView(folder, kLenses[0], "a.jpg");
  const fs::path photo = scene.ImagePath(scene.views[0]);
  fs::resize_file(photo, fs::file_size(photo) * 2 / 3);
  EXPECT_REFUSED(ExitCode::kCorruptInput, "a.jpg", UndistortPhotos(scene, folder / "images", SilentProgress()));
  EXPECT_FALSE(fs::exists(folder / "images/a.jpg"));
  WriteImage(photo, ColorfulImage(64, 48));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "64 x 48", UndistortPhotos(scene, folder / "images", SilentProgress()));
  EXPECT_REFUSED(ExitCode::kUsage, "originals", UndistortPhotos(scene, folder / "photos", SilentProgress()));
}

TEST(Undistort, AnOpenedWorkspaceGetsItsCopiesInTheCacheAndReusesThem) {
  const TempFolder folder;
  const Scene scene = OneView(folder, kLenses[3], "a.jpg");
  fs::create_directories(folder / "work");
  fs::rename(folder / "photos", folder / "work/images");
  WriteColmapModel(scene, folder / "work/sparse/0");
  const char* old = std::getenv("XDG_CACHE_HOME");
  const std::string saved = old ? old : "";
  ::setenv("XDG_CACHE_HOME", (folder / "cache").c_str(), 1);
  const Scene first = OpenScene(folder / "work", {}, SilentProgress());
  const fs::path copy = first.ImagePath(first.views[0]);
  ASSERT_TRUE(fs::exists(copy));
  const auto time = fs::last_write_time(copy);
  const Scene second = OpenScene(folder / "work/sparse/0", {}, SilentProgress());
  EXPECT_EQ(second.ImagePath(second.views[0]), copy);
  EXPECT_EQ(fs::last_write_time(copy), time);
  old ? ::setenv("XDG_CACHE_HOME", saved.c_str(), 1) : ::unsetenv("XDG_CACHE_HOME");
  EXPECT_EQ(copy.string().find((folder / "cache/lumigraph").string()), 0u);
  EXPECT_TRUE(first.CameraOf(first.views[0]).IsPinhole());
  EXPECT_EQ(CountFiles(folder / "work"), 2u);
  EXPECT_EQ(CountFiles(folder / "work/images"), 1u);
  OpenOptions as_it_is;
  as_it_is.undistort = false;
  EXPECT_EQ(OpenScene(folder / "work", as_it_is, SilentProgress()).cameras[0].model, CameraModel::kOpenCV);
}

TEST(Undistort, APictureOfThePhotoAsItWasTakenMovesAsThePhotoDid) {
  for (const Camera& lens : kLenses) {
    SCOPED_TRACE(std::string(Name(lens.model)));
    const TempFolder folder;
    Scene scene = OneView(folder, lens, "a.png");
    scene.views.push_back(scene.views[0]);  // two of one camera: its map is shared
    scene.views[1].name = "b.png";
    WriteImage(scene.ImagePath(scene.views[1]), PhotoOf(lens));
    const Scene flat = UndistortPhotos(scene, folder / "images", SilentProgress());
    const TakenToScene taken(flat);
    const Image8 before = PhotoOf(lens);
    for (const View& view : flat.views) {
      const Image8 photo = ReadImage8(flat.ImagePath(view)), moved = taken.Photo(view, before);
      EXPECT_EQ(taken.Name(view), view.name);
      EXPECT_EQ(taken.SizePx(view), Eigen::Vector2i(kWidth, kHeight));
      ASSERT_EQ(moved.data.size(), photo.data.size());
      int most = 0;
      for (std::size_t i = 0; i < moved.data.size(); ++i)
        most = std::max(most, std::abs(moved.data[i] - photo.data[i]));
      constexpr int kCodes = 2;  // photos are moved to a 32nd of a pixel
      EXPECT_LE(most, kCodes);
      // A mask takes the nearest pixel: of this slope it is off by half a pixel's worth.
      Image8 mask(kWidth, kHeight, 1);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) mask.At(x, y, 0) = before.At(x, y, 1);
      const Image8 moved_mask = taken.Mask(view, mask);
      constexpr int kHalfAPixel = 5;
      most = 0;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) most = std::max(most, std::abs(moved_mask.At(x, y, 0) - photo.At(x, y, 1)));
      EXPECT_LE(most, kHalfAPixel);
    }
  }
}

TEST(Undistort, WhatThePhotosWereIsRecordedWithTheirNames) {
  const TempFolder folder;
  Scene scene = OneView(folder, kLenses[0], "a.png");
  fs::rename(folder / "photos/a.png", folder / "photos/a.heic");
  scene.views[0].name = "a.heic";  // of an ending that is not kept; what it holds is known by its bytes
  const Scene flat = UndistortPhotos(scene, folder / "images", SilentProgress());
  EXPECT_EQ(flat.views[0].name, "a.heic.png");
  EXPECT_EQ(TakenToScene(flat).Name(flat.views[0]), "a.heic");

  const Camera skewed{CameraModel::kPlumbBob, 60, 40, {50, 50, 31, 19, 0.8, -0.1, 0.02, 0, 0, 0.01}},
      pinhole = Camera::Pinhole(60, 40, 50, 50, 30, 20);
  fs::create_directories(folder / "other");
  WriteTakenPhotos({{"b.png", "b.png", skewed, pinhole}, {"c.png", "c.heic", kLenses[4], pinhole}}, folder / "other");
  const std::vector<TakenPhoto> read = ReadTakenPhotos(folder / "other");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].camera.params, skewed.params);
  EXPECT_EQ(read[1].camera.model, CameraModel::kOpenCVFisheye);
  EXPECT_EQ(read[1].taken, "c.heic");
  EXPECT_EQ(read[1].pinhole.params, pinhole.params);

  const std::string text = Read(folder / "other/.taken.json");
  const auto refuses = [&](const std::string& from, const std::string& to) {
    std::string wrong = text;
    wrong.replace(wrong.find(from), from.size(), to);
    Write(folder / "other/.taken.json", wrong);
    EXPECT_THROW(ReadTakenPhotos(folder / "other"), InputError) << from << " -> " << to;
  };
  refuses("PLUMB_BOB", "LEMON");
  refuses("\"camera\":0", "\"camera\":7");
  refuses("\"camera\":0", "\"camera\":-1");
  refuses("\"pinhole\":1", "\"pinhole\":0");
  refuses("\"taken\"", "\"given\"");
  refuses("50.0", "-50.0");
  refuses("{", "");
  WriteTakenPhotos({{"b.png", "b.png", pinhole, pinhole}}, folder / "other");
  EXPECT_FALSE(fs::exists(folder / "other/.taken.json")) << "nothing is to be said";
  EXPECT_TRUE(ReadTakenPhotos(folder / "other").empty());
}

}  // namespace
}  // namespace lumi::test
