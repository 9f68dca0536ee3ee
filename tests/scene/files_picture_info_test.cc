// What photos say beside their pixels, in every container that phones and cameras use, and their colours.
#include <OpenImageIO/imageio.h>
#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "files_test_util.h"
#include "tests/support/photo_files.h"

namespace lumi::test {
namespace {

constexpr double kFocal35 = 26, kFocal = 5.1;

// A photograph's file with EXIF, as OpenImageIO writes it.
void WriteWithExif(const fs::path& path, OIIO::ImageSpec spec, const std::string& profile = {}) {
  if (!profile.empty())
    spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                   profile.data());
  const Image8 image = ColorfulImage(spec.width, spec.height);
  auto out = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(out) << path;
  ASSERT_TRUE(out->open(path.string(), spec) && out->write_image(OIIO::TypeDesc::UINT8, image.data.data()) &&
              out->close())
      << out->geterror();
}

OIIO::ImageSpec PhoneSpec(OIIO::TypeDesc type = OIIO::TypeDesc::UINT8) {
  OIIO::ImageSpec spec(64, 48, 3, type);
  spec.attribute("Make", "Acme");
  spec.attribute("Model", "Phone 7");
  spec.attribute("Orientation", 6);
  spec.attribute("Exif:FocalLengthIn35mmFilm", static_cast<int>(kFocal35));
  spec.attribute("Exif:FocalLength", static_cast<float>(kFocal));
  spec.attribute("Exif:DateTimeOriginal", "2024:05:06 07:08:09");
  return spec;
}

void ExpectPhone(const fs::path& path, int orientation) {
  const ImageInfo info = ReadImageInfo(path);
  EXPECT_NEAR(info.focal_35mm.value_or(0), kFocal35, 1e-9) << path;
  EXPECT_NEAR(info.focal_mm.value_or(0), kFocal, 1e-3) << path;
  EXPECT_EQ(info.make, "Acme") << path;
  EXPECT_EQ(info.model, "Phone 7") << path;
  EXPECT_EQ(info.orientation, orientation) << path;
  EXPECT_EQ(info.capture_time.value_or(""), "2024:05:06 07:08:09") << path;
}

TEST(PictureInfo, OneDoorForExifWhateverHoldsIt) {
  const TempFolder folder;
  WriteWithExif(folder / "a.jpg", PhoneSpec());
  ExpectPhone(folder / "a.jpg", 6);
  WriteWithExif(folder / "deep.tif", PhoneSpec(OIIO::TypeDesc::UINT16));
  ExpectPhone(folder / "deep.tif", 6);

  WriteImage(folder / "a.png", ColorfulImage(64, 48));
  AddExifToPng(folder / "a.png",
               ExifBlock({Ascii(271, "Acme"), Ascii(272, "Phone 7"), Shorts(274, {6})},
                         {Ascii(0x9003, "2024:05:06 07:08:09"), Rationals(0x920A, {kFocal}), Shorts(0xA405, {26})}));
  ExpectPhone(folder / "a.png", 6);
  EXPECT_EQ(ReadImage8(folder / "a.png").data, ColorfulImage(64, 48).data);
}

TEST(PictureInfo, WhereAPhotoWasTaken) {
  const TempFolder folder;
  OIIO::ImageSpec spec = PhoneSpec();
  const float latitude[] = {48, 30, 36}, longitude[] = {9, 15, 0};
  const OIIO::TypeDesc three(OIIO::TypeDesc::FLOAT, 3);
  spec.attribute("GPS:LatitudeRef", "S");
  spec.attribute("GPS:Latitude", three, latitude);
  spec.attribute("GPS:LongitudeRef", "E");
  spec.attribute("GPS:Longitude", three, longitude);
  spec.attribute("GPS:Altitude", 612.5F);
  WriteWithExif(folder / "a.jpg", spec);
  const auto gps = ReadImageInfo(folder / "a.jpg").gps;
  ASSERT_TRUE(gps);
  EXPECT_NEAR(gps->latitude_deg, -48.51, 1e-5);
  EXPECT_NEAR(gps->longitude_deg, 9.25, 1e-5);
  EXPECT_NEAR(gps->altitude_m.value_or(0), 612.5, 0.01);
  WriteWithExif(folder / "b.jpg", PhoneSpec());
  EXPECT_FALSE(ReadImageInfo(folder / "b.jpg").gps);
}

void ExpectGps(const fs::path& path, double altitude_m = -12.5) {
  const auto gps = ReadImageInfo(path).gps;
  ASSERT_TRUE(gps) << path;
  EXPECT_NEAR(gps->latitude_deg, -48.51, 1e-5) << path;
  EXPECT_NEAR(gps->longitude_deg, 9.25, 1e-5) << path;
  EXPECT_NEAR(gps->altitude_m.value_or(0), altitude_m, 0.01) << path;
}

TEST(PictureInfo, WhereAPhotoWasTakenWhateverHoldsIt) {
  const TempFolder folder;
  WriteImage(folder / "a.png", ColorfulImage(64, 48));
  AddExifToPng(folder / "a.png", ExifBlock({Ascii(271, "Acme")}, {Rationals(0x920A, {kFocal})}, GpsFields()));
  ExpectGps(folder / "a.png");
  WriteTiffWithGps(folder / "a.tif");
  EXPECT_EQ(ReadImage8(folder / "a.tif").At(8, 8, 1), 0x80);
  ExpectGps(folder / "a.tif");
  if (CanReadRaw()) {
    WriteDng(folder / "a.dng", 96, 64, {0.5, 0.2, 0.1});
    ExpectGps(folder / "a.dng");
  }
  // By OpenImageIO 2.4's writer, which keeps the height above the sea and not whether it is below.
  for (const char* name : {"place.heic", "place.avif"})
    ExpectGps(fs::path(LUMI_SOURCE_DIR) / "tests/scene" / name, 12.5);
  // Cut off anywhere before the pixels: refused or without a place, never another one.
  const std::string whole = Read(folder / "a.tif");
  for (std::size_t n = 0; n + 256 < whole.size(); n += 7) {
    Write(folder / "b.tif", whole.substr(0, n));
    try {
      if (const auto gps = ReadImageInfo(folder / "b.tif").gps) {
        EXPECT_NEAR(gps->latitude_deg, -48.51, 1e-5);
      }
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kCorruptInput);
    }
  }
}

// Single-lens reflex cameras tell the sensor's resolution in place of the focal length on film.
TEST(PictureInfo, AFocalLengthOnFilmComesFromTheSensorWhereExifLacksIt) {
  const TempFolder folder;
  OIIO::ImageSpec spec(60, 40, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Exif:FocalLength", 50.0F);
  spec.attribute("Exif:FocalPlaneResolutionUnit", 2);
  spec.attribute("Exif:PixelXDimension", 60);
  spec.attribute("Exif:PixelYDimension", 40);
  spec.attribute("Exif:FocalPlaneXResolution", 60 / (22.4F / 25.4F));  // APS-C: 22.4 mm wide
  WriteWithExif(folder / "a.jpg", spec);
  const ImageInfo info = ReadImageInfo(folder / "a.jpg");
  EXPECT_NEAR(info.focal_35mm.value_or(0), 50 / 22.4 * 35, 0.05);
  spec.attribute("Exif:FocalPlaneXResolution", 72.0F);  // a screen's, not a sensor's: 21 mm by chance is one ...
  spec.attribute("Exif:PixelXDimension", 6000);         // ... this is none
  WriteWithExif(folder / "b.jpg", spec);
  EXPECT_FALSE(ReadImageInfo(folder / "b.jpg").focal_35mm);
  EXPECT_NEAR(ReadImageInfo(folder / "b.jpg").focal_mm.value_or(0), 50, 1e-3);
}

// A phone's portrait photo: the container turns the picture by 90 degrees, its EXIF repeats it as orientation 6, its
// colours are in Display P3's profile. 64 x 48 as stored: green left of red, blue left of white.
// tests/scene/phone.avif: PhoneSpec's tags over ColorfulImage(64, 48), by OpenImageIO 2.4; Debian 13's libheif comes
// without an encoder.
TEST(PictureInfo, OfAvif) {
  const fs::path avif = fs::path(LUMI_SOURCE_DIR) / "tests/scene/phone.avif";
  // The container turns; OpenImageIO's writer states no turn, and EXIF's is none then.
  const ImageInfo info = ReadImageInfo(avif);
  EXPECT_EQ(info.orientation, 1);
  EXPECT_EQ(info.model, "Phone 7");
  EXPECT_NEAR(info.focal_35mm.value_or(0), kFocal35, 1e-9);
  const Image8 picture = ReadImage8(avif), truth = ColorfulImage(64, 48);
  double difference = 0;
  ASSERT_EQ(picture.data.size(), truth.data.size());
  for (std::size_t i = 0; i < truth.data.size(); ++i) difference += std::abs(picture.data[i] - truth.data[i]);
  EXPECT_LT(difference / static_cast<double>(truth.data.size()), 12);  // chroma of 2 x 2 pixels, compressed
}

TEST(PictureInfo, HeicComesUprightOnceAndInSrgb) {
  const fs::path heic = fs::path(LUMI_SOURCE_DIR) / "tests/scene/portrait_p3.heic";
  ExpectPhone(heic, 1);
  const ImageInfo info = ReadImageInfo(heic);
  EXPECT_EQ(info.width, 48);
  EXPECT_EQ(info.height, 64);
  const Image8 image = ReadImage8(heic);
  ASSERT_EQ(image.width, 48);
  // P3 (200, 60, 60) lies within sRGB: (217, 42, 52) there.
  constexpr int kCompression = 4;  // code values, in the middle of a field
  const int expected[] = {217, 42, 52};
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.At(36, 16, c), expected[c], kCompression) << c;
}

// HEIC and AVIF have their own way to the decoder: the same pixels come out of it.
TEST(PictureInfo, HeifIsDecodedAsOpenImageIODoesIt) {
  for (const char* name : {"place.heic", "phone.avif"}) {
    const fs::path path = fs::path(LUMI_SOURCE_DIR) / "tests/scene" / name;
    const auto in = OIIO::ImageInput::open(path.string());
    ASSERT_TRUE(in) << name;
    Image8 expected(in->spec().width, in->spec().height, in->spec().nchannels);
    ASSERT_TRUE(in->read_image(0, 0, 0, expected.channels, OIIO::TypeDesc::UINT8, expected.data.data()));
    const Image8 image = ReadImage8(path), with_alpha = ReadImage8(path, 4);
    EXPECT_EQ(image.data, expected.data) << name;
    const ImageF values = ReadImageF(path);
    ASSERT_EQ(values.data.size(), image.data.size()) << name;
    for (std::size_t i = 0; i < image.data.size(); ++i)
      ASSERT_EQ(values.data[i], static_cast<float>(image.data[i]) / 255.0F) << name;
    EXPECT_EQ(with_alpha.At(8, 8, 1), image.At(8, 8, 1)) << name;
    EXPECT_EQ(with_alpha.At(8, 8, 3), 255) << name;
  }
}

void ExpectCorrupt(const fs::path& path, const std::string& words) {
  try {
    ReadImage8(path);
    ADD_FAILURE() << path << " was read";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
  }
}

TEST(PictureInfo, DamagedHeifIsRefused) {
  // Found by fuzzing: OpenImageIO 2.4 reads beyond the decoded picture.
  ExpectCorrupt(fs::path(LUMI_SOURCE_DIR) / "tests/fuzz/regressions/photo/heif_picture_smaller_than_stated",
                "a picture of 64 x 48 pixels in a container that states 48 x 16384");
  const TempFolder folder;
  const std::string whole = Read(fs::path(LUMI_SOURCE_DIR) / "tests/scene/place.heic");
  Write(folder / "late.heic", std::string("\0\0\0\x08", 4) + "free" + whole);
  ExpectCorrupt(folder / "late.heic", "is not a picture that can be read");
  Write(folder / "film.heic", std::string("\0\0\0\x18", 4) + "ftypisom" + std::string(4, '\0') + "isomiso2");
  ExpectCorrupt(folder / "film.heic", "supported brands");
  for (std::size_t n = 0; n < whole.size(); n += 5) {
    Write(folder / "cut.heic", whole.substr(0, n));
    EXPECT_THROW(ReadImage8(folder / "cut.heic"), InputError) << n << " of " << whole.size() << " bytes";
  }
}

TEST(PictureInfo, RawIsDevelopedWithItsWhiteBalanceToSrgb) {
  if (!CanReadRaw()) GTEST_SKIP() << "this OpenImageIO was built without LibRaw";
  EXPECT_TRUE(HasImageExtension("DSC_0001.NEF"));
  const TempFolder folder;
  WriteDng(folder / "a.dng", 96, 64, {0.5, 0.2, 0.1});
  const ImageInfo info = ReadImageInfo(folder / "a.dng");
  EXPECT_EQ(info.width, 96);
  EXPECT_NEAR(info.focal_35mm.value_or(0), 28, 1e-6);
  EXPECT_EQ(info.model, "Test Camera");
  const Image8 image = ReadImage8(folder / "a.dng");
  const int expected[] = {188, 124, 89};  // sRGB's curve of the linear values
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.At(48, 32, c), expected[c], 3) << c;
  // Portrait: LibRaw turns the pixels, so that nothing is left to turn.
  WriteDng(folder / "b.dng", 96, 64, {0.5, 0.2, 0.1}, 6);
  const ImageInfo turned = ReadImageInfo(folder / "b.dng");
  EXPECT_EQ(turned.orientation, 1);
  EXPECT_EQ(turned.width, 64);
  EXPECT_EQ(ReadImage8(folder / "b.dng").width, 64);
}

// --- colours -----------------------------------------------------------------------------------------------------

std::string ProfileBytes(cmsHPROFILE profile) {
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  return bytes;
}
std::string RgbProfile(const cmsCIExyYTRIPLE& primaries, cmsToneCurve* curve) {
  const cmsCIExyY d65{0.3127, 0.3290, 1};
  cmsToneCurve* curves[] = {curve, curve, curve};
  const std::string bytes = ProfileBytes(cmsCreateRGBProfile(&d65, &primaries, curves));
  cmsFreeToneCurve(curve);
  return bytes;
}
cmsToneCurve* SrgbCurve() {
  const double parameters[] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  return cmsBuildParametricToneCurve(nullptr, 4, parameters);
}
std::string DisplayP3Profile() { return RgbProfile({{0.68, 0.32, 1}, {0.265, 0.69, 1}, {0.15, 0.06, 1}}, SrgbCurve()); }
constexpr double kAdobeGamma = 2.19921875;
std::string AdobeRgbProfile() {
  return RgbProfile({{0.64, 0.33, 1}, {0.21, 0.71, 1}, {0.15, 0.06, 1}}, cmsBuildGamma(nullptr, kAdobeGamma));
}

double SrgbEncoded(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
}
double SrgbLinear(double code) {
  const double x = code / 255;
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

// Against closed forms, published to four digits: what the same light is in sRGB.
void ExpectConverted(const std::string& ending, const std::string& profile, const Eigen::Matrix3d& srgb_from_linear,
                     double (*linear)(double code), int channels) {
  const TempFolder folder;
  constexpr int kSteps = 6;
  Image8 patches(kSteps * kSteps, kSteps, 3);
  for (int r = 0; r < kSteps; ++r)
    for (int g = 0; g < kSteps; ++g)
      for (int b = 0; b < kSteps; ++b) {
        const int codes[] = {r, g, b};
        for (int c = 0; c < 3; ++c)
          patches.At(g * kSteps + b, r, c) = static_cast<std::uint8_t>(codes[c] * 255 / (kSteps - 1));
      }
  OIIO::ImageSpec spec(patches.width, patches.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())), profile.data());
  const fs::path path = folder / ("patches" + ending);
  const auto out = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(out && out->open(path.string(), spec) && out->write_image(OIIO::TypeDesc::UINT8, patches.data.data()) &&
              out->close());
  const Image8 read = ReadImage8(path, channels);
  constexpr double kCodes = 2;
  for (int y = 0; y < patches.height; ++y)
    for (int x = 0; x < patches.width; ++x) {
      const Eigen::Vector3d light(linear(patches.At(x, y, 0)), linear(patches.At(x, y, 1)),
                                  linear(patches.At(x, y, 2)));
      const Eigen::Vector3d expected = srgb_from_linear * light;
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(read.At(x, y, c), SrgbEncoded(expected[c]), kCodes) << x << " " << y;
      if (channels == 4) {
        ASSERT_EQ(read.At(x, y, 3), 255);
      }
    }
}

TEST(Colors, DisplayP3AndAdobeRgbBecomeSrgb) {
  Eigen::Matrix3d p3, adobe;
  p3 << 1.2249, -0.2247, 0, -0.0420, 1.0419, 0, -0.0197, -0.0786, 1.0979;
  adobe << 1.3984, -0.3984, 0, 0, 1, 0, 0, -0.0429, 1.0429;
  for (const int channels : {3, 4})
    for (const char* ending : {".png", ".tif"}) {
      ExpectConverted(ending, DisplayP3Profile(), p3, SrgbLinear, channels);
      ExpectConverted(
          ending, AdobeRgbProfile(), adobe, [](double code) { return std::pow(code / 255, kAdobeGamma); }, channels);
    }
}

// As a camera that is set to Adobe RGB writes it: no profile, EXIF says "uncalibrated" and R03.
TEST(Colors, AdobeRgbThatExifAloneTells) {
  const TempFolder folder;
  const auto write = [&](const std::string& name, int space, const std::string& index) {
    Image8 image(64, 48, 3);
    for (std::size_t i = 0; i < image.data.size(); i += 3)
      image.data[i] = 200, image.data[i + 1] = 60, image.data[i + 2] = 60;
    WriteImage(folder / name, image, 100);
    const auto block = [&](std::size_t at) {
      return ExifBlock({Ascii(271, "Acme")}, {Shorts(0xA001, {space}), Long(0xA005, static_cast<std::uint32_t>(at))});
    };
    const std::size_t at = block(0).size();
    const std::string exif = std::string("Exif\0\0", 6) + block(at) + TiffDirectory({Ascii(1, index)}, at);
    std::string bytes = Read(folder / name);
    const std::size_t length = exif.size() + 2;
    bytes.insert(2, std::string("\xFF\xE1") + static_cast<char>(length >> 8) + static_cast<char>(length & 255) + exif);
    Write(folder / name, bytes);
    const Image8 read = ReadImage8(folder / name);
    return std::array<int, 3>{read.At(32, 24, 0), read.At(32, 24, 1), read.At(32, 24, 2)};
  };
  const double red = std::pow(200 / 255.0, kAdobeGamma), other = std::pow(60 / 255.0, kAdobeGamma);
  const double expected[] = {SrgbEncoded(1.3984 * red - 0.3984 * other), SrgbEncoded(other), SrgbEncoded(other)};
  const auto adobe = write("adobe.jpg", 65535, "R03"), srgb = write("srgb.jpg", 1, "R98"),
             unknown = write("unknown.jpg", 65535, "R98");
  const int stored[] = {200, 60, 60};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(adobe[c], expected[c], 3) << c;
    EXPECT_NEAR(srgb[c], stored[c], 2) << c;
    EXPECT_NEAR(unknown[c], stored[c], 2) << c;
  }
}

TEST(Colors, PixelsWithoutAProfileWithSrgbsAndWithABrokenOneStayAsTheyAre) {
  const TempFolder folder;
  const Image8 image = ColorfulImage(64, 48);
  OIIO::ImageSpec spec(64, 48, 3, OIIO::TypeDesc::UINT8);
  WriteWithExif(folder / "none.png", spec);
  EXPECT_EQ(ReadImage8(folder / "none.png").data, image.data);
  WriteWithExif(folder / "srgb.png", spec, ProfileBytes(cmsCreate_sRGBProfile()));
  EXPECT_EQ(ReadImage8(folder / "srgb.png").data, image.data);
  WriteWithExif(folder / "broken.tif", spec, std::string(200, 'x'));
  EXPECT_EQ(ReadImage8(folder / "broken.tif").data, image.data);
}

}  // namespace
}  // namespace lumi::test
