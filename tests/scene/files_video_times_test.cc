// When frames are shown, and what hostile or damaged files do.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "video_clips.h"

namespace lumi::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kMillisecond = 1e-3, kMicroseconds = 2e-5;

void ExpectTimes(const std::vector<double>& times, const std::vector<double>& expected, double tolerance) {
  ASSERT_EQ(times.size(), expected.size());
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], tolerance) << "frame " << i;
}
std::vector<double> Steady(int count, double fps) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(i / fps);
  return times;
}

// ---- as they are written

TEST(VideoTimesTest, FramesComeBackAtTheTimesTheyWereGiven) {
  const TempFolder folder;
  const std::vector<double> times{7.0, 7.031, 7.07, 7.0999, 7.25, 7.251, 8.5, 8.533333, 8.566667};
  VideoWriter writer(folder / "v.mp4", 30);
  for (std::size_t i = 0; i < times.size(); ++i) writer.Add(NumberedGrey(static_cast<int>(i)), times[i]);
  writer.Finish();
  std::vector<double> expected;
  for (const double t : times) expected.push_back(t - times[0]);
  const ReadVideo back = ReadAll(folder / "v.mp4");
  ExpectTimes(back.time_s, expected, kMicroseconds);
  EXPECT_THAT(back.number, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(back.made_up, 0);
  EXPECT_FALSE(back.truncated);
  const VideoTimes read = ReadVideoTimes(folder / "v.mp4");
  ExpectTimes(read.time_s, expected, kMicroseconds);
  EXPECT_FALSE(read.constant);
  EXPECT_NEAR(read.largest_gap_s, 1.249, kMicroseconds);
  EXPECT_FALSE(read.has_sound);
  EXPECT_EQ(read.times_made_up, 0);
}

TEST(VideoTimesTest, AConstantRateIsKeptExactly) {
  const TempFolder folder;
  for (const double fps : {25.0, 30000 / 1001.0, 12.5, 240.0}) {
    VideoWriter writer(folder / "v.mp4", fps);
    for (int i = 0; i < 20; ++i) writer.Add(NumberedGrey(i));
    writer.Finish();
    const VideoTimes read = ReadVideoTimes(folder / "v.mp4");
    EXPECT_TRUE(read.constant);
    EXPECT_NEAR(read.fps, fps, 1e-6 * fps);
    EXPECT_NEAR(read.largest_gap_s, 1 / fps, kMillisecond);
    ExpectTimes(read.time_s, Steady(20, fps), 1e-4);
    ExpectTimes(ReadAll(folder / "v.mp4").time_s, Steady(20, fps), 1e-4);
    EXPECT_NEAR(VideoReader(folder / "v.mp4").fps(), fps, 1e-6 * fps);
  }
}

TEST(VideoTimesTest, FramesOfOneWriterHaveTimesOrNoneAndTheTimesIncrease) {
  const TempFolder folder;
  VideoWriter with(folder / "a.mp4", 30), without(folder / "b.mp4", 30);
  with.Add(NumberedGrey(0), 0.5);
  EXPECT_THROW(with.Add(NumberedGrey(1)), std::logic_error);
  EXPECT_THROW(with.Add(NumberedGrey(1), 0.5), std::invalid_argument);
  EXPECT_THROW(with.Add(NumberedGrey(1), 0.4), std::invalid_argument);
  without.Add(NumberedGrey(0));
  EXPECT_THROW(without.Add(NumberedGrey(1), 0.1), std::logic_error);
}

TEST(VideoTimesTest, TheWriterSaysItsColoursAndTurnsNothing) {
  const TempFolder folder;
  VideoWriter writer(folder / "v.mp4", 25);
  for (int i = 0; i < 3; ++i) writer.Add(PatchesPicture());
  writer.Finish();
  SubprocessOptions options;
  options.separate_stdout = true;
  const auto probed =
      RunSubprocess({"ffprobe", "-v", "error", "-show_streams", "-of", "json", (folder / "v.mp4").string()}, options);
  const nlohmann::json stream = nlohmann::json::parse(probed.out)["streams"][0];
  EXPECT_EQ(stream["codec_name"].get<std::string>(), "h264");
  EXPECT_EQ(stream["pix_fmt"].get<std::string>(), "yuv420p");
  for (const char* key : {"color_space", "color_primaries", "color_transfer"})
    EXPECT_EQ(stream[key].get<std::string>(), "bt709") << key;
  EXPECT_EQ(stream["color_range"].get<std::string>(), "tv");
  EXPECT_FALSE(stream.contains("side_data_list"));
  EXPECT_EQ(stream["r_frame_rate"].get<std::string>(), "25/1");
  constexpr double kWritten = 3;  // codes of 8 bits: BT.709 in limited range, crf 18
  ExpectPatches(VideoReader(folder / "v.mp4").Next()->rgb, kWritten);
  // Others see the same colours.
  Ffmpeg({"-i", (folder / "v.mp4").string(), "-frames:v", "1", "-vf",
          "scale=flags=accurate_rnd+full_chroma_int:in_color_matrix=bt709,format=rgb24", (folder / "v.png").string()});
  ExpectPatches(ReadImage8(folder / "v.png"), kWritten);
}

// ---- as other programs write them

TEST(VideoTimesTest, ADroppedFrameIsAGap) {
  const TempFolder folder;
  for (const char* name : {"v.mp4", "v.mkv"}) {
    Encode(
        folder / "raw", NumberedFrames(20),
        {"-vf", "select=not(eq(n\\,5))", "-fps_mode", "vfr", "-c:v", "libx264", "-bf", "3", (folder / name).string()});
    std::vector<double> expected = Steady(20, 25);
    expected.erase(expected.begin() + 5);
    const ReadVideo read = ReadAll(folder / name);
    ExpectTimes(read.time_s, expected, kMillisecond);
    EXPECT_EQ(read.number[4], 4);
    EXPECT_EQ(read.number[5], 6);
    EXPECT_FALSE(read.truncated);
    const VideoTimes times = ReadVideoTimes(folder / name);
    ExpectTimes(times.time_s, expected, kMillisecond);
    EXPECT_FALSE(times.constant) << name;
    EXPECT_NEAR(times.fps, 25, 1e-6) << name;
    EXPECT_NEAR(times.largest_gap_s, 0.08, kMillisecond + 1e-6);
  }
}

TEST(VideoTimesTest, EveryContainerHasAConstantRateWhereItHasOne) {
  const TempFolder folder;
  const std::vector<std::vector<std::string>> clips{{"a.mp4", "libx264", "-bf", "3"},
                                                    {"b.mkv", "libx264", "-bf", "3"},
                                                    {"c.ts", "libx264", "-bf", "3"},
                                                    {"d.avi", "mpeg4", "-bf", "2"},
                                                    {"e.mov", "mpeg4"},
                                                    {"f.mpg", "mpeg2video", "-bf", "2"},
                                                    {"g.flv", "libx264", "-bf", "3"},
                                                    {"h.avi", "mjpeg"},
                                                    {"i.webm", "libvpx-vp9"},
                                                    {"j.avi", "libx264", "-bf", "3"}};
  for (const auto& clip : clips) {
    SCOPED_TRACE(clip[0]);
    std::vector<std::string> arguments{"-f", "lavfi", "-i", "sine=duration=0.8", "-c:v"};
    arguments.insert(arguments.end(), clip.begin() + 1, clip.end());
    // Compressed sound begins before the first frame, and ffmpeg then leaves a gap in AVI after that frame.
    if (fs::path(clip[0]).extension() == ".avi") arguments.insert(arguments.end(), {"-c:a", "pcm_s16le"});
    if (clip[0] == "i.webm") arguments.insert(arguments.end(), {"-c:a", "libopus"});
    arguments.push_back((folder / clip[0]).string());
    // The sound is an input of its own, after the frames.
    Encode(folder / "raw", NumberedFrames(20), arguments);
    const VideoTimes times = ReadVideoTimes(folder / clip[0]);
    EXPECT_TRUE(times.constant);
    EXPECT_TRUE(times.has_sound);
    EXPECT_NEAR(times.fps, 25, 1e-3);
    EXPECT_EQ(times.times_made_up, 0);
    ExpectTimes(times.time_s, Steady(20, 25), kMillisecond + 1e-6);
    const ReadVideo read = ReadAll(folder / clip[0]);
    ExpectTimes(read.time_s, Steady(20, 25), kMillisecond + 1e-6);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(read.number[static_cast<std::size_t>(i)], i);
    EXPECT_EQ(read.made_up, 0);
    EXPECT_FALSE(read.truncated);
    EXPECT_THAT(read.remarks, IsEmpty());
  }
}

TEST(VideoTimesTest, WhatAnEditListLeavesOutIsNotShown) {
  const TempFolder folder;
  Encode(folder / "raw", NumberedFrames(20), {"-c:v", "libx264", "-bf", "2", (folder / "all.mp4").string()});
  Ffmpeg({"-ss", "0.32", "-i", (folder / "all.mp4").string(), "-c", "copy", (folder / "v.mp4").string()});
  ASSERT_NE(Read(folder / "v.mp4").find("elst"), std::string::npos);
  const ReadVideo read = ReadAll(folder / "v.mp4");
  ASSERT_FALSE(read.number.empty());
  EXPECT_EQ(read.number.front(), 8);
  EXPECT_EQ(read.number.back(), 19);
  ExpectTimes(read.time_s, Steady(12, 25), kMillisecond);
  EXPECT_EQ(read.hint, 12);
  EXPECT_FALSE(read.truncated);
  const VideoTimes times = ReadVideoTimes(folder / "v.mp4");
  ExpectTimes(times.time_s, Steady(12, 25), kMillisecond);
  EXPECT_TRUE(times.constant);
}

TEST(VideoTimesTest, AClockThatIsSetBackGoesOnAndThatIsSaid) {
  const TempFolder folder;
  Encode(folder / "raw", NumberedFrames(20), {"-c:v", "libx264", "-bf", "2", (folder / "a.ts").string()});
  Write(folder / "twice.ts", Read(folder / "a.ts") + Read(folder / "a.ts"));
  const ReadVideo read = ReadAll(folder / "twice.ts");
  ASSERT_EQ(read.time_s.size(), 40U);
  EXPECT_GT(read.made_up, 0);
  EXPECT_LE(read.made_up, 3);
  EXPECT_THAT(read.remarks, ElementsAre(testing::AllOf(HasSubstr("twice.ts"), HasSubstr("of 40 frames"))));
  constexpr double kStep = 1 / 25.0;
  for (std::size_t i = 1; i < 40; ++i) EXPECT_NEAR(read.time_s[i] - read.time_s[i - 1], kStep, kStep) << i;
  const VideoTimes times = ReadVideoTimes(folder / "twice.ts");
  EXPECT_EQ(times.time_s.size(), 40U);
  EXPECT_GT(times.times_made_up, 0);
  for (std::size_t i = 1; i < times.time_s.size(); ++i) EXPECT_GT(times.time_s[i], times.time_s[i - 1]);
}

// ---- hostile and damaged files

TEST(VideoTimesTest, NamesAreNamesOfFiles) {
  const TempFolder folder;
  VideoWriter writer(folder / "v.mp4", 25);
  for (int i = 0; i < 3; ++i) writer.Add(NumberedGrey(i));
  writer.Finish();
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  for (const char* name : {"clip:1.mp4", "a%04d.mp4", "-x.mp4", "rtsp:", "file:a.mp4", "new\nline.mp4",
                           "concat:v.mp4|v.mp4", "a*?[b].mp4", "http:,,x.mp4"}) {
    SCOPED_TRACE(name);
    fs::copy_file("v.mp4", name);
    EXPECT_EQ(ReadAll(name).number.size(), 3U);
    EXPECT_EQ(ReadVideoTimes(name).time_s.size(), 3U);
    fs::remove(name);
    VideoWriter again(name, 25);
    for (int i = 0; i < 3; ++i) again.Add(NumberedGrey(i));
    again.Finish();
    EXPECT_EQ(ReadAll(name).number.size(), 3U);
    fs::remove(name);
  }
  EXPECT_EQ(CountFiles(folder.path()), 1U);
  fs::current_path(before);
}

TEST(VideoTimesTest, APlaylistInAVideosClothesOpensNothing) {
  const TempFolder folder;
  VideoWriter writer(folder / "v.mp4", 25);
  for (int i = 0; i < 3; ++i) writer.Add(NumberedGrey(i));
  writer.Finish();
  Write(folder / "concat.mp4", "ffconcat version 1.0\nfile v.mp4\n");
  Write(folder / "hls.mp4", "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nv.mp4\n#EXT-X-ENDLIST\n");
  for (const char* name : {"concat.mp4", "hls.mp4"}) {
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, VideoReader reader(folder / name));
    EXPECT_REFUSED(ExitCode::kCorruptInput, name, ReadVideoTimes(folder / name));
  }
}

TEST(VideoTimesTest, SoundAloneIsNoVideo) {
  const TempFolder folder;
  Ffmpeg({"-f", "lavfi", "-i", "sine=duration=0.2", (folder / "sound.mp4").string()});
  EXPECT_REFUSED(ExitCode::kCorruptInput, "holds no video", VideoReader reader(folder / "sound.mp4"));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "holds no video", ReadVideoTimes(folder / "sound.mp4"));
}

TEST(VideoTimesTest, DamagedFilesEndEarlyOrAreRefused) {
  const TempFolder folder;
  std::mt19937 random(11);
  for (const char* name : {"v.mp4", "v.mkv", "v.ts", "v.avi"}) {
    const bool old = name[2] == 'a';
    Encode(folder / "raw", NumberedFrames(12), {"-c:v", old ? "mpeg4" : "libx264", (folder / name).string()});
    const std::string whole = Read(folder / name);
    for (int k = 0; k < 60; ++k) {
      std::string bytes = whole;
      if (k % 3 == 0) bytes.resize(random() % bytes.size());
      for (int i = 0; i < 1 + k % 8 && !bytes.empty(); ++i)
        bytes[random() % std::min<std::size_t>(bytes.size(), k % 2 ? 2000 : bytes.size())] =
            static_cast<char>(random());
      Write(folder / name, bytes);
      for (const bool decode : {true, false}) {
        const Caught caught = Catch([&] {
          if (decode)
            ReadAll(folder / name);
          else
            ReadVideoTimes(folder / name);
        });
        EXPECT_TRUE(caught.code == ExitCode::kDone || caught.code == ExitCode::kCorruptInput) << caught.text;
      }
    }
  }
}

}  // namespace
}  // namespace lumi::test
