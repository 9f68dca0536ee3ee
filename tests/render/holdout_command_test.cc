// lumi-render --holdout as a whole: what it leaves out, over which proxy, and what it says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture_files.h"
#include "projective_capture.h"
#include "render/commands/render_command.h"
#include "render/holdout/holdout.h"
#include "render/tradeoff/workbench.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/support/messages_kept.h"

namespace lumi {
namespace {

using HoldoutJson = nlohmann::ordered_json;

class HoldoutCommand : public testing::Test {
 protected:
  void WriteCapture(int views) {
    capture_ = test::MakeCapture(views, 64);
    test::WriteAsScene(capture_, scene());
  }
  // The true proxy, moved away from the cameras.
  void WriteMoved(const std::string& name, double z) const {
    Mesh moved = capture_.proxy;
    for (auto& v : moved.vertices) v.z() += z;
    WriteMesh(ProxyPath(scene(), name), moved);
  }
  std::filesystem::path scene() const { return folder_ / "scene"; }
  RenderOptions Options() const {
    RenderOptions o;
    o.scene = scene();
    o.effects = "fov";  // the same whatever the views are
    return o;
  }
  RenderOptions HeldOut(int holdout) const {
    RenderOptions o = Options();
    o.holdout = holdout;
    return o;
  }
  HoldoutJson Run(const RenderOptions& o) { return HoldoutJson::parse(JsonKeys(RunRender(o, messages_)).Text()); }
  // Of one photo, without that photo.
  double AloneDb(std::size_t view, const std::string& proxy) {
    RenderOptions o = Options();
    o.output = folder_ / "alone";
    o.proxy = proxy;
    o.view = capture_.scene.views[view].name;
    o.leave_out = true;
    return Run(o)["views"][0]["psnr_db"];
  }

  TemporaryFolder folder_;
  test::Capture capture_;
  MessagesKept messages_;
};

TEST_F(HoldoutCommand, EachPhotoIsRenderedFromAllTheOthers) {
  WriteCapture(7);
  const HoldoutJson j = Run(HeldOut(kHoldoutAuto));
  EXPECT_EQ(j["holdout"], "each") << "of so few photos";
  EXPECT_FALSE(j.contains("fold"));
  EXPECT_EQ(j["frames"], 7);
  ASSERT_EQ(j["views"].size(), 7U);
  double mean_db = 0, mean_seen = 0;
  for (std::size_t i = 0; i < 7; ++i) {
    const HoldoutJson& v = j["views"][i];
    EXPECT_EQ(v["name"], capture_.scene.views[i].name) << "in the order of names";
    EXPECT_EQ(v["psnr_db"], AloneDb(i, "truth")) << i;
    EXPECT_NE(v["nearest_photo"], v["name"]);
    mean_db += v["psnr_db"].get<double>() / 7;
    mean_seen += v["seen"].get<double>() / 7;
  }
  EXPECT_NEAR(j["psnr_mean_db"].get<double>(), mean_db, 1e-9);
  EXPECT_NEAR(j["seen"].get<double>(), mean_seen, 1e-9);
}

TEST_F(HoldoutCommand, SaysHowWellSeenPixelsAreRendered) {
  WriteCapture(9);
  const HoldoutJson j = Run(HeldOut(4));
  EXPECT_EQ(j["holdout"], 4);
  EXPECT_EQ(j["fold"], "report");
  EXPECT_EQ(j["proxy_evaluated"], "truth");
  EXPECT_FALSE(j.contains("seen_proxy"));
  for (const char* key : {"psnr_mean_db", "psnr_seen_mean_db", "seen", "ssim_mean", "nearest_photo_psnr_mean_db",
                          "nearest_photo_psnr_seen_mean_db", "nearest_photo_coverage_mean"})
    EXPECT_TRUE(j[key].is_number()) << key;
  for (const HoldoutJson& v : j["views"])
    for (const char* key : {"psnr_db", "psnr_seen_db", "seen", "ssim", "coverage", "nearest_photo_psnr_db",
                            "nearest_photo_psnr_seen_db", "nearest_photo_coverage"})
      EXPECT_TRUE(v[key].is_number()) << key;
  // At the ends of the arc a side of the picture is seen by one photo or none.
  EXPECT_LT(j["views"][0]["seen"], 0.99);
  EXPECT_GT(j["views"][0]["seen"], 0.5);
  EXPECT_GT(j["views"][1]["seen"], j["views"][0]["seen"]);
  EXPECT_GT(j["psnr_seen_mean_db"], j["psnr_mean_db"]);
  // No setting changes which pixels are seen.
  RenderOptions blurred = HeldOut(4);
  blurred.effects = "none";
  blurred.settings.k = 1;
  const HoldoutJson other = Run(blurred);
  EXPECT_EQ(other["seen"], j["seen"]);
  EXPECT_NE(other["psnr_seen_mean_db"], j["psnr_seen_mean_db"]);
  const std::string text = Describe(RunRender(HeldOut(4), messages_));
  for (const char* part : {"over seen", "seen", "nearest photo", "coverage"})
    EXPECT_THAT(text, testing::HasSubstr(part));
}

TEST_F(HoldoutCommand, WithoutPixelsThatTwoPhotosSeeThereIsNoFigure) {
  WriteCapture(2);  // each is rendered from the other one
  const HoldoutJson j = Run(HeldOut(kHoldoutEach));
  EXPECT_EQ(j["seen"], 0);
  EXPECT_FALSE(j.contains("psnr_seen_mean_db"));
  EXPECT_FALSE(j.contains("nearest_photo_psnr_seen_mean_db"));
  EXPECT_FALSE(j["views"][0].contains("psnr_seen_db"));
  EXPECT_TRUE(j["psnr_mean_db"].is_number());
}

TEST_F(HoldoutCommand, AProxyMadeWithoutThePhotosStandsIn) {
  WriteCapture(9);
  const HoldoutJson all = Run(HeldOut(4));
  EXPECT_THAT(messages_.all, testing::Not(testing::HasSubstr("in place of")));
  WriteMoved("moved", 1);
  WriteMoved("truth-without-4", 1);
  const HoldoutJson evaluated = Run(HeldOut(4));
  EXPECT_EQ(evaluated["proxy"], "truth");
  EXPECT_EQ(evaluated["proxy_evaluated"], "truth-without-4");
  EXPECT_THAT(messages_.all, testing::HasSubstr("truth-without-4, made without them, in place of truth"));
  RenderOptions moved = HeldOut(4);
  moved.proxy = "moved";
  const HoldoutJson reference = Run(moved);
  EXPECT_EQ(evaluated["views"][1]["psnr_db"], reference["views"][1]["psnr_db"]);
  EXPECT_EQ(evaluated["seen"], reference["seen"]);
  EXPECT_LT(evaluated["psnr_mean_db"], all["psnr_mean_db"]);
  EXPECT_EQ(Run(HeldOut(3))["psnr_mean_db"], [&] {
    RenderOptions o = HeldOut(3);
    o.proxy = "truth";
    return Run(o)["psnr_mean_db"];
  }()) << "of other photos it says nothing";
  EXPECT_EQ(Run(HeldOut(3))["proxy_evaluated"], "truth");
  EXPECT_EQ(AloneDb(4, "truth"), AloneDb(4, ""));
  // Measuring looks for it too.
  MeasureOptions m;
  m.scene = scene();
  m.proxies = {"truth", "moved"};
  m.holdout = 4;
  const Workbench bench(m, "", messages_);
  EXPECT_EQ(bench.proxies_evaluated(), (std::map<std::string, std::string>{{"truth", "truth-without-4"}}));
  EXPECT_NEAR(bench.mesh("truth").vertices[0].z(), capture_.proxy.vertices[0].z() + 1, 1e-5);
  EXPECT_EQ(bench.mesh("moved").vertices, bench.mesh("truth").vertices);
}

TEST_F(HoldoutCommand, EachPhotoHasTheProxyOfItsFold) {
  WriteCapture(7);
  const HoldoutJson all = Run(HeldOut(kHoldoutEach));
  for (int k = 0; k < kProxiesForEach; ++k) WriteMoved(ProxyWithoutEach("truth", k), 0.2 * (k + 1));
  const HoldoutJson j = Run(HeldOut(kHoldoutEach));
  EXPECT_EQ(j["proxy"], "truth");
  EXPECT_EQ(j["proxy_evaluated"], "truth-without-each-K-of-5");
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(j["views"][i]["name"], capture_.scene.views[i].name);
    EXPECT_EQ(j["views"][i]["psnr_db"], AloneDb(i, ProxyWithoutEach("truth", static_cast<int>(i) % 5))) << i;
    EXPECT_NE(j["views"][i]["psnr_db"], all["views"][i]["psnr_db"]) << i;
  }
  std::filesystem::remove(ProxyPath(scene(), ProxyWithoutEach("truth", 2)));
  EXPECT_EQ(Run(HeldOut(kHoldoutEach))["psnr_mean_db"], all["psnr_mean_db"]);
}

TEST_F(HoldoutCommand, ProxiesAreComparedOverTheSamePixels) {
  WriteCapture(9);
  WriteMoved("moved", 2);
  const HoldoutJson truth = Run(HeldOut(4));
  RenderOptions o = HeldOut(4);
  o.proxy = "moved";
  EXPECT_NE(Run(o)["seen"], truth["seen"]);
  o.seen_proxy = "truth";
  const HoldoutJson moved = Run(o);
  EXPECT_EQ(moved["seen"], truth["seen"]);
  EXPECT_EQ(moved["seen_proxy"], "truth");
  EXPECT_LT(moved["psnr_seen_mean_db"], truth["psnr_seen_mean_db"]);
  o.seen_proxy = "nowhere";
  EXPECT_THROW(Run(o), UsageError);
}

TEST_F(HoldoutCommand, PicturesOfAnEarlierRunsPhotosGo) {
  WriteCapture(9);
  RenderOptions o = HeldOut(4);
  o.output = scene().parent_path() / "renders";
  const auto renders = [&] {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(o.output))
      count += entry.path().filename().string().ends_with("_render.jpg");
    return count;
  };
  const HoldoutJson fourth = Run(o);
  EXPECT_EQ(renders(), fourth["views"].size());
  o.holdout = 3;
  o.output = scene().parent_path() / "renders";
  const HoldoutJson third = Run(o);
  EXPECT_EQ(renders(), third["views"].size());
}

// Nothing hides a point from a photo there: fields of view alone say what is seen, in any frame of the world.
TEST_F(HoldoutCommand, WithAProxyOfEachViewFieldsOfViewSayWhatIsSeen) {
  WriteCapture(9);
  capture_.scene.points = test::SeenPoints(capture_);
  WriteScene(capture_.scene, scene());
  RenderOptions o = HeldOut(4);
  o.proxy = "per-view";
  const HoldoutJson metric = Run(o);
  EXPECT_EQ(metric["proxy_evaluated"], "per-view");
  EXPECT_GT(metric["seen"], 0.5);
  EXPECT_GE(metric["psnr_seen_mean_db"].get<double>(), metric["psnr_mean_db"].get<double>());
  Scene projective = test::Projective(capture_.scene, test::RandomTransformation(3, 30));
  std::filesystem::remove(scene() / "lumigraph.json");
  projective.image_folder = scene() / "images";
  WriteScene(projective, scene());
  o.proxy.clear();
  o.nominal_focal_px = 0.9 * 64;
  EXPECT_NEAR(Run(o)["seen"].get<double>(), metric["seen"].get<double>(), 0.01);
  o.seen_proxy = "truth";
  EXPECT_THROW(Run(o), UsageError) << "a mesh lies in no such frame";
}

TEST(HoldoutFrom, TakesANumberOfTwoOrMoreOrEach) {
  EXPECT_EQ(HoldoutFrom("2"), 2);
  EXPECT_EQ(HoldoutFrom("24"), 24);
  EXPECT_EQ(HoldoutFrom("each"), kHoldoutEach);
  EXPECT_EQ(HoldoutFrom("auto"), kHoldoutAuto);
  EXPECT_EQ(HoldoutFor(kHoldoutAuto, 23), kHoldoutEach) << "the mean of two photos is no figure";
  EXPECT_EQ(HoldoutFor(kHoldoutAuto, 24), 8);
  EXPECT_EQ(HoldoutFor(5, 23), 5);
  for (const char* bad : {"1", "0", "-1", "", "every", "8.5", "8x", " 8", "99999999999"})
    EXPECT_THROW(HoldoutFrom(bad), UsageError) << bad;
}

TEST(HoldoutFrom, WhatDoesNotGoWithItIsRefused) {
  RenderOptions o;
  o.holdout = kHoldoutEach;
  EXPECT_NO_THROW(RequireConsistent(o));
  o.decided = {"fold"};
  EXPECT_THROW(RequireConsistent(o), UsageError);
  o.decided = {};
  o.holdout = 0;
  o.output = "out";
  o.seen_proxy = "truth";
  EXPECT_THROW(RequireConsistent(o), UsageError);
}

}  // namespace
}  // namespace lumi
