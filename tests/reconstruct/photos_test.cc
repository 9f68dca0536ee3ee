// Folders of photos as phones and cameras leave them: RAW beside JPEG, masks by any name, photos that no camera model
// holds.
#include "reconstruct/photos.h"

#include <gtest/gtest.h>

#include <cmath>

#include "database_fixture.h"
#include "reconstruct/colmap_database.h"
#include "reconstruct/features.h"
#include "reconstruct/masks.h"
#include "reconstruct/unsuitable.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/temporary_folder.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "tests/support/messages_kept.h"
#include "tests/support/photo_files.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

// Detail everywhere, no two places alike.
Image8 Textured(int width, int height, double phase = 0) {
  Image8 image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.At(x, y, c) = static_cast<std::uint8_t>(128 + 50 * std::sin(0.31 * x + phase + 0.002 * x * y) +
                                                      50 * std::cos(0.27 * y + 0.004 * x * y + c));
  return image;
}

std::vector<std::string> NamesOf(const Capture& capture) {
  std::vector<std::string> names;
  for (const InputPhoto& photo : capture.photos) names.push_back(photo.name);
  return names;
}

// --- RAW ---------------------------------------------------------------------------------------------------------

TEST(Photos, RawIsReadUnlessItsJpegLiesBesideIt) {
  if (!CanReadRaw()) GTEST_SKIP() << "this OpenImageIO was built without LibRaw";
  const TemporaryFolder folder;
  WriteImage(folder / "both.JPG", Textured(96, 64));
  test::WriteDng(folder / "both.dng", 96, 64, {0.5, 0.2, 0.1});
  test::WriteDng(folder / "alone.DNG", 96, 64, {0.5, 0.2, 0.1});
  MessagesKept said;
  const Capture found = FindPhotos(folder.path(), said);
  EXPECT_EQ(NamesOf(found), (std::vector<std::string>{"alone.DNG", "both.JPG"}));
  EXPECT_NE(said.all.find("left out 1 RAW file beside the picture of the same name: both.dng"), std::string::npos)
      << said.all;
  ASSERT_TRUE(found.photos[0].needs_conversion);
  const Capture staged = StageForColmap(found, folder / "work", said);
  ASSERT_EQ(NamesOf(staged), (std::vector<std::string>{"alone.DNG.png", "both.JPG"}));
  EXPECT_EQ(staged.photos[0].OriginalName(), "alone.DNG");
  EXPECT_NEAR(staged.photos[0].focal_35mm.value_or(0), 28, 1e-6);
  EXPECT_NEAR(ReadImage8(folder / "work/alone.DNG.png").At(48, 32, 0), 188, 3);
}

TEST(Photos, ARawFileCutOffIsLeftOutWhenItIsDeveloped) {
  if (!CanReadRaw()) GTEST_SKIP() << "this OpenImageIO was built without LibRaw";
  const TemporaryFolder folder;
  for (const char* name : {"a.dng", "b.dng", "c.dng"}) test::WriteDng(folder / name, 96, 64, {0.5, 0.2, 0.1});
  fs::resize_file(folder / "b.dng", 900);
  MessagesKept said;
  const Capture staged = StageForColmap(FindPhotos(folder.path(), said), folder / "work", said);
  EXPECT_EQ(NamesOf(staged), (std::vector<std::string>{"a.dng.png", "c.dng.png"}));
  ASSERT_EQ(staged.unreadable.size(), 1U);
  EXPECT_EQ(staged.unreadable[0].name, "b.dng");
}

// --- cameras -----------------------------------------------------------------------------------------------------

TEST(Photos, OneCameraForOneSettingOfTheLensOnly) {
  Capture capture;
  capture.photos.resize(3);
  for (InputPhoto& photo : capture.photos) {
    photo.width_px = 400;
    photo.height_px = 300;
    photo.camera = "Acme Reflex";
  }
  EXPECT_TRUE(PlanCameras(capture, {}).shared);
  capture.photos[1].focal_mm = 35;  // a zoom lens whose film equivalent EXIF does not tell
  EXPECT_FALSE(PlanCameras(capture, {}).shared);
}

TEST(Database, AFocalLengthBecomesKnown) {
  const FixtureFolder folder("focal");
  {
    TestDatabase db(folder.path() / "database.db");
    db.AddImage(1, "a.jpg", 3);
  }
  ColmapDatabase db(folder.path() / "database.db");
  Camera guessed;
  guessed.model = CameraModel::kSimpleRadial;
  guessed.width_px = 640;
  guessed.height_px = 480;
  guessed.params = {768, 320, 240, 0};
  db.SetCameras({guessed}, false, {{1, 0}});
  auto cameras = db.Cameras();
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_FALSE(cameras[0].focal_is_known);
  EXPECT_EQ(cameras[0].camera.params, guessed.params);
  db.SetFocalLength(cameras[0].id, guessed.WithPinhole({500, 500}, {320, 240}));
  cameras = db.Cameras();
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_TRUE(cameras[0].focal_is_known);
  EXPECT_EQ(cameras[0].camera.params, (std::vector<double>{500, 320, 240, 0}));
}

// --- masks -------------------------------------------------------------------------------------------------------

struct MaskFixture {
  TemporaryFolder folder;
  Capture capture;
  MessagesKept said;

  void Photo(const std::string& name, int orientation = 1) {
    InputPhoto photo;
    photo.name = name;
    photo.width_px = 8;
    photo.height_px = 6;
    photo.orientation = orientation;
    capture.folder = folder / "photos";
    capture.photos.push_back(photo);
  }
  // Black but for a white pixel in the upper left corner.
  void Mask(const std::string& name, int width = 8, int height = 6) const {
    Image8 mask(width, height, 1);
    mask.At(0, 0, 0) = 255;
    WriteImage(folder / "masks" / name, mask);
  }
  fs::path Find() { return MasksForColmap(capture, folder / "masks", folder / "work", said); }
};

TEST(Masks, AreFoundUnderEveryNameAndHandedOnUnderColmaps) {
  MaskFixture f;
  f.Photo("a.jpg");       // a.jpg.png
  f.Photo("sub/b.jpg");   // sub/b.png
  f.Photo("C.JPG");       // c.jpg.PNG
  f.Photo("d.HEIC.png");  // the copy of d.HEIC, whose mask is named after that
  f.Photo("e.tif.png");   // the copy of e.tif: e.png
  f.Photo("f.jpg");       // f.jpg itself, in the folder of masks
  f.Photo("g.jpg");       // none
  f.capture.photos[3].original = "d.HEIC";
  f.capture.photos[4].original = "e.tif";
  for (const char* name : {"a.jpg.png", "sub/b.png", "c.jpg.PNG", "d.HEIC.png", "e.png", "f.jpg"}) f.Mask(name);
  const fs::path masks = f.Find();
  EXPECT_EQ(masks, f.folder / "work");
  for (const char* photo : {"a.jpg", "sub/b.jpg", "C.JPG", "d.HEIC.png", "e.tif.png", "f.jpg"}) {
    const fs::path file = masks / (std::string(photo) + ".png");
    ASSERT_TRUE(fs::exists(file)) << photo;
    EXPECT_GT(ReadImage8(file).At(0, 0, 0), 127) << photo;
  }
  EXPECT_FALSE(fs::exists(masks / "g.jpg.png"));
  EXPECT_NE(f.said.all.find("1 of 7 photos have no mask and are used whole: g.jpg"), std::string::npos) << f.said.all;
}

TEST(Masks, OfPhotosThatTheSceneRenamedHaveEitherName) {
  MaskFixture f;
  f.Photo("caf=E9.jpg");    // caf\xe9.jpg, the byte of Latin 1
  f.Photo("=20outer.jpg");  // " outer.jpg", whose mask has the scene's name
  f.Photo("c.jpg");
  f.capture.photos[0].original = "caf\xe9.jpg";
  f.capture.photos[1].original = " outer.jpg";
  for (const char* name : {"caf\xe9.jpg.png", "=20outer.jpg.png", "c.jpg.png"}) f.Mask(name);
  const fs::path masks = f.Find();
  for (const char* photo : {"caf=E9.jpg", "=20outer.jpg", "c.jpg"})
    EXPECT_TRUE(fs::exists(masks / (std::string(photo) + ".png"))) << photo;
  EXPECT_EQ(f.said.all.find("have no mask"), std::string::npos) << f.said.all;
}

TEST(Masks, NamedAsColmapWantsThemAreUsedWhereTheyLie) {
  MaskFixture f;
  f.Photo("a.jpg");
  f.Mask("a.jpg.png");
  EXPECT_EQ(f.Find(), f.folder / "masks");
  EXPECT_TRUE(f.said.all.empty()) << f.said.all;
}

TEST(Masks, DrawnOverTheUprightPhotoAreTurnedAsItIsStored) {
  MaskFixture f;
  f.Photo("a.jpg", 6);
  f.Mask("a.jpg.png", 6, 8);
  const Image8 mask = ReadImage8(f.Find() / "a.jpg.png");
  ASSERT_EQ(mask.width, 8);
  ASSERT_EQ(mask.height, 6);
  EXPECT_EQ(mask.At(0, 5, 0), 255);  // upright the upper left corner
  EXPECT_EQ(mask.At(0, 0, 0), 0);
}

TEST(Masks, OfOtherPhotosAreRefusedWithTheNameThatIsWanted) {
  MaskFixture f;
  f.Photo("IMG_1.HEIC.png");
  f.capture.photos[0].original = "IMG_1.HEIC";
  f.Mask("DSC_0001.png");
  try {
    f.Find();
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_NE(e.hint().find("IMG_1.HEIC.png"), std::string::npos) << e.hint();
  }
}

// --- 360 degrees and fisheyes ------------------------------------------------------------------------------------

// What a camera sees all around: detail in every direction.
Image8 Equirectangular(int height, double phase = 0) {
  Image8 image(2 * height, height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double longitude = 2 * M_PI * (x + 0.5) / image.width, latitude = M_PI * (y + 0.5) / height;
      const Eigen::Vector3d d(std::sin(latitude) * std::cos(longitude), std::sin(latitude) * std::sin(longitude),
                              std::cos(latitude));
      const double v = std::sin(23 * d.x() + 5 * d.z() + phase) + std::sin(21 * d.y() - 3 * d.z()) +
                       std::sin(15 * d.x() - 16 * d.y() + 2 * d.z());
      for (int c = 0; c < 3; ++c) image.At(x, y, c) = static_cast<std::uint8_t>(128 + 35 * v);
    }
  return image;
}

TEST(Unsuitable, APanoramaOfAllDirectionsIsToldFromAWidePhoto) {
  EXPECT_TRUE(LooksEquirectangular(Equirectangular(300)));
  EXPECT_FALSE(LooksEquirectangular(Textured(600, 300)));
  EXPECT_FALSE(LooksEquirectangular(Image8(600, 300, 3, 90)));
  // A horizon from edge to edge between a clear sky and snow, a house in the middle.
  Image8 landscape(600, 300, 3, 235);
  for (int y = 0; y < 150; ++y)
    for (int x = 0; x < 600; ++x) landscape.At(x, y, 0) = 80;
  const Image8 house = Textured(200, 120);
  for (int y = 0; y < 120; ++y) std::copy(house.Row(y), house.Row(y) + 600, landscape.Row(90 + y) + 3 * 200);
  EXPECT_FALSE(LooksEquirectangular(landscape));
  // All around, but cut: its edges do not meet.
  const Image8 all = Equirectangular(400);
  Image8 part(600, 300, 3);
  for (int y = 0; y < 300; ++y) std::copy(all.Row(y), all.Row(y) + 3 * 600, part.Row(y));
  EXPECT_FALSE(LooksEquirectangular(part));
}

Image8 Disc(int width, int height, double radius, double phase = 0) {
  Image8 image = Textured(width, height, phase);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::hypot(x + 0.5 - 0.5 * width, y + 0.5 - 0.5 * height) > radius)
        for (int c = 0; c < 3; ++c) image.At(x, y, c) = 3;
  return image;
}

TEST(Unsuitable, AFisheyesDiscIsFoundAndDarkCornersAreNone) {
  const auto circle = FindImageCircle(Disc(480, 320, 150));
  ASSERT_TRUE(circle);
  EXPECT_NEAR(circle->radius, 150.0 / 320, 0.01);
  EXPECT_TRUE(FindImageCircle(Disc(400, 320, 190)));  // cut at two sides
  EXPECT_FALSE(FindImageCircle(Textured(480, 320)));
  EXPECT_FALSE(FindImageCircle(Image8(480, 320, 3, 2)));  // a lens cap
  EXPECT_FALSE(FindImageCircle(Disc(480, 320, 80)));      // a plate on black cloth
  Image8 vignetted = Textured(480, 320);
  for (int y = 0; y < 320; ++y)
    for (int x = 0; x < 480; ++x) {
      const double r = std::hypot(x - 240.0, y - 160.0) / 288;
      for (int c = 0; c < 3; ++c)
        vignetted.At(x, y, c) = static_cast<std::uint8_t>(vignetted.At(x, y, c) * (1 - 0.9 * r * r));
    }
  EXPECT_FALSE(FindImageCircle(vignetted));
}

Capture Photographs(const TemporaryFolder& folder, const std::vector<Image8>& pictures) {
  for (std::size_t i = 0; i < pictures.size(); ++i)
    WriteImage(folder / ("photo" + std::to_string(i) + ".jpg"), pictures[i]);
  MessagesKept said;
  return FindPhotos(folder.path(), said);
}

TEST(Unsuitable, PhotosThatNoCameraModelHoldsAreLeftOutWithWhatToDo) {
  MessagesKept said;
  {
    const TemporaryFolder folder;
    Capture around = Photographs(folder, {Equirectangular(200), Equirectangular(200, 1), Equirectangular(200, 2)});
    LeaveOutUnsuitable(around, {}, said);
    EXPECT_TRUE(around.photos.empty());
    ASSERT_EQ(around.unreadable.size(), 3U);
    EXPECT_NE(around.unreadable[0].reason.find("360-degree"), std::string::npos);
    EXPECT_NE(around.unreadable[0].hint.find("v360"), std::string::npos);
  }
  const TemporaryFolder folder;
  const Capture discs = Photographs(folder, {Disc(480, 320, 150), Disc(480, 320, 150, 1), Disc(480, 320, 150, 2)});
  Capture fisheye = discs;
  LeaveOutUnsuitable(fisheye, {}, said);
  EXPECT_TRUE(fisheye.photos.empty());
  EXPECT_NE(fisheye.unreadable.at(0).hint.find("--camera"), std::string::npos);
  // Its camera is known: every photo is used.
  ReconstructOptions known;
  known.camera_yaml = "fisheye.yaml";
  fisheye = discs;
  LeaveOutUnsuitable(fisheye, known, said);
  EXPECT_EQ(fisheye.photos.size(), 3U);
  // One plate among other photos is none.
  const TemporaryFolder mixed_folder;
  Capture mixed = Photographs(mixed_folder, {Disc(480, 320, 150), Textured(480, 320), Textured(480, 320, 1)});
  LeaveOutUnsuitable(mixed, {}, said);
  EXPECT_EQ(mixed.photos.size(), 3U);
}

TEST(Unsuitable, WhatFilesSayCountsWithoutLookingAtPixels) {
  Capture capture;
  const auto add = [&](const std::string& name, int width, int height) -> InputPhoto& {
    InputPhoto photo;
    photo.name = name;
    photo.width_px = width;
    photo.height_px = height;
    capture.photos.push_back(photo);
    return capture.photos.back();
  };
  add("xmp.jpg", 4096, 2048).projection = "equirectangular";
  add("theta.jpg", 5376, 2688).camera = "RICOH RICOH THETA V";
  add("panorama.jpg", 9000, 2000).panorama = true;
  add("lens.jpg", 6000, 4000).lens = "EF8-15mm f/4L Fisheye USM";
  MessagesKept said;
  LeaveOutUnsuitable(capture, {}, said);
  EXPECT_TRUE(capture.photos.empty()) << capture.photos[0].name;
  EXPECT_EQ(capture.unreadable.size(), 4U);
}

TEST(Photos, XmpAndExifOfA360PhotoAreRead) {
  const TemporaryFolder folder;
  WriteImage(folder / "a.jpg", Textured(200, 100));
  std::string bytes = ReadText(folder / "a.jpg");
  const std::string xmp =
      std::string("http://ns.adobe.com/xap/1.0/\0", 29) +
      R"(<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">)"
      R"(<rdf:Description rdf:about="" xmlns:GPano="http://ns.google.com/photos/1.0/panorama/">)"
      R"(<GPano:ProjectionType>equirectangular</GPano:ProjectionType></rdf:Description></rdf:RDF></x:xmpmeta>)";
  const auto size = static_cast<int>(xmp.size() + 2);
  bytes.insert(2, std::string("\xFF\xE1") + static_cast<char>(size >> 8) + static_cast<char>(size & 255) + xmp);
  WriteTextAtomically(folder / "a.jpg", bytes);
  EXPECT_EQ(ReadImageInfo(folder / "a.jpg").projection, "equirectangular");
  WriteImage(folder / "b.jpg", Textured(200, 100));
  EXPECT_EQ(ReadImageInfo(folder / "b.jpg").projection, "");
}

}  // namespace
}  // namespace lumi
