#include "render/commands/render_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/sweep.h"
#include "render/tradeoff/tradeoff.h"
#include "render_command_fixture.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/files/video.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using test::HasGl;
using test::Json;
using test::RenderCommand;
namespace fs = std::filesystem;

TEST_F(RenderCommand, APhotosOwnViewIsOfItsOwnMoment) {
  WriteMovingCapture(9);
  for (const std::size_t i : {4U, 5U}) {
    RenderOptions o = Options("view" + std::to_string(i));
    o.view = capture_.scene.views[i].name;
    const Json j = Run(o);
    EXPECT_GT(j["views"][0]["psnr_db"], 60.0) << "the photo itself is there: " << i;
    EXPECT_EQ(j["views"][0].value("time_s", 0.0), *capture_.scene.views[i].time_s);
    EXPECT_FALSE(j["settings"].contains("time-s")) << "as an option it would stop a path";
  }
  RenderOptions other = Options("other");
  other.view = capture_.scene.views[5].name;
  other.settings.time_s = kFirst_s;
  other.decided = {"time-s"};
  EXPECT_LT(Run(other)["views"][0]["psnr_db"], 30.0) << "the user's word is kept";
}

TEST_F(RenderCommand, APathFromSparseSamplesSaysHowNearItIsToAWeightAtEveryPixel) {
  WriteCapture(9);
  RenderOptions o = StandingStill("sparse");
  o.fidelity_db = 40;
  const Json sparse = Run(o);
  EXPECT_EQ(sparse["fidelity"]["wanted_db"], 40);
  EXPECT_GE(sparse["fidelity"]["db"].get<double>(), 40);
  EXPECT_GT(sparse["fidelity"]["pixel_ms"].get<double>(), 0);
  EXPECT_NE(sparse["settings"]["grid"], "pixel");
  EXPECT_THAT(Describe(RunRender(o, SilentProgress())), testing::HasSubstr("candidates 25x25, k 4"));
  RenderOptions pixel = o;
  pixel.output = folder_ / "pixel";
  pixel.fidelity_db.reset();
  Run(pixel);
  EXPECT_GE(Psnr(o.output / "frames" / "frame_000000.png", pixel.output / "frames" / "frame_000000.png"), 40);
  // What chooses too, and what is no path.
  RenderOptions wrong = o;
  wrong.budget_ms = 20;
  EXPECT_THROW(Run(wrong), UsageError);
  wrong = o;
  wrong.settings.grid_columns = wrong.settings.grid_rows = 8;
  wrong.decided.Add("grid");
  EXPECT_THROW(Run(wrong), UsageError);
  wrong = o;
  wrong.path.clear();
  wrong.view = capture_.scene.views[0].name;
  EXPECT_THROW(Run(wrong), UsageError);
  wrong = o;
  wrong.fidelity_db = 0;
  EXPECT_THROW(Run(wrong), UsageError);
}

TEST_F(RenderCommand, PartsOfAPathJoinToTheWholesBytes) {
  WriteCapture(9);
  const auto of_path = [&](const char* out) {
    RenderOptions o = Options(out);
    o.seconds = 0.5;
    o.fps = 14;  // 7 frames
    o.width_px = 40;
    return o;
  };
  const Json whole = Run(of_path("whole"));
  ASSERT_EQ(whole["frames"], 7);
  RenderOptions part = of_path("parts");
  part.shard = Part{1, 3};
  EXPECT_EQ(Run(part)["frames"], 2);  // 2 and 3
  EXPECT_TRUE(fs::exists(folder_ / "parts" / "frames" / "frame_000002.png"));
  EXPECT_FALSE(fs::exists(folder_ / "parts" / "frames" / "frame_000004.png"));
  part.shard.reset();
  part.frames = FrameRange{4, 6};
  EXPECT_EQ(Run(part)["frames"], 3);
  part.frames.reset();
  part.shard = Part{0, 3};
  EXPECT_EQ(Run(part)["frames"], 2);
  const Json again = Run(part);
  EXPECT_EQ(again["frames_reused"], 2) << "a part that was made is not made again";
  // The whole takes the parts' frames, and adds the film.
  RenderOptions joined = of_path("parts");
  joined.video = true;
  const Json j = Run(joined);
  EXPECT_EQ(j["frames"], 7);
  EXPECT_EQ(j["frames_reused"], 7);
  for (int i = 0; i < 7; ++i) {
    const fs::path name = fs::path("frames") / ("frame_00000" + std::to_string(i) + ".png");
    EXPECT_EQ(ReadText(folder_ / "whole" / name), ReadText(folder_ / "parts" / name)) << i;
  }
  // Frames of another size are neither joined nor lost, by a part or by the whole.
  for (const bool whole_run : {false, true}) {
    RenderOptions other = part;
    if (whole_run) other.shard.reset();
    other.width_px = 36;
    try {
      Run(other);
      FAIL() << "frames of another size were joined";
    } catch (const UsageError& e) {
      EXPECT_THAT(e.what(), testing::HasSubstr("size 40"));
      EXPECT_THAT(e.what(), testing::HasSubstr("size 36"));
    }
    EXPECT_TRUE(fs::exists(folder_ / "parts" / "frames" / "frame_000006.png"));
  }
  const auto why_not = [&](const RenderOptions& other) {
    try {
      Run(other);
    } catch (const UsageError& e) {
      return std::string(e.what());
    }
    return std::string("joined");
  };
  RenderOptions other = part;
  other.settings.k = 1;
  other.decided.Add("k");
  EXPECT_THAT(why_not(other), testing::HasSubstr("\"k\":1"));
  Mesh moved = capture_.proxy;
  moved.vertices[0].x() += 0.01;
  WriteMesh(ProxyPath(part.scene, "moved"), moved);
  other = part;
  other.proxy = "moved";
  EXPECT_THAT(why_not(other), testing::EndsWith(": other proxy"));
  // What a killed run left without saying what it is of is no part of anything.
  fs::remove(folder_ / "parts" / "frames" / "frames.txt");
  EXPECT_THROW(Run(part), UsageError);
}

TEST_F(RenderCommand, APartOfAPathIsRefusedWhereItWouldSayNothing) {
  WriteCapture(9);
  const auto refused = [&](auto change) {
    RenderOptions o = Options("refused");
    o.seconds = 0.5;
    o.fps = 4;
    o.width_px = 16;
    o.shard = Part{0, 2};
    change(o);
    EXPECT_THROW(Run(o), UsageError);
  };
  refused([](RenderOptions& o) { o.frames = FrameRange{0, 1}; });
  refused([](RenderOptions& o) { o.video = true; });
  refused([](RenderOptions& o) { o.output = o.output.string() + ".mp4"; });
  refused([](RenderOptions& o) { o.budget_ms = 10; });
  refused([](RenderOptions& o) { o.fidelity_db = 40; });
  refused([](RenderOptions& o) { o.holdout = 8; });
  refused([&](RenderOptions& o) { o.view = capture_.scene.views[0].name; });
  refused([](RenderOptions& o) {
    o.shard.reset();
    o.frames = FrameRange{1, 2};  // of two frames
  });
  for (const char* text : {"", "1", "1/1", "2/2", "-1/2", "1/2x", "a/b", "0/0", "99999999999/999999999999"})
    EXPECT_THROW(PartFrom(text), UsageError) << text;
  for (const char* text : {"", "-", "3-2", "1-", "-1", "1-2-3", "x"})
    EXPECT_THROW(FrameRangeFrom(text), UsageError) << text;
  EXPECT_EQ(FrameRangeFrom("7").last, 7U);
  EXPECT_EQ(PartFrom("1/4").count, 4);
}

TEST_F(RenderCommand, PhotosThatDoNotFitIntoMemoryGiveTheSameFrames) {
  capture_ = test::MakeCapture(13, 400);  // 6 MB with their pyramids, and 4 MB is the least that photos are left
  WriteCapture();
  RenderOptions o = StandingStill("all");
  o.settings.k = 2;
  o.decided.Add("k");
  const Json all = Run(o);
  EXPECT_FALSE(all.contains("photos_in_memory"));
  o.output = folder_ / "some";
  o.memory_mb = 1;
  const Json some = Run(o);
  ASSERT_TRUE(some.contains("photos_in_memory"));
  EXPECT_GT(some["photos_in_memory"]["read"], 0);
  EXPECT_LE(some["photos_in_memory"]["most_mb"], 4.0);
  const fs::path frame = fs::path("frames") / "frame_000001.png";
  EXPECT_EQ(ReadText(folder_ / "all" / frame), ReadText(folder_ / "some" / frame));
  // What would read all of them says so.
  o.output = folder_ / "measured";
  o.settings.similarity = Similarity::kFull;
  o.settings.correlation = Correlation::kMeasured;
  o.decided.Add("similarity");
  EXPECT_THROW(Run(o), UsageError);
}

TEST_F(RenderCommand, MeasuredCorrelationBecomesLeavesThatTheSummaryNames) {
  WriteCapture(25);
  RenderOptions o = Options("measured");
  o.holdout = 8;
  o.settings.correlation = Correlation::kMeasured;
  o.settings.similarity = Similarity::kFull;
  o.decided.Add("correlation");
  const Json j = Run(o);
  EXPECT_EQ(j["settings"]["correlation"], "falling-leaves");
  EXPECT_NEAR(j["settings"]["r-max-deg"].get<double>(), j["correlation"]["r_max_deg"].get<double>(), 1e-9);
  EXPECT_GE(j["correlation"]["bins"].size(), 3u);
  RenderOptions wrong = o;
  wrong.settings.r_max_rad *= 2;
  EXPECT_THROW(Run(wrong), UsageError);
  // By place: what the summary says can be given back, and is measured again.
  o.settings.correlation_regions = 3;
  const Json places = Run(o);
  EXPECT_EQ(places["settings"]["correlation"], "measured");
  EXPECT_GE(places["correlation"]["kinds"].size(), 1u);
  EXPECT_NE(places["psnr_mean_db"], j["psnr_mean_db"]);
  wrong = o;
  wrong.settings.correlation = Correlation::kFallingLeaves;
  EXPECT_THROW(Run(wrong), UsageError);
}

TEST_F(RenderCommand, APublishedMethodRendersAViewAndRefusesWhatIsThisRenderersOwn) {
  WriteCapture(9);
  RenderOptions o = Options("published");
  o.view = capture_.scene.views[4].name;
  o.leave_out = true;
  o.settings.method = Algorithm::kPulli1997;
  o.decided.Add("method");
  const Json published = Run(o);
  EXPECT_GT(published["views"][0]["psnr_db"], 20.0);
  EXPECT_EQ(published["settings"]["method"], "pulli-1997");
  RenderOptions own = o;
  own.settings.method = Algorithm::kUlr;
  EXPECT_NE(Run(own)["views"][0]["psnr_db"], published["views"][0]["psnr_db"]);
  const auto refused = [&](auto change) {
    RenderOptions wrong = o;
    change(wrong);
    EXPECT_THROW(Run(wrong), UsageError);
  };
  refused([](RenderOptions& r) { r.settings.grid_columns = r.settings.grid_rows = 25; });
  refused([](RenderOptions& r) { r.settings.similarity = Similarity::kFull; });
  refused([](RenderOptions& r) { r.backend = "gl"; });
  refused([](RenderOptions& r) {
    r.settings.k = 2;
    r.decided.Add("k");
  });
  refused([](RenderOptions& r) { r.show = "weights"; });
  refused([](RenderOptions& r) { r.effects = "fov,resolution"; });
  refused([](RenderOptions& r) { r.budget_ms = 30; });
  refused([](RenderOptions& r) {
    r.settings.method = Algorithm::kHeigl1999;
    r.settings.method_count = 3;
  });
  refused([](RenderOptions& r) {
    r.settings.method = Algorithm::kUlr;
    r.settings.method_count = 3;
  });
  // The baseline of a held-out run stays the nearest photo, also where a pair cannot be made of one.
  RenderOptions held = Options("published-held-out");
  held.holdout = 4;
  held.settings.method = Algorithm::kSeitzDyer1996;
  held.decided.Add("method");
  EXPECT_GT(Run(held)["nearest_photo_psnr_mean_db"], 10.0);
}

TEST_F(RenderCommand, FalseColoursHaveALegendAndPixelsTellTheirPhotos) {
  WriteCapture(9);
  RenderOptions o = Options("colours");
  o.view = capture_.scene.views[4].name;
  o.leave_out = true;
  o.show = "false-color";
  o.pixels = {{20.5, 20.5}, PixelFrom("30,25.5")};
  const Json view = Run(o)["views"][0];
  std::map<std::string, std::string> colors;
  double shares = 0, last = 1;
  for (const Json& entry : view["legend"]) {
    colors[entry["photo"]] = entry["color"];
    shares += entry["share"].get<double>();
    EXPECT_LE(entry["share"], last) << "the largest first";
    last = entry["share"];
  }
  EXPECT_NEAR(shares, view["coverage"].get<double>(), 0.01) << "what a thousandth gives is left out";
  EXPECT_EQ(colors.count(o.view), 0U);
  std::set<std::string> different;
  for (const auto& [photo, color] : colors) different.insert(color);
  EXPECT_EQ(different.size(), colors.size());
  ASSERT_EQ(view["pixels"].size(), 2U);
  for (const Json& pixel : view["pixels"]) {
    double weights = 0;
    for (const Json& photo : pixel["photos"]) {
      weights += photo["weight"].get<double>();
      EXPECT_EQ(photo["color"], colors[photo["photo"]]);
    }
    EXPECT_NEAR(weights, 1, 1e-5);
    EXPECT_EQ(pixel["point"].size(), 3U);
  }
  const auto legends = [&] {
    int found = 0;
    for (const auto& entry : fs::directory_iterator(o.output)) found += entry.path().extension() == ".svg";
    return found;
  };
  EXPECT_EQ(legends(), 1);
  o.pixels = {{1e4, 2}};
  EXPECT_THROW(Run(o), UsageError);
  o.view.clear();
  o.leave_out = false;
  o.show = "color";
  EXPECT_THROW(Run(o), UsageError) << "of a path";
  for (const char* text : {"", "1", "1,", ",1", "a,b", "1,2,3", "nan,1"})
    EXPECT_THROW(PixelFrom(text), UsageError) << text;
}

TEST_F(RenderCommand, HeldOutPhotosAreOfTheirOwnMoments) {
  WriteMovingCapture(13);
  RenderOptions o = Options("own");
  o.holdout = 3;
  const double own_db = Run(o)["psnr_mean_db"];
  o.settings.time_s = kFirst_s;
  o.decided = {"time-s"};
  const double first_db = Run(o)["psnr_mean_db"];
  o.decided = {"time"};
  const double untimed_db = Run(o)["psnr_mean_db"];
  EXPECT_GT(own_db, first_db + 3);
  EXPECT_GT(own_db, untimed_db + 3);
}

TEST_F(RenderCommand, TimeRunsAlongAPathFromTheFirstPhotosOn) {
  WriteMovingCapture(9);
  ASSERT_EQ(Run(StandingStill("path"))["frames"], 2);
  EXPECT_LT(Psnr(folder_ / "path/frames/frame_000000.png", folder_ / "path/frames/frame_000001.png"), 20);
  for (const int i : {0, 1}) {
    RenderOptions o = StandingStill("stopped" + std::to_string(i));
    o.settings.time_s = kFirst_s + 0.5 * i;
    o.decided = {"time-s"};
    Run(o);
    const std::string frame = "frames/frame_00000" + std::to_string(i) + ".png";
    EXPECT_EQ(Psnr(o.output / frame, folder_ / "path" / frame), Psnr(o.output / frame, o.output / frame));
    EXPECT_EQ(ReadText(o.output / "frames/frame_000000.png"), ReadText(o.output / "frames/frame_000001.png"));
  }
}

TEST_F(RenderCommand, MeasuresEachViewAtItsOwnMoment) {
  WriteMovingCapture(9);
  MeasureOptions o;
  o.scene = scene();
  o.output = folder_ / "ablation";
  o.view = capture_.scene.views[5].name;
  o.width_px = 32;
  o.repeats = 1;
  const auto nearest_db = [&] {
    const Json j = Json::parse(RunAblation(o, SilentProgress()).keys.Text());
    EXPECT_EQ(j["rows"][3]["settings"].contains("time-s"), o.decided.Has("time-s"));
    return j["rows"][3]["psnr_photo_db"].get<double>();
  };
  const double own_db = nearest_db();
  o.settings.time_s = kFirst_s;
  o.decided = {"time-s"};
  EXPECT_GT(own_db, nearest_db() + 3);
}

TEST_F(RenderCommand, EffectsAreChosenAtTheSizeThatIsRendered) {
  WriteCapture(9);
  const auto prefiltered = [&](int width_px) {
    RenderOptions o = Options("holdout");
    o.holdout = 4;
    o.width_px = width_px;
    MeasureOptions m;
    m.scene = scene();
    m.width_px = width_px;
    const Json j = Run(o);
    EXPECT_EQ(Workbench(m, "", SilentProgress()).settings().prefilter, j["settings"]["prefilter"] == "on");
    return j["settings"]["prefilter"] == "on";
  };
  EXPECT_TRUE(prefiltered(16));
  EXPECT_FALSE(prefiltered(64));
}

TEST_F(RenderCommand, TheOptimumsCountsAreOfAllFramesAndNoBaseline) {
  WriteCapture(17);
  RenderOptions o = Optimum(Options("holdout"));
  o.holdout = 8;
  o.width_px = 16;
  o.settings.r_max_rad = 10 * kRadPerDeg;  // photos stand up to 6.5 degrees apart
  const Json holdout = Run(o)["optimum"];
  EXPECT_GT(holdout["cameras_mean"], 1.5);
  EXPECT_LT(holdout["small_sums"].get<long>(), holdout["samples"].get<long>() / 2);
  EXPECT_GT(holdout["samples"].get<long>(), 2 * 16 * 12) << "of three views";
  const Json path = Run(Optimum(StandingStill("path")))["optimum"];
  RenderOptions one = Optimum(Options("one"));
  one.view = capture_.scene.views[4].name;
  one.width_px = 32;
  EXPECT_GT(path["samples"].get<long>(), 1.5 * Run(one)["optimum"]["samples"].get<double>());
}

TEST_F(RenderCommand, FramesOfAnotherPhotosMeasureOrOfOtherPhotosAreRenderedAgain) {
  WriteCapture(9);
  RenderOptions o = StandingStill("path");
  o.show = "weights";
  o.of = "view104";
  EXPECT_EQ(Run(o)["frames_reused"], 0);
  const RenderSummary summary = RunRender(o, SilentProgress());
  const Json again = Printed(summary);
  EXPECT_EQ(again["frames_reused"], 2);
  EXPECT_TRUE(again["ms_per_frame"].is_null());
  EXPECT_THAT(Describe(summary), testing::HasSubstr("2 frames, all there already"));
  o.of = "view105";
  EXPECT_EQ(Run(o)["frames_reused"], 0);
  WriteImage(scene() / "images/view105.png", Image8(64, 48, 3, 90));
  EXPECT_EQ(Run(o)["frames_reused"], 0);
  EXPECT_EQ(Run(o)["frames_reused"], 2);
}

TEST_F(RenderCommand, AVideoOfFramesThatWereThereIsTheVideoOfFramesThatAreRendered) {
  WriteCapture(9);
  for (const char* format : {"png", "exr"}) {
    RenderOptions o = StandingStill(format);
    o.format = format;
    o.video = true;
    // Photos that end fade into holes: half-transparent pixels.
    o.settings.fov_feather = 0.4;
    o.settings.k = 1;
    CameraPath path = ReadCameraPath(o.path);
    for (PathKey& key : path.keys) key.vertical_fov_rad = 1.6;
    WriteCameraPath(o.path, path);
    Run(o);
    const Image8 rendered = VideoReader(o.output / "path.mp4").Next()->rgb;
    ASSERT_EQ(Run(o)["frames_reused"], 2);
    const Image8 reused = VideoReader(o.output / "path.mp4").Next()->rgb;
    EXPECT_GT(Compare(rendered, reused).psnr_db, 48) << format;  // PNG's 8 bits of a colour over 8 bits of alpha
  }
}

TEST_F(RenderCommand, OnlyPicturesAreComparedWithPhotos) {
  WriteCapture(9);
  for (const std::string show : {"color", "difference", "weights", "false-color", "cameras"}) {
    RenderOptions o = Options(show);
    o.view = "view104";
    o.show = show;
    const RenderSummary summary = RunRender(o, SilentProgress());
    const bool picture = show == "color" || show == "difference";
    EXPECT_EQ(Printed(summary)["views"][0].contains("psnr_db"), picture) << show;
    EXPECT_EQ(Describe(summary).find("PSNR") != std::string::npos, picture) << show;
  }
}

TEST_F(RenderCommand, RefusesAPhaseThatIsNoNumber) {
  WriteMovingCapture(5);
  RenderOptions o = Options("out");
  for (const double phase : {double(NAN), double(INFINITY)}) {
    o.phase = phase;
    EXPECT_THROW(RunRender(o, SilentProgress()), UsageError);
  }
}

// ---- where OpenGL is not there, there is nothing to see

TEST_F(RenderCommand, ABudgetFindsTheGridThatOpenGlNeedsForTheOptimum) {
  WriteCapture(9);
  if (!HasGl(capture_)) GTEST_SKIP() << "no OpenGL 4.3 here";
  RenderOptions o = Optimum(Options("out"));
  o.backend = "gl";
  o.budget_ms = 100;
  o.view = "view104";
  const Json j = Run(o);
  EXPECT_EQ(j["settings"]["similarity"], "full");
  EXPECT_NE(j["settings"]["grid"], "pixel");
}

TEST_F(RenderCommand, AnAblationInOpenGlIsComparedWithTheOptimum) {
  WriteCapture(9);
  if (!HasGl(capture_)) GTEST_SKIP() << "no OpenGL 4.3 here";
  MeasureOptions o;
  o.scene = scene();
  o.output = folder_ / "ablation";
  o.backend = "gl";
  o.width_px = 32;
  o.repeats = 1;
  const Json j = Json::parse(RunAblation(o, SilentProgress()).keys.Text());
  EXPECT_EQ(j["compared_with"], "optimum");
  EXPECT_EQ(j["rows"][0]["settings"]["backend"], "cpu");
  EXPECT_EQ(j["rows"][1]["settings"]["backend"], "gl");
  for (const Json& row : j["rows"]) EXPECT_FALSE(row.contains("refused")) << row["name"];
}

TEST(ShowNames, HaveEveryHeatMap) {
  for (const HeatMap& map : HeatMaps()) EXPECT_THAT(ShowNames(), testing::Contains(std::string(map.name)));
}

TEST(Budget, SamplesThatDecideNothingAreNotTried) {
  for (const FrontPoint& p : ProbeTable({}, {{"k", "all"}}))
    EXPECT_TRUE(!p.settings.Sparse() || HasSamples(p.settings)) << p.name;
}

// --- A proxy of each view's own

TEST_F(RenderCommand, PerViewTriangulatesThePointsInEachView) {
  capture_ = test::MakeCapture(12, 64);
  capture_.scene.points = test::SeenPoints(capture_);
  WriteCapture();
  RenderOptions o = Options("");
  o.output.clear();
  o.holdout = 4;
  o.proxy = "truth";
  const Json truth = Run(o);
  o.proxy = "per-view";
  const Json own = Run(o);
  EXPECT_EQ(own["proxy"], "per-view");
  EXPECT_GT(own["coverage"], 0.95);
  EXPECT_GT(own["psnr_mean_db"].get<double>(), truth["psnr_mean_db"].get<double>() - 6);
  EXPECT_GT(own["psnr_mean_db"].get<double>(), truth["nearest_photo_psnr_mean_db"].get<double>());
  for (const Json& e : own["effects"]) EXPECT_FALSE(e["name"] == "visibility" && e["on"] == true);
  // Each frame its own: two views in one run are as they are alone.
  RenderOptions path = StandingStill("path");
  path.proxy = "per-view";
  EXPECT_EQ(Run(path)["frames"], 2);
  EXPECT_EQ(Run(path)["frames_reused"], 2);
  if (!HasGl(capture_)) GTEST_SKIP() << "no OpenGL 4.3 here";
  o.backend = "gl";
  const Json gl = Run(o);
  EXPECT_NEAR(gl["psnr_mean_db"].get<double>(), own["psnr_mean_db"].get<double>(), 0.3);
}

TEST_F(RenderCommand, PerViewSaysWhatItCannotDo) {
  WriteCapture(4);  // its points have no tracks
  RenderOptions o = Options("out");
  o.view = capture_.scene.views[0].name;
  o.proxy = "per-view";
  EXPECT_THROW(RunRender(o, SilentProgress()), DataError);
  capture_.scene.points = test::SeenPoints(capture_);
  WriteCapture();
  o.settings.visibility = true;
  o.decided = {"visibility"};
  EXPECT_THROW(RunRender(o, SilentProgress()), UsageError);
}

}  // namespace
}  // namespace lumi
