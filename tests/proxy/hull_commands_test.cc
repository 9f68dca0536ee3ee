#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/proxy/hull_bodies.h"
#include "tests/proxy/synthetic_scene.h"
#include "tests/support/messages_kept.h"
#include "tests/support/summary_json.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A red ellipsoid before a grey wall, photographed from eight sides.
void WriteEllipsoidScene(const fs::path& folder) {
  SceneBuilder builder(5);
  for (int n = 0; n < 8; ++n)
    builder.AddCamera({4 * std::cos(n * 0.785), 4 * std::sin(n * 0.785), n % 2 == 0 ? 2.0 : -1.0}, {0, 0, 0});
  Scene scene = builder.Build();
  scene.cameras[0] = scene.cameras[0].Scaled(320, 240);
  scene.folder = folder;
  scene.image_folder = folder / "images";
  const Body body = Ellipsoid({0.8, 0.6, 0.5});
  for (const View& view : scene.views) {
    const RenderView render = MakeRenderView(scene, view);
    Image8 photo(320, 240, 3, 110);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        if (!body(render.centre, *RayDirection(render.P, {x + 0.5, y + 0.5}))) continue;
        photo.At(x, y, 0) = 220;
        photo.At(x, y, 1) = photo.At(x, y, 2) = 30;
      }
    }
    WriteImage(fs::path(scene.image_folder / view.name), photo);
  }
  UpdateFrameOfReference(scene);
  WriteScene(scene, folder);
}

TEST(HullCommands, SilhouettesByARuleMakeAHullThatASecondRunReuses) {
  const TemporaryFolder folder;
  WriteEllipsoidScene(folder / "scene");
  EXPECT_THROW(RunHull({}, {folder / "scene", "hull", {}, false}, SilentProgress()), DataError);  // no silhouettes yet
  SilhouetteSource source;
  EXPECT_THROW(RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress()), UsageError);
  source.rule = "R > 300";
  EXPECT_THROW(RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress()), DataError);
  EXPECT_FALSE(fs::exists(folder / "scene" / "silhouettes"));
  source.rule = "R > 2 * G";
  const json found = AsJson(RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress()));
  EXPECT_EQ(found["silhouettes"].size(), 8u);
  EXPECT_EQ(found["empty"], 0);
  EXPECT_EQ(found["silhouettes"][0]["parts"], 1);
  const auto record = ReadProvenance(folder / "scene", "silhouettes");
  ASSERT_TRUE(record);
  EXPECT_EQ(record->outputs.at("silhouettes"), Fingerprint(folder / "scene" / "silhouettes"));
  json same = AsJson(RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress()));
  EXPECT_EQ(same["reused"], true);
  EXPECT_EQ(same["silhouettes"], found["silhouettes"]);
  EXPECT_EQ(AsJson(RunSilhouettes(folder / "scene", source, {.grow_px = 1}, {}, SilentProgress()))["reused"], false);
  EXPECT_EQ(AsJson(RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress()))["reused"], false);

  const json hull = AsJson(RunHull({}, {folder / "scene", "hull", {}, false}, SilentProgress()));
  EXPECT_EQ(hull["closed"], true);
  EXPECT_EQ(hull["sound"], true);
  EXPECT_EQ(hull["active"], true);
  EXPECT_EQ(hull["views_used"], 8);
  EXPECT_GE(hull["coverage_min"].get<double>(), 0.995);
  EXPECT_GE(hull["iou_median"].get<double>(), 0.95);
  EXPECT_GE(hull["iou_median"].get<double>(), hull["iou_min"].get<double>());
  EXPECT_GT(hull["volume"].get<double>(), 4.0 / 3 * 3.14159265 * 0.24);
  EXPECT_EQ(ReadMesh(ProxyPath(folder / "scene", "hull")).faces.size(), hull["faces"].get<std::size_t>());
  EXPECT_EQ(OpenScene(folder / "scene", {}, SilentProgress()).active_proxy, "hull");

  const Made<HullFigures> reused = RunHull({}, {folder / "scene", "hull", {}, false}, SilentProgress());
  const json again = AsJson(reused);
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["iou_median"], hull["iou_median"]);
  EXPECT_THAT(Describe(reused), testing::HasSubstr("after a dilation of"));
  EXPECT_EQ(hull["prefer"], "cover");
  EXPECT_EQ(hull["coarse_hulls"], 0);
  HullRequest tight;
  tight.hull.prefer = HullPreference::kTight;
  const json other = AsJson(RunHull(tight, {folder / "scene", "tight", {}, false}, SilentProgress()));
  EXPECT_EQ(other["reused"], false) << "another hull";
  EXPECT_EQ(other["prefer"], "tight");
  for (const char* figure : {"coverage_min", "iou_min", "iou_median"}) EXPECT_GT(other[figure].get<double>(), 0.9);
  // One silhouette less: another hull.
  fs::remove(FindMask(folder / "scene" / "silhouettes", found["silhouettes"][2]["name"]));
  const json less = AsJson(RunHull({}, {folder / "scene", "hull", {}, false}, SilentProgress()));
  EXPECT_EQ(less["reused"], false);
  ASSERT_EQ(less["views_left_out"].size(), 1u);
  EXPECT_EQ(less["views_left_out"][0]["reason"], "it has no silhouette");
}

TEST(HullCommands, TheTradeoffIsATableAndAPlotAndNoProxy) {
  const TemporaryFolder folder;
  WriteEllipsoidScene(folder / "scene");
  SilhouetteSource source;
  source.rule = "R > 2 * G";
  RunSilhouettes(folder / "scene", source, {}, {}, SilentProgress());
  HullRequest request;
  request.hull.cell_px = 6;
  EXPECT_THROW(RunHullTradeoff(request, folder / "scene", folder / "hull.ply", SilentProgress()), UsageError);
  const HullTradeoff tradeoff = RunHullTradeoff(request, folder / "scene", {}, SilentProgress());
  EXPECT_FALSE(fs::exists(ProxyPath(folder / "scene", "hull")));
  const json t = AsJson(tradeoff)["hull_tradeoff"];
  ASSERT_EQ(t["points"].size(),
            9u);  // as given; 4 views and all 8 at whole, half and quarter size, less the first again; two cells; tight
  EXPECT_EQ(t["points"][0]["name"], "as given");
  bool front = false;
  for (const json& p : t["points"]) {
    EXPECT_FALSE(p.contains("failed")) << p;
    front = front || p["front"].get<bool>();
    if (p["line"] == "prefer") continue;
    EXPECT_LE(p["iou_median"].get<double>(), t["points"][0]["iou_median"].get<double>() + 0.01) << p;
    EXPECT_GE(p["coverage_min"].get<double>(), 0.995) << p;
  }
  EXPECT_TRUE(front);
  EXPECT_EQ(t["points"][8]["name"], "tight");
  EXPECT_GE(t["points"][8]["iou_median"].get<double>(), t["points"][0]["iou_median"].get<double>());
  // Four views leave more than eight.
  EXPECT_EQ(t["points"][1]["name"], "4 views");
  EXPECT_GT(t["points"][1]["volume_ratio"].get<double>(), 1);
  EXPECT_EQ(json::parse(ReadText(folder / "scene" / "tradeoff" / "hull.json"))["points"], t["points"]);
  EXPECT_THAT(ReadText(folder / "scene" / "tradeoff" / "hull.csv"), testing::HasSubstr("\"4 views\",views,4,1,6,4,"));
  EXPECT_THAT(ReadText(folder / "scene" / "tradeoff" / "hull.svg"), testing::HasSubstr("as given"));
  EXPECT_THAT(Describe(tradeoff), testing::HasSubstr("IoU med."));
  RunHullTradeoff(request, folder / "scene", folder / "elsewhere", SilentProgress());
  EXPECT_TRUE(fs::exists(folder / "elsewhere" / "hull.svg"));
}

TEST(HullCommands, OtherSourcesFindTheSameSilhouettes) {
  const TemporaryFolder folder;
  WriteEllipsoidScene(folder / "scene");
  SilhouetteSource rule, border, colour, masks;
  rule.rule = "R > 2 * G";
  border.border_colour = true;
  colour.colour = Eigen::Vector3d(110, 110, 110);
  masks.masks = folder / "by_rule";
  const auto of = [&](const SilhouetteSource& source, const fs::path& to) {
    return AsJson(RunSilhouettes(folder / "scene", source, {}, to, SilentProgress()))["silhouettes"];
  };
  const json expected = of(rule, folder / "by_rule");
  EXPECT_EQ(of(border, folder / "a"), expected);
  EXPECT_EQ(of(colour, folder / "b"), expected);
  EXPECT_EQ(of(masks, folder / "c"), expected);
  SilhouetteSource alpha;
  alpha.alpha = true;
  EXPECT_THROW(RunSilhouettes(folder / "scene", alpha, {}, folder / "d", SilentProgress()), DataError);
  WriteImage(fs::path(folder / "small.png"), Image8(10, 10, 3));
  SilhouetteSource background;
  background.background = folder / "small.png";
  EXPECT_THROW(RunSilhouettes(folder / "scene", background, {}, folder / "e", SilentProgress()), InputError);
}

// Masks of the ellipsoid in photos as another lens took them, with the scene's record of that lens.
void WriteMasksAsTaken(const fs::path& folder, const fs::path& masks) {
  const Scene scene = OpenScene(folder, {}, SilentProgress());
  const Camera& pinhole = scene.cameras[0];
  const Eigen::Vector2d f = pinhole.FocalPx(), c = pinhole.PrincipalPointPx() + Eigen::Vector2d(9, -6);
  const Camera lens{
      CameraModel::kRadial, pinhole.width_px, pinhole.height_px, {0.95 * f.x(), c.x(), c.y(), -0.25, 0.02}};
  const Body body = Ellipsoid({0.8, 0.6, 0.5});
  std::vector<TakenPhoto> taken;
  for (const View& view : scene.views) {
    taken.push_back({view.name, "of " + view.name, lens, pinhole});
    const RenderView render = MakeRenderView(scene, view);
    Image8 mask(pinhole.width_px, pinhole.height_px, 1);
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x) {
        const auto ray = lens.Normalized({x + 0.5, y + 0.5});
        if (!ray || !body(render.centre, *RayDirection(render.P, *pinhole.Project(ray->homogeneous())))) continue;
        mask.At(x, y, 0) = 255;
      }
    WriteImage(masks / (taken.back().taken + ".png"), mask);
  }
  WriteTakenPhotos(taken, scene.image_folder);
}

double IntersectionOverUnion(const fs::path& a, const fs::path& b) {
  const Image8 one = ReadImage8(a), other = ReadImage8(b);
  std::size_t both = 0, any = 0;
  for (std::size_t i = 0; i < one.data.size(); ++i) {
    both += one.data[i] > 127 && other.data[i] > 127;
    any += one.data[i] > 127 || other.data[i] > 127;
  }
  return static_cast<double>(both) / static_cast<double>(any);
}

TEST(HullCommands, MasksOfPhotosAsTheyWereTakenAreUndistortedAsThePhotosWere) {
  const TemporaryFolder folder;
  WriteEllipsoidScene(folder / "scene");
  WriteMasksAsTaken(folder / "scene", folder / "masks");
  SilhouetteSource rule, masks;
  rule.rule = "R > 2 * G";
  masks.masks = folder / "masks";
  RunSilhouettes(folder / "scene", rule, {}, folder / "true", SilentProgress());
  EXPECT_THROW(RunSilhouettes(folder / "scene", masks, {}, folder / "none", SilentProgress()), DataError)
      << "they are called as the photos were";
  masks.undistort = true;
  json found = AsJson(RunSilhouettes(folder / "scene", masks, {}, folder / "moved", SilentProgress()));
  EXPECT_EQ(found["silhouettes"].size(), 8u);
  for (const json& one : found["silhouettes"]) {
    EXPECT_EQ(one["no_mask"], false);
    const std::string name = one["name"].get<std::string>() + ".png";
    constexpr double kHalfAPixelOfOutline = 0.97;  // an outline of some 230 pixels around 3,900
    EXPECT_GT(IntersectionOverUnion(folder / "true" / name, folder / "moved" / name), kHalfAPixelOfOutline) << name;
  }

  // Under the scene's names they would be taken for its photos': where they lie elsewhere, it is said.
  for (const json& one : found["silhouettes"]) {
    const std::string name = one["name"].get<std::string>() + ".png";
    fs::rename(folder / "masks" / ("of " + name), folder / "masks" / name);
  }
  masks.undistort = false;
  MessagesKept said;
  RunSilhouettes(folder / "scene", masks, {}, folder / "as_they_are", said);
  EXPECT_THAT(said.all, testing::HasSubstr("--undistort"));
  const std::string first = found["silhouettes"][0]["name"].get<std::string>() + ".png";
  EXPECT_LT(IntersectionOverUnion(folder / "true" / first, folder / "as_they_are" / first), 0.9) << "far off";

  // A photo without a mask: its silhouette is empty, and named.
  fs::remove(folder / "masks" / first);
  const SilhouettesSummary less = RunSilhouettes(folder / "scene", masks, {}, folder / "less", SilentProgress());
  found = AsJson(less);
  EXPECT_EQ(found["empty"], 1);
  EXPECT_EQ(found["silhouettes"][0]["no_mask"], true);
  EXPECT_THAT(Describe(less), testing::HasSubstr("has no mask"));
}

}  // namespace
}  // namespace lumi::test
