// A JPEG without what its pixels do not need.
#include "export/plain_jpeg.h"

#include <gtest/gtest.h>

#include "export/reduce_photos.h"

namespace lumi {
namespace {

std::string Segment(int marker, const std::string& content) {
  const std::size_t length = content.size() + 2;
  return std::string{'\xFF', static_cast<char>(marker), static_cast<char>(length >> 8),
                     static_cast<char>(length & 255U)} +
         content;
}

Image8 Picture() {
  Image8 image(37, 23, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<std::uint8_t>(i * i * 7 % 251);
  return image;
}

TEST(PlainJpeg, LosesWhatIsSaidOfThePhotoAndKeepsItsPixels) {
  const std::string jpeg = EncodeJpeg(Picture(), 80);
  // EXIF with an end of an image inside, a thumbnail, a profile, a comment, Adobe's; a film behind the end.
  const std::string adobe = Segment(0xEE, std::string("Adobe\0d\0\0\0\0\1", 12));
  const std::string file = jpeg.substr(0, 2) + Segment(0xE1, std::string("Exif\0\0GPS at home \xFF\xD9", 20)) +
                           Segment(0xE0, std::string("JFXX\0\x13thumb", 11)) + Segment(0xE2, "ICC_PROFILE") +
                           Segment(0xFE, "by somebody") + adobe + jpeg.substr(2) + "ftypmp42 a film";
  const auto plain = PlainJpeg(file);
  ASSERT_TRUE(plain);
  EXPECT_EQ(*plain, jpeg.substr(0, 2) + adobe + jpeg.substr(2));
  EXPECT_EQ(DecodeJpeg(*plain).data, DecodeJpeg(jpeg).data);
  EXPECT_EQ(PlainJpeg(jpeg), jpeg);
}

TEST(PlainJpeg, KeepsNoThumbnailOfJfif) {
  const std::string jpeg = EncodeJpeg(Picture(), 80);
  ASSERT_EQ(jpeg.substr(6, 4), "JFIF");
  const std::string head = jpeg.substr(6, 12), rest = jpeg.substr(20);
  const std::string file = jpeg.substr(0, 2) + Segment(0xE0, head + "\1\1" + "rgb") + rest;
  EXPECT_EQ(PlainJpeg(file), jpeg);
}

TEST(PlainJpeg, IsNothingWhereAFileIsCutOffAnywhereOrIsNoJpeg) {
  const std::string jpeg = EncodeJpeg(Picture(), 80);
  for (std::size_t n = 0; n < jpeg.size(); ++n) EXPECT_FALSE(PlainJpeg(jpeg.substr(0, n))) << n;
  EXPECT_FALSE(PlainJpeg("\x89PNG\r\n"));
  EXPECT_FALSE(PlainJpeg(std::string(jpeg).replace(2, 1, "x")));
  // What stands in a scan alone.
  for (const char* alone : {"\xFF\x01", "\xFF\xD3", "\xFF\xD8"})
    EXPECT_FALSE(PlainJpeg(jpeg.substr(0, 2) + alone + jpeg.substr(2)));
  EXPECT_FALSE(PlainJpeg(jpeg.substr(0, 2) + std::string("\xFF\0", 2) + jpeg.substr(2)));
  // A segment that says it is longer than the file, or shorter than its own length.
  EXPECT_FALSE(PlainJpeg(std::string("\xFF\xD8\xFF\xE0\xFF\xFF", 6) + jpeg.substr(2)));
  EXPECT_FALSE(PlainJpeg(std::string("\xFF\xD8\xFF\xE0\x00\x01", 6) + jpeg.substr(2)));
}

}  // namespace
}  // namespace lumi
