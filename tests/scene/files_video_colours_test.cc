// How frames look: turned as the file says, with the colours that it names.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <functional>

#include "video_clips.h"

namespace lumi::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// ---- turned

Image8 Corners() {
  // Red, green; blue, white.
  Image8 picture(96, 64, 3, 20);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; ++x) {
      if (y < 32 && x < 48) picture.At(x, y, 0) = 220;
      if (y < 32 && x >= 48) picture.At(x, y, 1) = 220;
      if (y >= 32 && x < 48) picture.At(x, y, 2) = 220;
      if (y >= 32 && x >= 48) picture.At(x, y, 0) = picture.At(x, y, 1) = picture.At(x, y, 2) = 220;
    }
  return picture;
}

std::string CornersSeen(const Image8& picture) {
  std::string seen;
  for (const int y : {picture.height / 4, 3 * picture.height / 4})
    for (const int x : {picture.width / 4, 3 * picture.width / 4}) {
      const bool r = picture.At(x, y, 0) > 120, g = picture.At(x, y, 1) > 120, b = picture.At(x, y, 2) > 120;
      seen += r && g && b ? 'W' : r ? 'R' : g ? 'G' : b ? 'B' : '?';
    }
  return seen;
}

// Writes a, b, c, d of x' = a x + c y, y' = b x + d y into an MP4's track header.
void SetMatrix(const fs::path& file, const std::array<int, 4>& m) {
  std::string bytes = Read(file);
  const std::size_t at = bytes.find("tkhd");
  ASSERT_NE(at, std::string::npos);
  const std::size_t matrix = at + 4 + 40;
  const int entries[] = {0, 1, 3, 4};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = static_cast<std::uint32_t>(m[i] * 65536);
    for (std::size_t k = 0; k < 4; ++k)
      bytes[matrix + 4 * static_cast<std::size_t>(entries[i]) + k] = static_cast<char>(value >> (24 - 8 * k));
  }
  Write(file, bytes);
}

// Three frames of it.
void WriteCorners(const fs::path& film) {
  VideoWriter writer(film, 25);
  for (int i = 0; i < 3; ++i) writer.Add(Corners());
  writer.Finish();
}

TEST(VideoColours, FramesAreTurnedAndMirroredAsTheFileSays) {
  const TempFolder folder;
  WriteCorners(folder / "v.mp4");
  const struct {
    std::array<int, 4> matrix;
    const char* corners;
    bool upright;
  } cases[] = {
      {{1, 0, 0, 1}, "RGBW", false},    // as it is
      {{0, 1, -1, 0}, "BRWG", true},    // by 90 degrees clockwise: a phone held upright
      {{-1, 0, 0, -1}, "WBGR", false},  // by 180
      {{0, -1, 1, 0}, "GWRB", true},    // by 270
      {{-1, 0, 0, 1}, "GRWB", false},   // mirrored, left and right
      {{1, 0, 0, -1}, "BWRG", false},   // top and bottom
      {{0, 1, 1, 0}, "RBGW", true},     // transposed
      {{0, -1, -1, 0}, "WGBR", true},   // about the other diagonal
  };
  for (const auto& c : cases) {
    SetMatrix(folder / "v.mp4", c.matrix);
    VideoReader reader(folder / "v.mp4");
    EXPECT_EQ(reader.width(), c.upright ? 64 : 96) << c.corners;
    EXPECT_EQ(reader.height(), c.upright ? 96 : 64) << c.corners;
    const auto frame = reader.Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->rgb.width, reader.width());
    EXPECT_EQ(CornersSeen(frame->rgb), c.corners);
    EXPECT_THAT(reader.remarks(), IsEmpty());
  }
}

TEST(VideoColours, FfmpegTurnsFramesTheSameWay) {
  const TempFolder folder;
  WriteCorners(folder / "v.mp4");
  // The same conversion to RGB as ours, before ffmpeg turns.
  for (const std::array<int, 4>& matrix :
       {std::array{1, 0, 0, 1}, {0, 1, -1, 0}, {-1, 0, 0, -1}, {0, -1, 1, 0}, {-1, 0, 0, 1}, {1, 0, 0, -1}}) {
    SCOPED_TRACE(testing::PrintToString(matrix));
    SetMatrix(folder / "v.mp4", matrix);
    Ffmpeg({"-i", (folder / "v.mp4").string(), "-frames:v", "1", "-vf",
            "scale=flags=accurate_rnd+full_chroma_int+full_chroma_inp:in_color_matrix=bt709,format=rgb24",
            (folder / "v.png").string()});
    const Image8 theirs = ReadImage8(folder / "v.png"), ours = VideoReader(folder / "v.mp4").Next()->rgb;
    ASSERT_EQ(ours.width, theirs.width);
    ASSERT_EQ(ours.data.size(), theirs.data.size());
    // Inside the quarters: at their edges chroma is interpolated before or after the turn.
    for (int y = 8; y < ours.height - 8; ++y)
      for (int x = 8; x < ours.width - 8; ++x) {
        if (std::abs(2 * x - ours.width) < 16 || std::abs(2 * y - ours.height) < 16) continue;
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(ours.At(x, y, c), theirs.At(x, y, c), 2) << x << " " << y;
      }
  }
}

// AVCHD, HDV and DV: fewer pixels than a line shows, or than a column does.
TEST(VideoColours, PixelsThatAreNotSquareAreMadeSo) {
  const TempFolder folder;
  WriteCorners(folder / "square.mp4");
  const struct {
    const char* aspect;
    int width, height;
  } cases[] = {{"4/3", 128, 64}, {"8/9", 96, 72}, {"1/1", 96, 64}};
  for (const auto& c : cases) {
    const std::string film = folder / (std::string(c.aspect, 1) + ".mp4");
    Ffmpeg(
        {"-i", folder / "square.mp4", "-vf", std::string("setsar=") + c.aspect, "-c:v", "libx264", "-qp", "0", film});
    VideoReader reader(film);
    EXPECT_EQ(reader.width(), c.width) << c.aspect;
    EXPECT_EQ(reader.height(), c.height) << c.aspect;
    const auto frame = reader.Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->rgb.width, c.width);
    EXPECT_EQ(frame->rgb.height, c.height);
    EXPECT_EQ(CornersSeen(frame->rgb), "RGBW");
    if (c.width == 96 && c.height == 64)
      EXPECT_THAT(reader.remarks(), IsEmpty());
    else
      EXPECT_THAT(reader.remarks(), ElementsAre(HasSubstr("pixels that are not square")));
  }
  // Turned as a phone held upright: the longer side of the pixel turns with it.
  const std::string upright = folder / "upright.mp4";
  Ffmpeg({"-i", folder / "square.mp4", "-vf", "setsar=4/3", "-c:v", "libx264", "-qp", "0", upright});
  SetMatrix(upright, {0, 1, -1, 0});
  EXPECT_EQ(VideoReader(upright).width(), 64);
  EXPECT_EQ(VideoReader(upright).height(), 128);
}

// ---- matrix, range, depth

struct ColourCase {
  const char *matrix, *range, *format;  // as the filter setparams names them
  std::vector<std::string> encoder;
  const char* file;
};
std::ostream& operator<<(std::ostream& out, const ColourCase& c) {
  return out << c.matrix << " " << c.range << " " << c.format << " " << c.encoder[0] << " " << c.file;
}

const std::vector<std::string> kX264{"libx264", "-qp", "0"};
const std::vector<std::string> kX265{"libx265", "-x265-params", "lossless=1:log-level=none:pools=1"};
const std::vector<std::string> kVp9{"libvpx-vp9", "-lossless", "1", "-cpu-used", "8"};

bool HasEncoder(const std::string& name) {
  const auto listed = RunSubprocess({"ffmpeg", "-nostdin", "-v", "error", "-h", "encoder=" + name});
  for (const std::string& line : listed.tail)
    if (line.find("not recognized") != line.npos) return false;
  return true;
}

std::string ScaleMatrix(const std::string& matrix) { return matrix == "bt2020nc" ? "bt2020" : matrix; }

void EncodeColours(const TempFolder& folder, const ColourCase& c, const Image8& picture) {
  const std::string m = c.matrix, r = c.range;
  const bool names = m != "unknown";
  std::vector<std::string> arguments{
      "-vf", "scale=flags=accurate_rnd+full_chroma_int+full_chroma_inp:out_color_matrix=" +
                 (names                   ? ScaleMatrix(m)
                  : picture.height >= 720 ? "bt709"
                                          : "smpte170m") +
                 ":out_range=" + r + ",format=" + c.format + ",setparams=colorspace=" + m +
                 ":range=" + (names ? r : "unknown") + ":color_primaries=unknown:color_trc=unknown"};
  if (names) arguments.insert(arguments.end(), {"-colorspace", m, "-color_range", r});
  arguments.push_back("-c:v");
  arguments.insert(arguments.end(), c.encoder.begin(), c.encoder.end());
  arguments.push_back((folder / c.file).string());
  Encode(folder / "raw", {picture, picture, picture}, arguments);
}

constexpr double kCodes = 2;  // of 8 bits of YCbCr in limited range, on saturated colours

TEST(VideoColours, PatchesComeBackByTheMatrixAndRangeThatTheFileNames) {
  const ColourCase cases[] = {
      {"bt709", "tv", "yuv420p", kX264, "v.mp4"},         {"bt709", "pc", "yuv420p", kX264, "v.mp4"},
      {"smpte170m", "tv", "yuv420p", kX264, "v.mp4"},     {"smpte170m", "pc", "yuv422p", kX264, "v.mkv"},
      {"bt2020nc", "tv", "yuv420p", kX264, "v.mp4"},      {"bt709", "tv", "yuv444p", kX264, "v.mp4"},
      {"bt709", "tv", "yuv420p10le", kX264, "v.mp4"},     {"bt709", "pc", "yuv420p10le", kX264, "v.mp4"},
      {"bt709", "tv", "yuv420p", kX265, "v.mp4"},         {"bt2020nc", "tv", "yuv420p10le", kX265, "v.mp4"},
      {"smpte170m", "tv", "yuv420p10le", kX265, "v.mp4"}, {"bt709", "tv", "yuv420p", kVp9, "v.webm"},
      {"smpte170m", "tv", "yuv420p", kVp9, "v.webm"},
  };
  for (const ColourCase& c : cases) {
    SCOPED_TRACE(testing::PrintToString(c));
    if (!HasEncoder(c.encoder[0])) continue;
    const TempFolder folder;
    EncodeColours(folder, c, PatchesPicture());
    VideoReader reader(folder / c.file);
    ExpectPatches(reader.Next()->rgb, kCodes);
    const bool deep = std::string(c.format).find("10") != std::string::npos;
    if (deep) {
      EXPECT_THAT(reader.remarks(), ElementsAre(HasSubstr("10 bits")));
    } else {
      EXPECT_THAT(reader.remarks(), IsEmpty());
    }
  }
}

TEST(VideoColours, WhatNamesNoMatrixHasTheStandardsBySize) {
  for (const auto& [width, height] : {std::pair{96, 64}, {1280, 720}, {720, 1280}}) {
    SCOPED_TRACE(height);
    const TempFolder folder;
    EncodeColours(folder, {"unknown", "tv", "yuv420p", kX264, "v.mp4"}, PatchesPicture(width, height));
    ExpectPatches(VideoReader(folder / "v.mp4").Next()->rgb, kCodes);
  }
}

TEST(VideoColours, MotionJpegIsInFullRange) {
  const TempFolder folder;
  const std::vector<Image8> frames(2, PatchesPicture());
  Encode(folder / "raw", frames,
         {"-vf", "scale=flags=accurate_rnd+full_chroma_int:out_color_matrix=smpte170m:out_range=pc", "-pix_fmt",
          "yuvj420p", "-c:v", "mjpeg", "-q:v", "1", (folder / "v.avi").string()});
  constexpr double kOfJpeg = 2;
  ExpectPatches(VideoReader(folder / "v.avi").Next()->rgb, kCodes + kOfJpeg);
}

TEST(VideoColours, PicturesAreFfmpegsOwn) {
  const Image8 picture = ColorfulImage(160, 120);
  std::vector<ColourCase> cases;
  for (const char* matrix : {"bt709", "smpte170m", "bt2020nc"})
    for (const char* range : {"tv", "pc"}) {
      cases.push_back({matrix, range, "yuv420p", kX264, "v.mp4"});
      cases.push_back({matrix, range, "yuv420p10le", kX265, "v.mp4"});
    }
  for (const ColourCase& c : cases) {
    SCOPED_TRACE(testing::PrintToString(c));
    if (!HasEncoder(c.encoder[0])) continue;
    const TempFolder folder;
    EncodeColours(folder, c, picture);
    Ffmpeg({"-i", (folder / c.file).string(), "-frames:v", "1", "-vf",
            "scale=flags=accurate_rnd+full_chroma_int+full_chroma_inp:in_color_matrix=" + ScaleMatrix(c.matrix) +
                ":in_range=" + c.range + ":in_h_chr_pos=0:in_v_chr_pos=128,format=rgb24",
            (folder / "v.png").string()});
    const Image8 theirs = ReadImage8(folder / "v.png"), ours = VideoReader(folder / c.file).Next()->rgb;
    ASSERT_EQ(theirs.data.size(), ours.data.size());
    int worst = 0;
    for (std::size_t i = 0; i < ours.data.size(); ++i) worst = std::max(worst, std::abs(ours.data[i] - theirs.data[i]));
    EXPECT_LE(worst, 2);
  }
}

// ---- HDR

// Three frames of 10 bits from a signal of red, green and blue, 0 to 1.
void EncodeHdr(const TempFolder& folder, const std::string& transfer, int width, int height,
               const std::function<std::array<double, 3>(int x)>& signal) {
  std::string raw;
  for (int i = 0; i < 3; ++i)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (const double channel : signal(x)) {
          const int v = static_cast<int>(std::lround(channel * 65535));
          raw += static_cast<char>(v & 255);
          raw += static_cast<char>(v >> 8);
        }
  Write(folder / "raw", raw);
  Ffmpeg({"-f",
          "rawvideo",
          "-pix_fmt",
          "rgb48le",
          "-s",
          std::to_string(width) + "x" + std::to_string(height),
          "-r",
          "25",
          "-i",
          (folder / "raw").string(),
          "-vf",
          "scale=flags=accurate_rnd+full_chroma_int:out_color_matrix=bt2020:out_range=tv,format=yuv420p10le,setparams="
          "colorspace=bt2020nc:range=tv:color_primaries=bt2020:color_trc=" +
              transfer,
          "-colorspace",
          "bt2020nc",
          "-color_primaries",
          "bt2020",
          "-color_trc",
          transfer,
          "-c:v",
          "libx265",
          "-x265-params",
          "lossless=1:log-level=none:pools=1",
          (folder / "v.mp4").string()});
}

TEST(VideoColours, HdrBecomesSdrAndThatIsSaid) {
  if (!HasEncoder("libx265")) GTEST_SKIP() << "no libx265";
  // Where paper white (203 cd/m2) stands in the signal: ITU-R BT.2408.
  const struct {
    const char *transfer, *name;
    double paper_white;
  } cases[] = {{"smpte2084", "PQ", 0.58}, {"arib-std-b67", "HLG", 0.75}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const TempFolder folder;
    EncodeHdr(folder, c.transfer, 256, 64, [](int x) { return std::array{x / 255.0, x / 255.0, x / 255.0}; });
    VideoReader reader(folder / "v.mp4");
    EXPECT_THAT(reader.remarks(), ElementsAre(testing::AllOf(HasSubstr("v.mp4"), HasSubstr("HDR"), HasSubstr(c.name))));
    const Image8 ramp = reader.Next()->rgb;
    const auto at = [&](int x) { return static_cast<int>(ramp.At(x, 32, 1)); };
    for (int x = 1; x < 256; ++x) {
      EXPECT_GE(at(x), at(x - 1)) << x;
      for (const int channel : {0, 2}) EXPECT_NEAR(ramp.At(x, 32, channel), at(x), 2) << x;
    }
    EXPECT_LE(at(2), 3);
    EXPECT_GE(at(255), 250);
    const int paper = at(static_cast<int>(c.paper_white * 255));
    EXPECT_GT(paper, 190);  // bright, with room above for what is brighter
    EXPECT_LT(paper, 240);
    EXPECT_TRUE(reader.Next());
  }
}

// Below the tone map's knee colours are those of the scene: given in BT.709's primaries with paper white at 1, filmed
// in BT.2020's and PQ, they come back as their own sRGB.
TEST(VideoColours, HdrColoursBecomeThoseOfTheNarrowerPrimaries) {
  if (!HasEncoder("libx265")) GTEST_SKIP() << "no libx265";
  const double colours[4][3] = {{0.25, 0.05, 0.05}, {0.05, 0.25, 0.05}, {0.05, 0.05, 0.25}, {0.2, 0.2, 0.05}};
  // ITU-R BT.2087, and SMPTE ST 2084.
  const double to_2020[3][3] = {{0.6274, 0.3293, 0.0433}, {0.0691, 0.9195, 0.0114}, {0.0164, 0.0880, 0.8956}};
  const auto pq = [](double cd_m2) {
    const double l = std::pow(cd_m2 / 10000, 2610.0 / 16384);
    return std::pow((3424.0 / 4096 + 2413.0 / 128 * l) / (1 + 2392.0 / 128 * l), 2523.0 / 32);
  };
  const auto srgb = [](double v) { return 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055); };
  const TempFolder folder;
  EncodeHdr(folder, "smpte2084", 256, 64, [&](int x) {
    std::array<double, 3> signal{};
    for (int i = 0; i < 3; ++i) {
      double linear = 0;
      for (int k = 0; k < 3; ++k) linear += to_2020[i][k] * colours[x / 64][k];
      signal[static_cast<std::size_t>(i)] = pq(203 * linear);
    }
    return signal;
  });
  const Image8 frame = VideoReader(folder / "v.mp4").Next()->rgb;
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(frame.At(64 * i + 32, 32, c), srgb(colours[i][c]), 3) << i << " " << c;
}

// SDR in wide primaries keeps its numbers, which is a little duller than it was filmed.
TEST(VideoColours, WidePrimariesWithoutHdrAreSaid) {
  const TempFolder folder;
  Encode(folder / "raw", {PatchesPicture(), PatchesPicture()},
         {"-vf",
          "scale=out_color_matrix=bt2020:out_range=tv,format=yuv420p,setparams=colorspace=bt2020nc:range=tv:"
          "color_primaries=bt2020:color_trc=bt2020-10",
          "-colorspace", "bt2020nc", "-color_primaries", "bt2020", "-color_trc", "bt2020-10", "-c:v", "libx264", "-qp",
          "0", (folder / "v.mp4").string()});
  EXPECT_THAT(VideoReader(folder / "v.mp4").remarks(), ElementsAre(HasSubstr("BT.2020")));
}

}  // namespace
}  // namespace lumi::test
