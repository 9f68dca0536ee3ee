#include "scene/files/image_io.h"

#include <OpenImageIO/imageio.h>

#include <cmath>

#include "files_test_util.h"

namespace lumi::test {
namespace {

template <typename T>
void WriteRaw(const fs::path& path, int width, int height, int channels, OIIO::TypeDesc type,
              const std::vector<T>& data) {
  auto out = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(out);
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  ASSERT_TRUE(out->open(path.string(), spec) && out->write_image(type, data.data()) && out->close()) << out->geterror();
}

double MeanAbsolute(const Image8& a, const Image8& b) {
  EXPECT_EQ(a.data.size(), b.data.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
  return sum / static_cast<double>(a.data.size());
}

TEST(ImageIo, PngIsLosslessAndJpegIsClose) {
  const TempFolder folder;
  const Image8 image = ColorfulImage(97, 61);
  WriteImage(folder / "a.png", image);
  EXPECT_EQ(ReadImage8(folder / "a.png").data, image.data);
  WriteImage(folder / "a.JPG", image, 95);
  constexpr double kJpegCodes = 1.5;  // mean code difference of quality 95 on smooth colours
  EXPECT_LT(MeanAbsolute(ReadImage8(folder / "a.JPG"), image), kJpegCodes);
  EXPECT_GT(fs::file_size(folder / "a.png"), 0u);
  const ImageInfo info = ReadImageInfo(folder / "a.JPG");
  EXPECT_EQ(info.width, 97);
  EXPECT_EQ(info.height, 61);
  EXPECT_EQ(info.channels, 3);
  EXPECT_EQ(info.orientation, 1);
}

TEST(ImageIo, TiffBmpTgaAndPpmAreLosslessToo) {
  const TempFolder folder;
  for (const int width : {24, 640})
    for (const char* ending : {"tif", "tiff", "bmp", "tga", "ppm"}) {
      const fs::path file = folder / (std::string("a.") + ending);
      const Image8 picture = ColorfulImage(width, 48);
      WriteImage(file, picture);
      EXPECT_EQ(ReadImage8(file).data, picture.data) << file << ", " << width << " wide";
    }
}

TEST(ImageIo, ExrKeepsFloatsExactly) {
  const TempFolder folder;
  ImageF image(5, 3, 1);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = -1.5f + 1000.0f * static_cast<float>(i);
  WriteImage(folder / "depth.exr", image);
  const ImageF back = ReadImageF(folder / "depth.exr");
  EXPECT_EQ(back.channels, 1);
  EXPECT_EQ(back.data, image.data);
}

TEST(ImageIo, SixteenBitsAreRoundedToTheNearestCode) {
  const TempFolder folder;
  std::vector<std::uint16_t> values;
  for (int i = 0; i < 65536; i += 7) values.push_back(static_cast<std::uint16_t>(i));
  const int width = static_cast<int>(values.size());
  WriteRaw(folder / "deep.png", width, 1, 1, OIIO::TypeDesc::UINT16, values);
  const Image8 image = ReadImage8(folder / "deep.png");
  ASSERT_EQ(image.channels, 3);
  for (int x = 0; x < width; ++x)
    for (int c = 0; c < 3; ++c)
      ASSERT_EQ(image.At(x, 0, c), std::lround(values[static_cast<std::size_t>(x)] / 257.0)) << x;
}

TEST(ImageIo, FloatsAreClampedAndWhatIsNoNumberIsBlack) {
  const TempFolder folder;
  WriteRaw<float>(folder / "f.exr", 6, 1, 1, OIIO::TypeDesc::FLOAT, {-1, 0, 0.5f, 1, 7, NAN});
  const Image8 image = ReadImage8(folder / "f.exr");
  const int expected[] = {0, 0, 128, 255, 255, 0};
  for (int x = 0; x < 6; ++x) EXPECT_EQ(image.At(x, 0, 1), expected[x]) << x;
}

TEST(ImageIo, GreyIsSpreadAndAlphaIsKeptOrDroppedWithoutTouchingTheColours) {
  const TempFolder folder;
  WriteRaw<std::uint8_t>(folder / "grey.png", 2, 1, 1, OIIO::TypeDesc::UINT8, {10, 200});
  EXPECT_EQ(ReadImage8(folder / "grey.png").data, (Image8::Values{10, 10, 10, 200, 200, 200}));
  EXPECT_EQ(ReadImage8(folder / "grey.png", 4).data, (Image8::Values{10, 10, 10, 255, 200, 200, 200, 255}));
  WriteRaw<std::uint8_t>(folder / "ga.png", 2, 1, 2, OIIO::TypeDesc::UINT8, {10, 0, 200, 90});
  EXPECT_EQ(ReadImage8(folder / "ga.png", 4).data, (Image8::Values{10, 10, 10, 0, 200, 200, 200, 90}));
  WriteRaw<std::uint8_t>(folder / "rgba.png", 2, 1, 4, OIIO::TypeDesc::UINT8, {10, 20, 30, 0, 200, 210, 220, 90});
  EXPECT_EQ(ReadImage8(folder / "rgba.png").data, (Image8::Values{10, 20, 30, 200, 210, 220}));
  EXPECT_EQ(ReadImage8(folder / "rgba.png", 4).data, (Image8::Values{10, 20, 30, 0, 200, 210, 220, 90}));
}

TEST(ImageIo, AnRgbaImageWrittenAsJpegLosesItsAlphaOnly) {
  const TempFolder folder;
  Image8 image(16, 16, 4, 100);
  WriteImage(folder / "a.jpg", image);
  const Image8 back = ReadImage8(folder / "a.jpg");
  constexpr double kFlatCodes = 1.0;
  EXPECT_LE(MeanAbsolute(back, Image8(16, 16, 3, 100)), kFlatCodes);
}

// A decoder fills up what is missing with grey: none of these may pass for a photograph.
TEST(ImageIo, ATruncatedPictureIsRefusedWhereverItIsCut) {
  const TempFolder folder;
  for (const char* name : {"a.jpg", "a.png"}) {
    WriteImage(folder / name, ColorfulImage(300, 200));
    const std::string whole = Read(folder / name);
    for (const double part : {0.0, 0.001, 0.02, 0.3, 0.5, 0.9, 0.99}) {
      Write(folder / name, whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
      EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadImage8(folder / name));
    }
    Write(folder / name, whole.substr(0, whole.size() - 2));
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadImage8(folder / name));
  }
}

TEST(ImageIo, APictureThatClaimsGigabytesIsRefusedBeforeTheyAreTaken) {
  const TempFolder folder;
  WriteImage(folder / "a.jpg", ColorfulImage(64, 48));
  std::string bytes = Read(folder / "a.jpg");
  const std::size_t frame = bytes.find("\xFF\xC0");  // length 2, precision 1, height 2, width 2
  ASSERT_NE(frame, std::string::npos);
  bytes.replace(frame + 5, 4, "\x7F\xFF\x3F\xFF");
  Write(folder / "a.jpg", bytes);
  EXPECT_REFUSED(ExitCode::kCorruptInput, "16383 x 32767", ReadImage8(folder / "a.jpg"));
}

// WebP's decoder takes the whole picture's memory while it opens the file: 16001 x 16002 pixels in each of its three
// kinds.
TEST(ImageIo, AWebpThatClaimsGigabytesIsRefusedBeforeTheDecoderOpensIt) {
  const TempFolder folder;
  const std::string riff("RIFF\x1e\0\0\0WEBP", 12);
  const std::string lossy("VP8 \x0a\0\0\0\x30\x0c\0\x9d\x01\x2a\x81\x3e\x82\x3e", 18);
  const std::string lossless("VP8L\x0a\0\0\0\x2f\x80\x7e\xa0\x0f\0\0\0\0\0", 18);
  const std::string extended("VP8X\x0a\0\0\0\0\0\0\0\x80\x3e\0\x81\x3e\0", 18);
  for (const std::string& chunk : {lossy, lossless, extended}) {
    Write(folder / "photo.webp", riff + chunk);
    EXPECT_REFUSED(ExitCode::kCorruptInput, "claims 16001 x 16002", ReadImageInfo(folder / "photo.webp"));
  }
  WriteImage(folder / "sound.webp", ColorfulImage(40, 30));
  EXPECT_EQ(ReadImage8(folder / "sound.webp").height, 30);
}

// OpenEXR's reader takes an attribute's memory before it looks whether the file goes on that long.
TEST(ImageIo, AnExrWhoseHeaderClaimsGigabytesIsRefusedBeforeTheyAreTaken) {
  const TempFolder folder;
  WriteImage(folder / "a.exr", ImageF(8, 6, 3));
  std::string bytes = Read(folder / "a.exr");
  const std::string name("compression\0compression\0", 24);
  const std::size_t at = bytes.find(name);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at + name.size(), 4, "\x00\x00\x00\x7F", 4);
  bytes.replace(at, 4, "comq");  // of no kind that the reader knows
  bytes.replace(at + 12, 4, "comq");
  Write(folder / "b.exr", bytes);
  EXPECT_REFUSED(ExitCode::kCorruptInput, "claims more than the file", ReadImageInfo(folder / "b.exr"));
  EXPECT_EQ(ReadImageF(folder / "a.exr").width, 8);
}

TEST(ImageIo, BytesAfterTheEndOfAJpegDoNoHarm) {
  const TempFolder folder;
  WriteImage(folder / "a.jpg", ColorfulImage(30, 20));
  const Image8 before = ReadImage8(folder / "a.jpg");
  Write(folder / "a.jpg", Read(folder / "a.jpg") + std::string(1000, '\0') + "a maker's own trailer");
  EXPECT_EQ(ReadImage8(folder / "a.jpg").data, before.data);
}

TEST(ImageIo, WhatIsNoPictureIsRefusedByName) {
  const TempFolder folder;
  Write(folder / "text.jpg", "Not a picture at all, in so many words.");
  Write(folder / "empty.png", "");
  for (const char* name : {"text.jpg", "empty.png", "absent.jpg"}) {
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadImage8(folder / name));
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadImageInfo(folder / name));
  }
  EXPECT_REFUSED(ExitCode::kCorruptInput, "folder", ReadImage8(folder.path()));
  EXPECT_REFUSED(ExitCode::kUsage, "a.xyz", WriteImage(folder / "a.xyz", ColorfulImage(4, 4)));
}

TEST(ImageIo, AFullDiskIsReportedForEveryFormatAndNothingStays) {
  const TempFolder folder;
  Image8 noise(200, 200, 3);
  std::mt19937 random(1);
  for (auto& v : noise.data) v = static_cast<std::uint8_t>(random());
  ImageF floats(200, 200, 3);
  for (auto& v : floats.data) v = static_cast<float>(random());
  const FileSizeLimit limit(4000);
  for (const char* name : {"a.png", "a.jpg", "a.tif"})
    EXPECT_REFUSED(ExitCode::kMachine, name, WriteImage(folder / name, noise));
  EXPECT_REFUSED(ExitCode::kMachine, "a.exr", WriteImage(folder / "a.exr", floats));
  EXPECT_EQ(CountFiles(folder.path()), 0u);
}

TEST(ImageIo, APyramidHalvesByTheMeanOfItsPixelsDownToOne) {
  Image8 image(4, 2, 1);
  image.data = {0, 10, 100, 200, 20, 30, 100, 200};
  const auto pyramid = BuildPyramid(image);
  ASSERT_EQ(pyramid.size(), 3u);
  EXPECT_EQ(pyramid[1].data, (Image8::Values{15, 150}));
  EXPECT_EQ(pyramid[2].width, 1);
  EXPECT_EQ(pyramid[2].height, 1);
  EXPECT_NEAR(pyramid[2].data[0], 82.5, 0.5);
  EXPECT_EQ(BuildPyramid(image, 2).size(), 2u);
  // Odd sizes: no pixel is lost, so a constant picture stays what it is and the mean is kept.
  const auto odd = BuildPyramid(ColorfulImage(37, 23));
  EXPECT_EQ(odd.back().width, 1);
  double mean = 0, top = 0;
  for (std::size_t i = 0; i < odd[0].data.size(); i += 3) mean += odd[0].data[i];
  mean /= 37 * 23;
  top = odd.back().data[0];
  constexpr double kRoundings = 3;  // half a code a level
  EXPECT_NEAR(top, mean, kRoundings);
}

TEST(ImageIo, ResizingKeepsAConstantColourAndAlternatingColumnsBecomeTheirMean) {
  const Image8 constant(31, 17, 3, 93);
  for (const auto& [w, h] : {std::pair{62, 40}, std::pair{10, 5}, std::pair{62, 5}, std::pair{31, 17}}) {
    const Image8 resized = Resize(constant, w, h);
    EXPECT_EQ(resized.width, w);
    EXPECT_EQ(resized.height, h);
    EXPECT_EQ(resized.data, Image8(w, h, 3, 93).data);
  }
  Image8 stripes(64, 8, 1);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 64; ++x) stripes.At(x, y, 0) = x % 2 ? 200 : 100;
  EXPECT_EQ(Resize(stripes, 16, 8).data, Image8(16, 8, 1, 150).data);
}

TEST(ImageIo, RealPhotosTellTheirFocalLength) {
  const fs::path photos = SharedData("sceaux/images");
  if (!fs::exists(photos)) GTEST_SKIP() << "no " << photos;
  for (const auto& entry : fs::directory_iterator(photos)) {
    if (!HasImageExtension(entry.path())) continue;
    const ImageInfo info = ReadImageInfo(entry.path());
    EXPECT_EQ(info.width, 2832);
    EXPECT_EQ(info.height, 2128);
    EXPECT_TRUE(info.capture_time.has_value());
    break;
  }
}

}  // namespace
}  // namespace lumi::test
