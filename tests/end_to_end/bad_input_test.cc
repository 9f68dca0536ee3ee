// Photos and videos that cannot become a scene.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

// A photo with detail enough for features: random discs.
Image8 Discs(unsigned seed, int width = 320, int height = 240) {
  std::mt19937 random(seed);
  const auto draw = [&](int below) { return static_cast<int>(random() % static_cast<unsigned>(below)); };
  Image8 image(width, height, 3, 128);
  for (int i = 0; i < 250; ++i) {
    const int x0 = draw(width), y0 = draw(height), r = 3 + draw(14);
    const int color[3] = {draw(256), draw(256), draw(256)};
    for (int y = std::max(0, y0 - r); y < std::min(height, y0 + r); ++y)
      for (int x = std::max(0, x0 - r); x < std::min(width, x0 + r); ++x)
        if ((x - x0) * (x - x0) + (y - y0) * (y - y0) < r * r)
          for (int c = 0; c < 3; ++c) image.At(x, y, c) = static_cast<std::uint8_t>(color[c]);
  }
  return image;
}

class BadInput : public testing::Test {
 protected:
  fs::path photos() const { return folder_ / "photos"; }
  fs::path scene() const { return folder_ / "scene"; }
  Refusal Run(const fs::path& input, int exit_code, std::vector<std::string> names,
              std::vector<std::string> more = {}) const {
    Refusal refusal{
        {"lumi-pipeline", input.string(), "-o", scene().string()}, exit_code, std::move(names), scene(), {input}};
    refusal.argv.insert(refusal.argv.end(), more.begin(), more.end());
    return refusal;
  }
  TemporaryFolder folder_;
};

TEST_F(BadInput, AnAbsentFolder) { ExpectRefusal(Run(photos(), 2, {photos().string(), "does not exist"})); }

TEST_F(BadInput, AnEmptyFolder) {
  fs::create_directories(photos());
  ExpectRefusal(Run(photos(), 3, {photos().string()}));
}

TEST_F(BadInput, TextFilesAlone) {
  WriteTextAtomically(photos() / "notes.txt", "no photo");
  WriteTextAtomically(photos() / "photo.jpg", "no photo either, whatever its name says");
  WriteTextAtomically(photos() / "photo2.jpg", "nor this");
  ExpectRefusal(Run(photos(), 1, {photos().string(), "photo.jpg"}));
}

TEST_F(BadInput, OnePhoto) {
  WriteImage(photos() / "a.jpg", Discs(1));
  ExpectRefusal(Run(photos(), 1, {photos().string(), "one photo"}));
}

TEST_F(BadInput, TwoPhotosAndOneOfThemCutOff) {
  WriteImage(photos() / "a.jpg", Discs(1));
  WriteImage(photos() / "b.jpg", Discs(2));
  fs::resize_file(photos() / "b.jpg", fs::file_size(photos() / "b.jpg") / 2);
  ExpectRefusal(Run(photos(), 1, {photos().string(), "one photo"}));
}

TEST_F(BadInput, TwoUnrelatedPhotos) {
  WriteImage(photos() / "a.jpg", Discs(1));
  WriteImage(photos() / "b.jpg", Discs(2));
  Refusal refusal = Run(photos(), 1, {});
  // What COLMAP has worked out stays for a second try with other options; a scene it is not.
  refusal.output.clear();
  ExpectRefusal(refusal);
  EXPECT_FALSE(fs::exists(scene() / "lumigraph.json"));
  EXPECT_FALSE(fs::exists(scene() / "images"));
  EXPECT_FALSE(fs::exists(scene() / "report.html"));
}

TEST_F(BadInput, AFileThatIsNoVideo) {
  WriteTextAtomically(folder_ / "walk.mp4", "no video");
  ExpectRefusal(Run(folder_ / "walk.mp4", 3, {"walk.mp4"}));
  WriteTextAtomically(folder_ / "letter.pdf", "no video");
  ExpectRefusal(Run(folder_ / "letter.pdf", 3, {"letter.pdf"}));
}

TEST_F(BadInput, AVideoCutOffBeforeItsIndex) {
  // Written by ffmpeg as it does by default: an MP4 with its index at the end.
  const fs::path video = folder_ / "walk.mp4";
  const auto ffmpeg = FindProgram("ffmpeg");
  ASSERT_TRUE(ffmpeg);
  ASSERT_EQ(RunProgram({ffmpeg->string(), "-v", "error", "-f", "lavfi", "-i", "testsrc=duration=2:size=320x240",
                        video.string()})
                .exit_code,
            0);
  fs::resize_file(video, fs::file_size(video) / 2);
  ExpectRefusal(Run(video, 3, {"walk.mp4"}));
}

TEST_F(BadInput, WrongOptionsAreRefusedBeforeAnythingIsDone) {
  WriteImage(photos() / "a.jpg", Discs(1));
  WriteImage(photos() / "b.jpg", Discs(2));
  ExpectRefusal(Run(photos(), 2, {"--holdout"}, {"--holdout", "1"}));
  ExpectRefusal(Run(photos(), 2, {"--holdout"}, {"--holdout", "every"}));
  ExpectRefusal(Run(photos(), 2, {"--width"}, {"--width", "3"}));
  ExpectRefusal(Run(photos(), 2, {"--proxy"}, {"--proxy", "sphere"}));
  ExpectRefusal(Run(photos(), 2, {"--no-such-option"}, {"--no-such-option"}));
  ExpectRefusal(Run(photos(), 3, {"absent.yaml"}, {"--camera", (folder_ / "absent.yaml").string()}));
}

}  // namespace
}  // namespace lumi
