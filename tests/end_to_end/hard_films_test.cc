// lumi-pipeline FILM --stabilize on films of what is hard for it, from pictures to pictures: simulated, tracked, drawn
// and scored by the real programs. What single steps do with such motions is in tests/stabilize; here nothing but the
// film is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/program/subprocess.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kFrames = 60;  // 2 s: the jitter needs features seen for 1.4
constexpr double kTrembleBoundPx =
    0.15;  // of 240 px wide films; measured 0.05 to 0.08, of which 0.05 is the corner follower's own
constexpr double kTrembleShare = 0.2;  // of the film's own tremble, at most

json Parsed(const char* text) { return json::parse(text); }

// A wall, a floor and crates on it, filmed from 4 m.
json Place(bool planar = false) {
  json scene = Parsed(R"({"cameras": [{"size": [240, 180], "fov_deg": 60}],
    "lights": [{"towards": [-0.4, -0.8, 1], "size_deg": 1}], "ambient": {"sky": "#909090", "ground": "#605848"},
    "materials": [
      {"name": "wall", "texture": {"kind": "cells", "size": 0.25, "colors": ["#a06040", "#e0d0b0", "#304860"]}},
      {"name": "floor", "texture": {"kind": "tiles", "size": 0.3, "colors": ["#9a948a", "#6b7a85", "#b5a98c"], "variation": 0.2, "grain": 0.3, "grain_size": 0.02}},
      {"name": "crate", "texture": {"kind": "glyphs", "size": [0.06, 0.09], "colors": ["#d8c090", "#402010"]}},
      {"name": "bus", "texture": {"kind": "cells", "size": 0.12, "colors": ["#c02020", "#f0f0f0", "#202020"]}}],
    "objects": [{"kind": "quad", "size": [30, 12], "position": [0, 3, 1], "rotate_deg": [90, 0, 0], "material": "wall"}]})");
  if (planar) return scene;
  scene["objects"].push_back(
      Parsed(R"({"kind": "quad", "size": [30, 20], "position": [0, -4, 0], "material": "floor"})"));
  const double crates[][3] = {{-2.2, 1.5, 1.2}, {-0.9, 0.2, 0.7}, {0.6, 1.0, 1.0},
                              {1.7, -0.3, 0.6}, {3, 1.8, 1.4},    {-3.4, 0.5, 0.9}};
  for (const auto& [x, y, height] : crates)
    scene["objects"].push_back({{"kind", "box"},
                                {"size", {0.7, 0.7, height}},
                                {"position", {x, y, height / 2}},
                                {"rotate_deg", {0, 0, 20 * x}},
                                {"material", "crate"}});
  return scene;
}

const json kGait = {{"bob", 0.03}, {"sway", 0.02}, {"shake_deg", 0.8}};

json Walk(int frames = kFrames) {
  return {{"kind", "walk"},
          {"views", frames},
          {"from", {-1.0 * frames / 90, -4, 1.4}},
          {"to", {1.0 * frames / 90, -4, 1.4}},
          {"direction", {0, 1, -0.1}},
          {"gait", kGait}};
}

json InHand(double shake_deg) {
  return {{"kind", "wave"},         {"views", kFrames},
          {"centre", {0, -4, 1.4}}, {"direction", {0, 1, -0.1}},
          {"amplitude", {0, 0, 0}}, {"hand", {{"drift", 0}, {"shake_deg", shake_deg}}}};
}

// What lumi-pipeline says of such a film; the film stays in `folder`.
json Steadied(const TemporaryFolder& folder, json scene, const json& path) {
  scene["name"] = "film";
  scene["path"] = path;
  WriteTextAtomically(folder / "film.json", scene.dump());
  const auto made = RunProgram(
      {"lumi-simulate", (folder / "film.json").string(), "--video", "--quiet", "-o", (folder / "film").string()});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  const auto run = RunProgram({"lumi-pipeline", (folder / "film" / "video.mp4").string(), "--stabilize", "smooth", "-o",
                               (folder / "steady.mp4").string(), "--json", "--quiet"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? json::parse(run.out) : json();
}

void ExpectSteady(const json& summary, const std::string& structure) {
  ASSERT_TRUE(summary.is_object());
  ASSERT_EQ(summary["windows"].size(), 1U);
  EXPECT_EQ(summary["windows"][0]["structure"], structure);
  const double before = summary["score"]["videos"][0]["jitter_px"], after = summary["score"]["videos"][1]["jitter_px"];
  EXPECT_LT(after, kTrembleBoundPx);
  EXPECT_LT(after, kTrembleShare * before);
  EXPECT_GT(summary["kept_scale"].get<double>(), 0.85);
}

TEST(HardFilm, MotionBlurIsNoShake) {
  const TemporaryFolder folder;
  json scene = Place();
  scene["effects"]["motion_blur_s"] = 0.02;
  ExpectSteady(Steadied(folder, scene, Walk()), "points");
}

TEST(HardFilm, ARollingShutterIsNoShake) {
  const TemporaryFolder folder;
  json scene = Place();
  scene["effects"]["rolling_shutter_s"] = 0.02;
  ExpectSteady(Steadied(folder, scene, Walk()), "points");
}

TEST(HardFilm, SomethingLargePassesBetweenCameraAndScene) {
  const TemporaryFolder folder;
  json scene = Place();
  scene["objects"].push_back(Parsed(
      R"({"kind": "box", "size": [1.5, 0.4, 1.5], "position": [-1.2, -1.6, 1.3], "material": "bus", "spin": {"axis": [0, 0, 1], "centre": [0, 18, 0], "period_s": 120}})"));
  ExpectSteady(Steadied(folder, scene, Walk()), "points");
}

TEST(HardFilm, OfAWallAlone) {
  const TemporaryFolder folder;
  ExpectSteady(Steadied(folder, Place(true), Walk()), "homographies");
}

TEST(HardFilm, OfACameraThatOnlyTurns) {
  const TemporaryFolder folder;
  ExpectSteady(Steadied(folder, Place(), InHand(2)), "homographies");
}

TEST(HardFilm, OfAZoomInAShakingHand) {
  const TemporaryFolder folder;
  json path = InHand(1);
  path["zoom"] = {1, 1.8};
  ExpectSteady(Steadied(folder, Place(), path), "homographies");
}

TEST(HardFilm, ADriveWhoseFocusOfExpansionLeavesThePicture) {
  const TemporaryFolder folder;
  const json path = {{"kind", "drive"},      {"views", kFrames},        {"from", {-1.5, -6, 1.4}},
                     {"to", {0.3, -4, 1.4}}, {"look_at", {-0.8, 1, 1}}, {"gait", kGait}};
  ExpectSteady(Steadied(folder, Place(), path), "points");
}

TEST(HardFilm, OfATripodComesOutAsItWentIn) {
  const TemporaryFolder folder;
  const json summary = Steadied(folder, Place(), InHand(0));
  ASSERT_TRUE(summary.is_object());
  EXPECT_EQ(summary["windows"][0]["structure"], "homographies");
  const json& steady = summary["score"]["videos"][1];
  EXPECT_LT(steady["jitter_px"].get<double>(), 0.02);
  // A pixel of 240 across the picture is 0.004.
  EXPECT_GT(steady["cropping_ratio"].get<double>(), 0.996);
  EXPECT_GT(steady["distortion"].get<double>(), 0.996);
}

TEST(HardFilm, OfTenFramesIsMadeWithoutTheFiguresItIsTooShortFor) {
  const TemporaryFolder folder;
  const json summary = Steadied(folder, Place(), Walk(10));
  ASSERT_TRUE(summary.is_object());
  EXPECT_EQ(summary["frames"], 10);
  EXPECT_TRUE(summary["score"]["videos"][1]["stability"].is_null());
  EXPECT_TRUE(fs::exists(folder / "steady.mp4"));
}

TEST(HardFilm, WithoutAnythingToFollowIsKeptAsItIsAndSaysSo) {
  const TemporaryFolder folder;
  const fs::path blank = folder / "blank.avi", out = folder / "steady.mp4";
  ASSERT_EQ(RunSubprocess({"ffmpeg", "-v", "error", "-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=1", "-c:v",
                           "mpeg4", blank.string()})
                .exit_code,
            0);
  const auto run = RunProgram({"lumi-pipeline", blank.string(), "--stabilize", "smooth", "-o", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, testing::HasSubstr("nothing to follow"));
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["frames"], 30);
  EXPECT_GT(summary["kept_scale"].get<double>(), 0.999);
  EXPECT_TRUE(summary["score"].is_null());
}

}  // namespace
}  // namespace lumi
