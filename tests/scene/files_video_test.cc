#include "scene/files/video.h"

#include <malloc.h>

#include <cmath>
#include <random>
#include <set>

#include "scene/files/provenance.h"
#include "scene/program/error.h"
#include "video_clips.h"

namespace lumi::test {
namespace {

// A frame whose brightness tells its number.
Image8 NumberedFrame(int width, int height, int index) {
  return Image8(width, height, 3, static_cast<std::uint8_t>(40 + 8 * index));
}

constexpr double kCodeTolerance = 3;  // of H.264 at crf 18 and 8-bit YCbCr on flat frames

TEST(Video, FramesComeBackInOrderWithTheirTimes) {
  const TempFolder folder;
  VideoWriter writer(folder / "sub/v.mp4", 25);
  for (int i = 0; i < 20; ++i) writer.Add(NumberedFrame(64, 48, i));
  EXPECT_FALSE(fs::exists(folder / "sub/v.mp4"));
  writer.Finish();
  EXPECT_EQ(CountFiles(folder / "sub"), 1u);

  VideoReader reader(folder / "sub/v.mp4");
  EXPECT_EQ(reader.fps(), 25);
  EXPECT_EQ(reader.width(), 64);
  EXPECT_EQ(reader.height(), 48);
  EXPECT_EQ(reader.frame_count_hint(), 20);
  for (int i = 0; i < 20; ++i) {
    if (i % 3 == 1) {
      ASSERT_TRUE(reader.Skip());
      continue;
    }
    const auto frame = reader.Next();
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->index, i);
    constexpr double kMillisecond = 1e-3;
    EXPECT_NEAR(frame->time_s, i / 25.0, kMillisecond);
    EXPECT_NEAR(frame->rgb.At(30, 20, 1), 40 + 8 * i, kCodeTolerance);
  }
  EXPECT_FALSE(reader.Next());
  EXPECT_FALSE(reader.Skip());
  EXPECT_EQ(reader.frames_read(), 20);
  EXPECT_FALSE(reader.truncated());
}

TEST(Video, FilmsOfThisSuiteAreKnownAgain) {
  const TempFolder folder;
  VideoWriter writer(folder / "v.mp4", 25);
  for (int i = 0; i < 5; ++i) writer.Add(NumberedFrame(64, 48, i));
  writer.Finish();
  RequireOurFilm(folder / "v.mp4");
  RequireOurFilm(folder / "new.mp4");
  // As a film gets its sound.
  Ffmpeg({"-i", folder / "v.mp4", "-f", "lavfi", "-i", "sine=d=0.2", "-c:v", "copy", folder / "sound.mp4"});
  RequireOurFilm(folder / "sound.mp4");
  Ffmpeg({"-i", folder / "v.mp4", "-map_metadata", "-1", "-c", "copy", folder / "other.mp4"});
  EXPECT_THROW(RequireOurFilm(folder / "other.mp4"), UsageError);
  // A scene's own, as its record has it.
  Provenance record;
  record.stage = "video";
  record.outputs["other.mp4"] = Fingerprint(folder / "other.mp4");
  WriteProvenance(folder.path(), record);
  RequireOurFilm(folder / "other.mp4");
  Ffmpeg({"-i", folder / "v.mp4", "-map_metadata", "-1", folder / "other.mp4"});
  EXPECT_THROW(RequireOurFilm(folder / "other.mp4"), UsageError);
  Write(folder / "text.mp4", "years of work");
  EXPECT_THROW(RequireOurFilm(folder / "text.mp4"), UsageError);
  EXPECT_THROW(RequireOurFilm(folder.path()), UsageError);
}

// Whatever the memory held before: an encoder that reads what it has not written makes another film each time.
TEST(Video, TheSameFramesAreTheSameBytes) {
#if defined(__GLIBC__)
  const TempFolder folder;
  std::mt19937 random(1);
  std::vector<Image8> frames;
  for (int i = 0; i < 8; ++i) {
    Image8& frame = frames.emplace_back(320, 240, 3);
    for (int y = 0; y < frame.height; ++y)
      for (int x = 0; x < frame.width; ++x)
        for (int c = 0; c < 3; ++c)
          frame.At(x, y, c) = static_cast<std::uint8_t>(
              128 + 80 * std::sin(0.13 * (x + 3 * i) + c) * std::cos(0.07 * y - 0.2 * i) + random() % 16);
  }
  std::set<std::string> films;
  for (const int fill : {0, 85, 170, 255}) {
    ASSERT_EQ(mallopt(M_PERTURB, fill), 1);  // of memory as it is given out
    const fs::path file = folder / (std::to_string(fill) + ".mp4");
    VideoWriter writer(file, 25);
    for (const Image8& frame : frames) writer.Add(frame);
    writer.Finish();
    films.insert(ReadText(file));
  }
  mallopt(M_PERTURB, 0);
  EXPECT_EQ(films.size(), 1U);
#else
  GTEST_SKIP() << "this C library cannot fill the memory that it gives out";
#endif
}

TEST(Video, ColoursKeepTheirOrder) {
  const TempFolder folder;
  Image8 frame(64, 48, 3);
  const std::uint8_t colors[3][3] = {{200, 40, 40}, {40, 200, 40}, {40, 40, 200}};
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      for (int c = 0; c < 3; ++c) frame.At(x, y, c) = colors[std::min(2, x / 22)][c];
  VideoWriter writer(folder / "v.mp4", 30);
  for (int i = 0; i < 5; ++i) writer.Add(frame);
  writer.Finish();
  const auto back = VideoReader(folder / "v.mp4").Next();
  ASSERT_TRUE(back);
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(back->rgb.At(10 + 22 * k, 24, c), colors[k][c], 2 * kCodeTolerance) << k << c;
}

TEST(Video, OddSizesArePadded) {
  const TempFolder folder;
  VideoWriter writer(folder / "v.mp4", 30);
  for (int i = 0; i < 3; ++i) writer.Add(NumberedFrame(33, 27, i));
  writer.Finish();
  VideoReader reader(folder / "v.mp4");
  EXPECT_EQ(reader.width(), 34);
  EXPECT_EQ(reader.height(), 28);
  const auto frame = reader.Next();
  EXPECT_NEAR(frame->rgb.At(33, 27, 0), 40, kCodeTolerance);
}

TEST(Video, WithoutFinishNothingIsLeft) {
  const TempFolder folder;
  {
    VideoWriter writer(folder / "v.mp4", 30);
    for (int i = 0; i < 3; ++i) writer.Add(NumberedFrame(64, 48, i));
  }
  EXPECT_EQ(CountFiles(folder.path()), 0u);
}

TEST(Video, AFullDiskIsReportedAndNothingIsLeft) {
  const TempFolder folder;
  Image8 noise(160, 120, 3);
  std::mt19937 random(3);
  const auto write = [&] {
    const FileSizeLimit limit(8000);
    VideoWriter writer(folder / "v.mp4", 30);
    for (int i = 0; i < 60; ++i) {
      for (auto& v : noise.data) v = static_cast<std::uint8_t>(random());
      writer.Add(noise);
    }
    writer.Finish();
  };
  EXPECT_REFUSED(ExitCode::kMachine, "v.mp4", write());
  EXPECT_EQ(CountFiles(folder.path()), 0u);
}

TEST(Video, AFileCutOffInTheMiddleGivesWhatIsThereAndSaysSo) {
  const TempFolder folder;
  std::mt19937 random(5);
  {
    VideoWriter writer(folder / "v.mp4", 30);
    Image8 frame(160, 120, 3);
    for (int i = 0; i < 60; ++i) {
      for (auto& v : frame.data) v = static_cast<std::uint8_t>(random());
      writer.Add(frame);
    }
    writer.Finish();
  }
  // The index is in front (faststart), so that the first half stays readable.
  fs::resize_file(folder / "v.mp4", fs::file_size(folder / "v.mp4") / 2);
  VideoReader reader(folder / "v.mp4");
  int frames = 0;
  double last = -1;
  while (const auto frame = reader.Next()) {
    ++frames;
    EXPECT_GT(frame->time_s, last);
    last = frame->time_s;
  }
  EXPECT_GT(frames, 15);
  EXPECT_LT(frames, 45);
  EXPECT_TRUE(reader.truncated());
}

TEST(Video, WhatIsNoVideoIsRefusedByName) {
  const TempFolder folder;
  Write(folder / "text.mp4", "Not a video.");
  Write(folder / "empty.avi", "");
  for (const char* name : {"text.mp4", "empty.avi", "absent.mov"})
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, VideoReader reader(folder / name));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "no video file", VideoReader reader(folder.path()));
}

TEST(Video, TheClockHasThirtyFourFramesWithIncreasingTimes) {
  const fs::path clock = SharedData("pendulum/clock.mpg");
  if (!fs::exists(clock)) GTEST_SKIP() << "no " << clock;
  VideoReader reader(clock);
  double last = -1;
  while (const auto frame = reader.Next()) {
    EXPECT_GT(frame->time_s, last);
    last = frame->time_s;
  }
  EXPECT_EQ(reader.frames_read(), 34);
  EXPECT_FALSE(reader.truncated());
}

}  // namespace
}  // namespace lumi::test
