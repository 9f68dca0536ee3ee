#include "pipeline/report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "pipeline/report/cameras_from_above.h"
#include "pipeline/report/contact_sheet.h"
#include "pipeline/report/html.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "tests/support/occurrences.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

// Reused after 0.1 s; the run that did its work took `computed_seconds`.
StageResult WorkedStage(const std::string& name, double computed_seconds, const std::string& json) {
  return {name, 0.1, true, JsonKeys::Parse(json).value(), computed_seconds};
}

// A scene with two held-out photos and a missing one whose name is hostile.
struct Fixture {
  TemporaryFolder folder;
  fs::path scene = folder / "garden & <gate>";
  ReportInput input;

  Fixture() {
    WriteScene(MakeSmallScene(scene / "images", 5), scene);
    for (const char* name : {"photo10", "photo13"})
      for (const char* kind : {"_render.jpg", "_difference.jpg"})
        WriteImage(scene / "holdout" / (std::string(name) + kind), Image8(64, 48, 3, 90));
    input.scene_folder = scene;
    input.source = "photos of <mine>";
    input.stages.push_back(
        WorkedStage("reconstruct", 61.5,
                    R"({"images_total":6,"images_registered":5,"mean_reprojection_error_px":0.53,"backend":"colmap",
                                "missing":[{"name":"<script>alert(1)</script>.jpg","reason":"too few matches"}]})"));
    input.stages.push_back(WorkedStage(
        "holdout", 2.5,
        R"({"psnr_mean_db":31.25,"ssim_mean":0.91,"nearest_photo_psnr_mean_db":24.5,"coverage":0.987,"views":[
                                {"name":"photo10.png","psnr_db":30.5,"ssim":0.9,"coverage":0.98,"nearest_photo_psnr_db":24.0,"file":"photo10"},
                                {"name":"photo13.png","psnr_db":32.0,"ssim":0.92,"coverage":0.99,"nearest_photo_psnr_db":25.0,"file":"photo13"}]})"));
    input.colmap_seconds = 58;
    input.around_colmap_seconds = 3.5;
    input.holdout_folder = scene / "holdout";
  }
};

TEST(Report, IsOnePageThatNeedsNothingElse) {
  const Fixture f;
  const ReportFiles files = WriteReport(f.input, SilentProgress());
  const std::string html = ReadText(files.html);
  // Nothing is fetched: no address of the net, no script, no style sheet, and pictures carry their bytes.
  EXPECT_THAT(html, Not(HasSubstr("http:")));
  EXPECT_THAT(html, Not(HasSubstr("https:")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  EXPECT_THAT(html, Not(HasSubstr("url(")));
  EXPECT_EQ(Occurrences(html, "<img "), 6U);  // two rows of photo, render, difference
  EXPECT_EQ(Occurrences(html, "src=\"data:image/jpeg;base64,/9j/"), 6U);
}

TEST(Report, SaysHowTheFlyThroughWasRenderedAndWhatAFrameTook) {
  Fixture f;
  f.input.video = f.scene / "fly-through.mp4";
  f.input.stages.push_back(WorkedStage(
      "video", 12,
      R"({"frames":180,"ms_per_frame":58.25,"fidelity":{"wanted_db":40,"name":"candidates 25x25, k 4","why":"",
                                          "db":61.75,"ms":60,"pixel_ms":350.5}})"));
  EXPECT_THAT(ReadText(WriteReport(f.input, SilentProgress()).html),
              HasSubstr("</a>: candidates 25x25, k 4, 58.2 ms a frame (a weight at every pixel: 350.5 ms, 61.8 dB from "
                        "it).</p>"));
  sibling::FramesSummary pixel;
  EXPECT_EQ(DescribeFrames(pixel), "") << "all frames were there";
  pixel.ms_per_frame = 350;
  EXPECT_EQ(DescribeFrames(pixel), "a weight at every pixel, 350.0 ms a frame");
  pixel.fidelity = {"identity, k 4", "no sparse samples come within 40 dB of it", {}, 350, 350};
  EXPECT_EQ(DescribeFrames(pixel),
            "a weight at every pixel, 350.0 ms a frame: no sparse samples come within 40 dB of it");
}

TEST(Report, HoldsFiguresMissingPhotosAndNextSteps) {
  const Fixture f;
  const std::string html = ReadText(WriteReport(f.input, SilentProgress()).html);
  for (const char* part : {"5 of 6", "0.53 px", "31.2", "+6.8 dB", "0.910", "98.7 %", "too few matches", "lumi-view",
                           "61.5", "58.0 s", "photo13.png"})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_THAT(html, HasSubstr("&lt;script&gt;alert(1)&lt;/script&gt;.jpg"));
  EXPECT_THAT(html, HasSubstr("garden &amp; &lt;gate&gt;"));
}

TEST(Report, ShowsBothFiguresOfHeldOutPhotosAndWhatTheNearestPhotoCovers) {
  Fixture f;
  f.input.stages.pop_back();
  f.input.stages.push_back(WorkedStage("holdout", 2.5, R"({
      "proxy": "mesh", "proxy_evaluated": "mesh-without-8", "psnr_mean_db": 31.25, "psnr_seen_mean_db": 33.5,
      "seen": 0.876, "ssim_mean": 0.91, "nearest_photo_psnr_mean_db": 24.5, "nearest_photo_psnr_seen_mean_db": 26.75,
      "nearest_photo_coverage_mean": 0.812, "coverage": 0.987, "views": [
      {"name": "photo10.png", "psnr_db": 30.5, "psnr_seen_db": 32.25, "seen": 0.871, "ssim": 0.9, "coverage": 0.98,
       "nearest_photo_psnr_db": 24.0, "nearest_photo_psnr_seen_db": 26.5, "nearest_photo_coverage": 0.801,
       "file": "photo10"},
      {"name": "photo13.png", "psnr_db": 32.0, "seen": 0, "ssim": 0.92, "coverage": 0.99, "file": "photo13"}]})"));
  const std::string html = ReadText(WriteReport(f.input, SilentProgress()).html);
  for (const char* part : {"33.5 dB", "PSNR over seen pixels", "33.50", "87.6 %", "26.75", "81.2 %", "32.25", "87.1 %",
                           "26.50", "80.1 %", "0.0 %", "made without the held-out photos (mesh-without-8)"})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_THAT(html, Not(HasSubstr("made of all photos")));
}

TEST(Report, SaysWhetherTheCamerasThatStandWorstGiveCauseForDoubt) {
  Fixture f;
  const auto with = [&](const std::string& remark) {
    f.input.stages.front() = WorkedStage("reconstruct", 61.5,
                                         R"({"images_total":6,"images_registered":5,"standings":[
        {"name":"photo10.png","points":40,"offered":90,"spread":0.5,"angle_deg":6.0,"sigma_percent":0.312)" +
                                             remark + R"(},
        {"name":"photo11.png","points":80,"offered":90,"spread":0.7,"angle_deg":7.0,"sigma_percent":0.05}]})");
    return ReadText(WriteReport(f.input, SilentProgress()).html);
  };
  EXPECT_THAT(with(""), HasSubstr("the least certain position is known to 0.31 % of the extent"));
  const std::string html = with(R"(,"remark":"only 4 points that others hold agree with it")");
  EXPECT_THAT(html, HasSubstr("1 of 2 cameras have a remark"));
  EXPECT_THAT(html, HasSubstr("only 4 points that others hold agree with it"));
}

TEST(Report, ACalibrationIsShownWithItsSigmaAndLinked) {
  Fixture f;
  EXPECT_THAT(ReadText(WriteReport(f.input, SilentProgress()).html), Not(HasSubstr("calibrated")));
  f.input.stages.insert(f.input.stages.begin(), WorkedStage("calibrate", 1.5, R"({"fx":612.345,"sigma_fx":0.22})"));
  const std::string html = ReadText(WriteReport(f.input, SilentProgress()).html);
  for (const char* part : {"612.3 &#177; 0.2 px", "href=\"calibration/report.html\"", "5 of 6"})
    EXPECT_THAT(html, HasSubstr(part));
}

TEST(Report, JsonHoldsTheStagesAndTheirSummaries) {
  const Fixture f;
  const ReportFiles files = WriteReport(f.input, SilentProgress());
  const auto report = nlohmann::json::parse(ReadText(files.json));
  EXPECT_EQ(report["stages"][0]["name"], "reconstruct");
  EXPECT_EQ(report["stages"][0]["seconds"], 61.5);
  EXPECT_EQ(report["stages"][1]["summary"]["views"].size(), 2U);
}

TEST(Report, AnUnreadableRenderLeavesItsRowOut) {
  const Fixture f;
  WriteTextAtomically(f.scene / "holdout/photo10_render.jpg", "no picture");
  EXPECT_EQ(Occurrences(ReadText(WriteReport(f.input, SilentProgress()).html), "<img "), 3U);
}

TEST(Report, WithoutEvaluationShowsThePhotos) {
  Fixture f;
  f.input.stages.pop_back();
  const std::string html = ReadText(WriteReport(f.input, SilentProgress()).html);
  EXPECT_EQ(Occurrences(html, "<img "), 5U);
  EXPECT_THAT(html, Not(HasSubstr("PSNR")));
}

TEST(Report, OfAPeriodicSceneShowsItsSampling) {
  Fixture f;
  nlohmann::json timed = nlohmann::json::parse(
      R"({"period_frames":150.37,"period_sigma_frames":0.01,"period_s":5.01,"period_from":"moving video",
      "masks":{"found":true,"moving_share":0.25},"warnings":["the camera keeps <step>"],"images_registered":5,
      "sampling":{"samples_per_window":13.3,"window_least":9,"window_most":14,"uniformity":0.83,"covered":0.7,"gaps":[]}})");
  timed["reconstruct"] = nlohmann::json::parse(f.input.stages[0].summary.Text());
  for (int i = 0; i < 15; ++i)
    timed["sampling"]["gaps"].push_back({{"what_to_film", "film phase " + std::to_string(i)}});
  f.input.stages[0] = WorkedStage("timeperiodic", 61.5, timed.dump());
  WriteTextAtomically(f.scene / "timeperiodic/sampling.svg",
                      "<svg xmlns='http://www.w3.org/2000/svg'><style>.soft{}</style></svg>");
  const std::string html = ReadText(WriteReport(f.input, SilentProgress()).html);
  EXPECT_THAT(html, HasSubstr("150.37"));
  EXPECT_THAT(html, HasSubstr("13.3 on average, 9 to 14"));
  EXPECT_THAT(html, HasSubstr("the camera keeps &lt;step&gt;"));
  EXPECT_THAT(html, HasSubstr("film phase 11"));
  EXPECT_THAT(html, HasSubstr("and 3 more gaps"));
  EXPECT_THAT(html, HasSubstr("5 of 6"));  // the cameras' card
  // The plot's style stays its own, and nothing is fetched.
  EXPECT_EQ(Occurrences(html, "data:image/svg+xml;base64,"), 1U);
  EXPECT_THAT(html, Not(HasSubstr(".soft{}")));
  EXPECT_THAT(html, Not(HasSubstr("http:")));
}

TEST(CamerasFromAbove, WedgesPointToWhatTheCamerasSee) {
  const TemporaryFolder folder;
  Scene scene = MakeSmallScene(folder / "images", 5);
  const std::string svg = CamerasFromAboveSvg(scene, {"photo12.png"});
  EXPECT_EQ(Occurrences(svg, "<g class=\"camera\">"), 4U);
  EXPECT_EQ(Occurrences(svg, "<g class=\"held-out\">"), 1U);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  // Every wedge opens upwards in the drawing: forward is where the cameras look, y grows downwards.
  const std::regex polygon(R"re(points="([-\d.]+),([-\d.]+) ([-\d.]+),([-\d.]+) ([-\d.]+),([-\d.]+)")re");
  int wedges = 0;
  for (std::sregex_iterator it(svg.begin(), svg.end(), polygon), end; it != end; ++it, ++wedges) {
    EXPECT_LT(std::stod((*it)[4]), std::stod((*it)[2]));
    EXPECT_LT(std::stod((*it)[6]), std::stod((*it)[2]));
    // Left of the photo (first corner) is left of its right in the drawing: not mirrored.
    EXPECT_LT(std::stod((*it)[3]), std::stod((*it)[5]));
  }
  EXPECT_EQ(wedges, 5);
}

TEST(CamerasFromAbove, HasNoNanWhereAllCamerasAreAtOnePlaceOrLookDown) {
  const TemporaryFolder folder;
  Scene scene = MakeSmallScene(folder / "images", 3);
  for (View& view : scene.views) view.cam_from_world = LookAt({0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  scene.points.clear();
  scene.up = {0, -1, 0};
  const std::string svg = CamerasFromAboveSvg(scene, {});
  EXPECT_EQ(Occurrences(svg, "<polygon"), 3U);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

// A portrait photo as a phone stores it, on its side: thumbnails of it, of what was rendered in its place and of their
// difference stand upright.
TEST(ContactSheet, PicturesStandUprightAsTheirPhotosWereHeld) {
  const TemporaryFolder folder;
  Image8 stored(64, 48, 3, 20);
  for (int y = 0; y < 48; ++y)  // the sky: on the left as it is stored
    for (int x = 0; x < 16; ++x) stored.At(x, y, 2) = 240;
  for (const char* name : {"photo.png", "render.png", "difference.png"}) WriteImage(folder / name, stored);
  const auto thumbnails = MakeThumbnails(
      {{"photo", folder / "photo.png", folder / "render.png", folder / "difference.png", 6}}, 24, SilentProgress());
  ASSERT_EQ(thumbnails.size(), 1U);
  ASSERT_EQ(thumbnails[0].pictures.size(), 3U);
  for (const Image8& picture : thumbnails[0].pictures) {
    EXPECT_EQ(picture.width, 24);
    EXPECT_EQ(picture.height, 32);
    EXPECT_GT(picture.At(12, 2, 2), 200);
    EXPECT_LT(picture.At(12, 29, 2), 60);
  }
}

// The whole way: the manifest's orientation reaches the sheet.
TEST(Report, OfPortraitPhotosHasAnUprightSheet) {
  Fixture f;
  Scene scene = OpenScene(f.scene, {}, SilentProgress());
  const int cell = 320;
  for (View& view : scene.views) view.orientation = 6;
  WriteManifest(scene, f.scene);
  const Image8 sheet = ReadImage8(WriteReport(f.input, SilentProgress()).contact_sheet);
  EXPECT_GT(sheet.height, 2 * cell);  // two rows of pictures higher than wide
}

TEST(ContactSheet, SetsPicturesInRows) {
  const auto picture = [](int w, int h, std::uint8_t v) { return Image8(w, h, 3, v); };
  std::vector<SheetThumbnails> rows(2);
  rows[0].pictures = {picture(10, 8, 1), picture(10, 8, 2), picture(10, 8, 3)};
  rows[1].pictures = {picture(10, 12, 4), picture(10, 12, 5), picture(10, 12, 6)};
  const Image8 sheet = ComposeSheet(rows, 4);
  EXPECT_EQ(sheet.width, 6 + 3 * 16);
  EXPECT_EQ(sheet.height, 6 + 2 * 18);
  EXPECT_EQ(sheet.At(6, 6 + 2, 0), 1);  // centred in a cell of the tallest
  EXPECT_EQ(sheet.At(6 + 32, 6 + 18, 0), 6);
  EXPECT_EQ(sheet.At(0, 0, 0), 255);
}

TEST(Html, InlinePicturesAreBase64) {
  EXPECT_THAT(HtmlInlineJpeg("M", ""), HasSubstr("base64,TQ==\""));
  EXPECT_THAT(HtmlInlineJpeg("Ma", ""), HasSubstr("base64,TWE=\""));
  EXPECT_THAT(HtmlInlineJpeg("Man", ""), HasSubstr("base64,TWFu\""));
  EXPECT_THAT(HtmlInlineJpeg(std::string("\xff\xfe\xfd", 3), ""), HasSubstr("base64,//79\""));
}

}  // namespace
}  // namespace lumi
