// Small videos for tests, made by ffmpeg from frames that are known.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "files_test_util.h"
#include "scene/files/video.h"
#include "scene/program/subprocess.h"

namespace lumi::test {

inline std::string Ffmpeg(std::vector<std::string> arguments) {
  std::vector<std::string> argv{"ffmpeg", "-nostdin", "-v", "error", "-y"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  std::string said;
  SubprocessOptions options;
  options.on_line = [&](const std::string& line) { said += line + "\n"; };
  const int code = RunSubprocess(argv, options).exit_code;
  EXPECT_EQ(code, 0) << said;
  return said;
}

// Six patches of 32 x 32 pixels.
constexpr int kPatches[6][3] = {{0, 186, 0},     {200, 40, 40}, {40, 40, 200},
                                {235, 235, 235}, {20, 20, 20},  {180, 160, 40}};
constexpr int kPatchWidth = 32;
inline Image8 PatchesPicture(int width = 3 * kPatchWidth, int height = 2 * kPatchWidth) {
  Image8 picture(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        picture.At(x, y, c) =
            static_cast<std::uint8_t>(kPatches[std::min(2, x / kPatchWidth) + 3 * std::min(1, y / kPatchWidth)][c]);
  return picture;
}
inline void ExpectPatches(const Image8& picture, double tolerance) {
  for (int i = 0; i < 6; ++i)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(picture.At(i % 3 * kPatchWidth + kPatchWidth / 2, i / 3 * kPatchWidth + kPatchWidth / 2, c),
                  kPatches[i][c], tolerance)
          << "patch " << i << " channel " << c;
}

// A frame whose brightness tells its number.
constexpr int kFirstGrey = 40, kGreyStep = 6;
inline Image8 NumberedGrey(int index, int width = 64, int height = 48) {
  return Image8(width, height, 3, static_cast<std::uint8_t>(kFirstGrey + kGreyStep * index));
}
inline int NumberOf(const Image8& frame) {
  return static_cast<int>(
      std::lround((frame.At(frame.width / 2, frame.height / 2, 1) - kFirstGrey) / double(kGreyStep)));
}

// ffmpeg's arguments for these frames at 25 a second as its input; their bytes stand in `raw`.
inline std::vector<std::string> RawInput(const fs::path& raw, const std::vector<Image8>& frames) {
  std::string bytes;
  for (const Image8& f : frames) bytes.append(reinterpret_cast<const char*>(f.data.data()), f.data.size());
  Write(raw, bytes);
  return {"-f",        "rawvideo", "-pix_fmt",
          "rgb24",     "-s",       std::to_string(frames[0].width) + "x" + std::to_string(frames[0].height),
          "-r",        "25",       "-i",
          raw.string()};
}
inline void Encode(const fs::path& raw, const std::vector<Image8>& frames, const std::vector<std::string>& output) {
  std::vector<std::string> arguments = RawInput(raw, frames);
  arguments.insert(arguments.end(), output.begin(), output.end());
  Ffmpeg(arguments);
}
inline std::vector<Image8> NumberedFrames(int count) {
  std::vector<Image8> frames;
  for (int i = 0; i < count; ++i) frames.push_back(NumberedGrey(i));
  return frames;
}

struct ReadVideo {
  std::vector<double> time_s;
  std::vector<int> number;
  int made_up = 0;
  bool truncated = false;
  long hint = 0;
  std::vector<std::string> remarks;
};
inline ReadVideo ReadAll(const fs::path& file) {
  ReadVideo all;
  VideoReader reader(file);
  all.hint = reader.frame_count_hint();
  while (const auto frame = reader.Next()) {
    EXPECT_EQ(frame->index, static_cast<int>(all.time_s.size()));
    EXPECT_EQ(frame->rgb.width, reader.width());
    EXPECT_EQ(frame->rgb.height, reader.height());
    EXPECT_EQ(frame->time_s, reader.time_s());
    if (!all.time_s.empty()) {
      EXPECT_GT(frame->time_s, all.time_s.back());
    }
    all.time_s.push_back(frame->time_s);
    all.number.push_back(NumberOf(frame->rgb));
  }
  all.made_up = reader.times_made_up();
  all.truncated = reader.truncated();
  all.remarks = reader.remarks();
  return all;
}

}  // namespace lumi::test
