// Interlaced video: every other line is filmed half a frame later, and may be coded as a picture of its own.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "coded_fields.h"
#include "scene/image_difference/image_difference.h"
#include "textured_frames.h"
#include "video_clips.h"

namespace lumi::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kWide = 160, kHigh = 96, kFilmed = 30;
constexpr double kPanPx = 2.5;  // a field
// Of a picture with the one that was filmed at its moment; a frame of two fields has 28, a picture of the other
// field 25.
constexpr double kSameMomentDb = 35;

// A pan over a texture, at the moment of a field.
Image8 Filmed(int field, double pan_px = kPanPx, int width = kWide, int height = kHigh) {
  const Image8 grey = TexturedFrame(width, height, field, [&](int n, const Eigen::Vector2d& x) -> Eigen::Vector2d {
    return {x.x() + pan_px * n, x.y() + 0.3 * pan_px * n};
  });
  Image8 picture(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) picture.At(x, y, c) = grey.At(x, y, 0);
  return picture;
}

// Frames of two fields: lines 0, 2 ... are filmed first (or 1, 3 ...).
std::vector<Image8> Woven(bool lower_first, double pan_px = kPanPx, int width = kWide, int height = kHigh) {
  std::vector<Image8> frames;
  for (int i = 0; i < kFilmed; ++i) {
    Image8 frame = Filmed(2 * i, pan_px, width, height);
    const Image8 later = Filmed(2 * i + 1, pan_px, width, height);
    for (int y = lower_first ? 0 : 1; y < height; y += 2) std::copy_n(later.Row(y), 3 * width, frame.Row(y));
    frames.push_back(std::move(frame));
  }
  return frames;
}
std::vector<Image8> Whole() {
  std::vector<Image8> frames;
  for (int i = 0; i < kFilmed; ++i) frames.push_back(Filmed(2 * i));
  return frames;
}

// FFmpeg's encoders take the order of the fields from the frames.
const std::vector<std::string> kUpperFirst{"-vf",     "setfield=tff", "-pix_fmt", "yuv420p",      "-c:v",
                                           "libx264", "-qp",          "0",        "-x264-params", "tff=1"};
const std::vector<std::string> kLowerFirst{"-vf",     "setfield=bff", "-pix_fmt", "yuv420p",      "-c:v",
                                           "libx264", "-qp",          "0",        "-x264-params", "bff=1"};
const std::vector<std::string> kMpeg2{"-vf", "setfield=tff", "-pix_fmt",    "yuv420p", "-c:v", "mpeg2video", "-q:v",
                                      "2",   "-flags",       "+ilme+ildct", "-top",    "1"};
const std::vector<std::string> kOneMoment{"-pix_fmt", "yuv420p", "-c:v", "libx264", "-qp", "0"};

void EncodeAs(const fs::path& film, const std::vector<Image8>& frames, std::vector<std::string> arguments) {
  arguments.push_back(film.string());
  Encode(film.parent_path() / "raw", frames, arguments);
}

std::vector<Image8> PicturesOf(const fs::path& film) {
  std::vector<Image8> pictures;
  VideoReader reader(film);
  while (auto frame = reader.Next()) pictures.push_back(std::move(frame->rgb));
  return pictures;
}

double Psnr(const Image8& a, const Image8& b) { return Compare(a, b).psnr_db; }

TEST(InterlacedVideo, FramesBecomePicturesOfOneMoment) {
  const TempFolder folder;
  const struct {
    const char* file;
    bool lower_first;
    const std::vector<std::string>& arguments;
  } cases[] = {{"upper.mp4", false, kUpperFirst}, {"lower.mp4", true, kLowerFirst}, {"v.ts", false, kMpeg2}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.file);
    const std::vector<Image8> woven = Woven(c.lower_first);
    EncodeAs(folder / c.file, woven, c.arguments);
    const ReadVideo read = ReadAll(folder / c.file);
    EXPECT_THAT(read.remarks, ElementsAre(HasSubstr("interlaced")));
    ASSERT_EQ(read.time_s.size(), woven.size());
    const VideoTimes times = ReadVideoTimes(folder / c.file);
    for (std::size_t i = 0; i < woven.size(); ++i) {
      EXPECT_NEAR(read.time_s[i], static_cast<double>(i) / 25, 1e-3);
      EXPECT_NEAR(times.time_s[i], read.time_s[i], 1e-6);
    }
    const std::vector<Image8> pictures = PicturesOf(folder / c.file);
    for (std::size_t i = 1; i + 1 < woven.size(); ++i) {
      const Image8 moment = Filmed(2 * static_cast<int>(i));
      EXPECT_LT(Psnr(woven[i], moment), kSameMomentDb - 5);
      EXPECT_GT(Psnr(pictures[i], moment), kSameMomentDb) << "frame " << i;
    }
  }
}

TEST(InterlacedVideo, WhatIsMarkedSoAndIsOfOneMomentStaysAsItIs) {
  const TempFolder folder;
  EncodeAs(folder / "v.mp4", Whole(), kUpperFirst);
  EncodeAs(folder / "unmarked.mp4", Whole(), kOneMoment);
  EXPECT_THAT(ReadAll(folder / "v.mp4").remarks, IsEmpty());
  const std::vector<Image8> pictures = PicturesOf(folder / "v.mp4"), others = PicturesOf(folder / "unmarked.mp4");
  ASSERT_EQ(pictures.size(), others.size());
  // Chroma of interlaced 4:2:0 is placed otherwise; the frames are grey.
  for (std::size_t i = 0; i < pictures.size(); ++i) EXPECT_GT(Psnr(pictures[i], others[i]), 50) << i;
}

// A single marked frame tells nothing: what was found before holds.
TEST(InterlacedVideo, OneFrameIsNoVerdict) {
  const TempFolder folder;
  EncodeAs(folder / "marked.ts", Whole(), kUpperFirst);
  EncodeAs(folder / "one.ts", {Filmed(0)}, kOneMoment);
  EncodeAs(folder / "one-marked.ts", {Filmed(0)}, kUpperFirst);
  std::string bytes;
  for (const char* part : {"marked.ts", "one.ts", "one-marked.ts", "one.ts", "marked.ts"}) bytes += Read(folder / part);
  Write(folder / "joined.ts", bytes);
  const ReadVideo read = ReadAll(folder / "joined.ts");
  EXPECT_EQ(read.time_s.size(), 2 * kFilmed + 3U);
  EXPECT_THAT(read.remarks, testing::Not(testing::Contains(HasSubstr("interlaced"))));
}

TEST(InterlacedVideo, WhatDoesNotMoveKeepsItsLines) {
  const TempFolder folder;
  const std::vector<Image8> still(kFilmed, Filmed(0));
  EncodeAs(folder / "v.mp4", still, kUpperFirst);
  for (const Image8& picture : PicturesOf(folder / "v.mp4")) EXPECT_GT(Psnr(picture, still[0]), 40);
}

TEST(InterlacedVideo, SizesAndScansMayChangeInsideAFilm) {
  const TempFolder folder;
  EncodeAs(folder / "whole.ts", Whole(), kOneMoment);
  EncodeAs(folder / "woven.ts", Woven(false), kUpperFirst);
  EncodeAs(folder / "small.ts", Woven(false, kPanPx, 96, 64), kUpperFirst);
  for (const auto& parts : {std::vector<std::string>{"whole.ts", "woven.ts"},
                            {"woven.ts", "small.ts"},
                            {"small.ts", "woven.ts", "small.ts"},
                            {"woven.ts", "whole.ts", "small.ts", "woven.ts"}}) {
    SCOPED_TRACE(testing::PrintToString(parts));
    std::string bytes;
    for (const std::string& part : parts) bytes += Read(folder / part);
    Write(folder / "joined.ts", bytes);
    const ReadVideo read = ReadAll(folder / "joined.ts");
    EXPECT_THAT(read.remarks, testing::Contains(HasSubstr("interlaced")));
    const std::vector<Image8> pictures = PicturesOf(folder / "joined.ts");
    ASSERT_EQ(pictures.size(), parts.size() * kFilmed);
    for (std::size_t part = 0; part < parts.size(); ++part) {
      if (parts[part] == "small.ts") continue;  // all parts show the same pan; these are not as sharp
      for (int i = 0; i < kFilmed; ++i) {
        const Image8 moment = Resize(Filmed(2 * i), pictures[0].width, pictures[0].height);
        EXPECT_GT(Psnr(pictures[part * kFilmed + static_cast<std::size_t>(i)], moment), kSameMomentDb)
            << parts[part] << " " << i;
      }
    }
  }
}

// ---- fields that are coded as pictures of their own

int LumaOf(double field) { return 16 + static_cast<int>(std::lround((kFirstGrey + kGreyStep * field) * 219 / 255)); }

void ExpectNumbered(const fs::path& film, int frames) {
  const ReadVideo read = ReadAll(film);
  const VideoTimes times = ReadVideoTimes(film);
  ASSERT_EQ(read.number.size(), static_cast<std::size_t>(frames));
  ASSERT_EQ(times.time_s.size(), read.time_s.size());
  EXPECT_EQ(times.times_made_up, 0);
  EXPECT_TRUE(times.constant);
  EXPECT_NEAR(times.fps, 25, 1e-9);
  for (int i = 0; i < frames; ++i) {
    const auto n = static_cast<std::size_t>(i);
    EXPECT_EQ(read.number[n], i);
    EXPECT_NEAR(read.time_s[n], i / 25.0, 1e-4);
    EXPECT_NEAR(times.time_s[n], i / 25.0, 1e-4);
  }
  EXPECT_THAT(read.remarks, ElementsAre(HasSubstr("interlaced")));
  EXPECT_FALSE(read.truncated);
  EXPECT_NEAR(static_cast<double>(read.hint), frames, 1);
  EXPECT_NEAR(VideoReader(film).fps(), 25, 0.1);
}

// AVCHD: one time for both fields, the second's packet has none.
TEST(InterlacedVideo, TwoCodedFieldsAreOneFrame) {
  const TempFolder folder;
  constexpr int kFrames = 30;
  for (int i = 0; i < kFrames; ++i)
    Write(folder / ("f" + std::to_string(100 + i) + ".264"), FieldCoder::Frame(i, LumaOf(i), LumaOf(i + 0.5)));
  Ffmpeg({"-f", "image2", "-framerate", "25", "-start_number", "100", "-c:v", "h264", "-i", folder / "f%03d.264", "-c",
          "copy", folder / "v.m2ts"});
  ExpectNumbered(folder / "v.m2ts", kFrames);
  // In a file that keeps both fields of a frame together.
  Ffmpeg({"-f", "image2", "-framerate", "25", "-start_number", "100", "-c:v", "h264", "-i", folder / "f%03d.264", "-c",
          "copy", folder / "v.mkv"});
  ExpectNumbered(folder / "v.mkv", kFrames);
}

// Broadcasts: each field has its time.
TEST(InterlacedVideo, CodedFieldsMayHaveTimesOfTheirOwn) {
  const TempFolder folder;
  constexpr int kFrames = 30;
  std::string bytes;
  for (int i = 0; i < kFrames; ++i) bytes += FieldCoder::Frame(i, LumaOf(i), LumaOf(i + 0.5));
  Write(folder / "v.264", bytes);
  Ffmpeg({"-f", "h264", "-framerate", "50", "-i", folder / "v.264", "-c", "copy", "-bsf:v",
          "setts=ts=N*1800:time_base=1/90000", folder / "v.ts"});
  ExpectNumbered(folder / "v.ts", kFrames);
  // Copied into a file that counts what it holds: fields.
  Ffmpeg({"-i", folder / "v.ts", "-c", "copy", folder / "v.mp4"});
  ExpectNumbered(folder / "v.mp4", kFrames);
}

TEST(InterlacedVideo, AfterALostFieldFramesAreFoundAgain) {
  constexpr int kFrames = 30, kLost = 10;
  for (const bool lost_is_second : {false, true}) {
    SCOPED_TRACE(lost_is_second);
    const TempFolder folder;
    for (int i = 0; i < kFrames; ++i) {
      const std::string other = FieldCoder::Field(i, !lost_is_second, LumaOf(lost_is_second ? i : i + 0.5));
      Write(folder / ("f" + std::to_string(100 + i) + ".264"),
            i == kLost ? other : FieldCoder::Frame(i, LumaOf(i), LumaOf(i + 0.5)));
    }
    Ffmpeg({"-f", "image2", "-framerate", "25", "-start_number", "100", "-c:v", "h264", "-i", folder / "f%03d.264",
            "-c", "copy", folder / "v.m2ts"});
    const ReadVideo read = ReadAll(folder / "v.m2ts");
    const VideoTimes times = ReadVideoTimes(folder / "v.m2ts");
    ASSERT_EQ(times.time_s.size(), read.time_s.size());
    ASSERT_GE(read.number.size(), static_cast<std::size_t>(kFrames - 1));
    EXPECT_EQ(read.number.back(), kFrames - 1);
    for (std::size_t i = 0; i < read.number.size(); ++i) {
      EXPECT_NEAR(read.time_s[i], times.time_s[i], 1e-4) << i;
      if (std::abs(read.number[i] - kLost) > 1) EXPECT_NEAR(read.time_s[i], read.number[i] / 25.0, 1e-4) << i;
    }
  }
}

}  // namespace
}  // namespace lumi::test
