#include "scene/files/projective_json.h"

#include <Eigen/Geometry>
#include <limits>
#include <nlohmann/json.hpp>

#include "files_test_util.h"
#include "scene/files/scene_folder.h"

namespace lumi::test {
namespace {

// Rounding of two or three products of unit-sized numbers.
constexpr double kRounding = 1e-12;

// SmallScene as a projective transformation of it sees it: same pixels, other matrices and points. x in front of the
// transformed plane at infinity: quasi-affine.
Scene ProjectiveScene(Frame frame, const fs::path& folder = {}) {
  Scene metric = SmallScene(20), scene;
  Eigen::Matrix4d H = Eigen::Matrix4d::Identity();  // target from metric
  H << 1.5, 0.1, -0.2, 0.3, 0, 0.8, 0.1, -0.1, 0.2, 0, 1.1, 0.5, 0.03, -0.02, 0.01, 1;
  const Eigen::Matrix4d inverse = H.inverse();
  scene.frame = frame;
  for (const View& v : metric.views) {
    View view;
    view.name = v.name;
    view.P = ProjectionMatrix(metric.CameraOf(v).K(), v.cam_from_world) * inverse;
    view.size_px = {64, 48};
    scene.views.push_back(view);
  }
  for (const Point& p : metric.points) {
    Point point = p;
    point.x_in_world.setZero();
    point.X_in_world = H * p.x_in_world.homogeneous();
    scene.points.push_back(point);
  }
  scene.plane_at_infinity = inverse.transpose().col(3);
  scene.views[1].time_s = 0.125;
  scene.views[1].frame_index = 4;
  scene.views[2].gain = 0.75;
  UpdateFrameOfReference(scene);
  if (folder.empty()) return scene;
  scene.folder = folder;
  scene.image_folder = folder / "images";
  for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
  return scene;
}

void ExpectSameMatrices(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.frame, b.frame);
  ASSERT_EQ(a.views.size(), b.views.size());
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_EQ(a.plane_at_infinity, b.plane_at_infinity);
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].name, b.views[i].name);
    EXPECT_EQ(a.views[i].size_px, b.views[i].size_px);
    EXPECT_EQ(a.views[i].P, b.views[i].P);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].X_in_world, b.points[i].X_in_world);
    EXPECT_EQ(a.points[i].color, b.points[i].color);
    EXPECT_EQ(a.points[i].error_px, b.points[i].error_px);
    ASSERT_EQ(a.points[i].track.size(), b.points[i].track.size());
    for (std::size_t k = 0; k < a.points[i].track.size(); ++k) {
      EXPECT_EQ(a.points[i].track[k].view, b.points[i].track[k].view);
      EXPECT_EQ(a.points[i].track[k].x_px, b.points[i].track[k].x_px);
    }
  }
}

TEST(ProjectiveJson, EveryNumberComesBackAsItWas) {
  const TempFolder folder;
  for (const Frame frame : {Frame::kQuasiAffine, Frame::kProjective}) {
    Scene scene = ProjectiveScene(frame);
    // What texts easily lose: signs of zero, the smallest and the largest numbers, thirds.
    scene.views[0].P *= 1e-300 / 3;
    scene.views[1].P(0, 1) = -0.0;
    scene.points[0].X_in_world = {std::numeric_limits<double>::denorm_min(), 1e308, -1.0 / 3, 0.1};
    if (frame == Frame::kProjective) scene.points[1].X_in_world = {1, 2, 3, -4}, scene.points[2].X_in_world.w() = 0;
    scene.points[3].track.clear();
    WriteProjectiveJson(scene, folder / "p.json");
    const Scene back = ReadProjectiveJson(folder / "p.json");
    ExpectSameMatrices(back, scene);
    EXPECT_TRUE(std::signbit(back.views[1].P(0, 1)));
    scene.plane_at_infinity.reset();
    WriteProjectiveJson(scene, folder / "p.json");
    ExpectSameMatrices(ReadProjectiveJson(folder / "p.json"), scene);
  }
}

TEST(ProjectiveJson, ASceneFolderKeepsAProjectiveScene) {
  for (const Frame frame : {Frame::kQuasiAffine, Frame::kProjective}) {
    const TempFolder folder;
    const Scene scene = ProjectiveScene(frame, folder.path());
    WriteScene(scene, folder.path());
    EXPECT_FALSE(fs::exists(folder / "sparse"));
    const Scene back = OpenScene(folder.path(), {}, SilentProgress());
    ExpectSameMatrices(back, scene);
    EXPECT_EQ(back.views[1].time_s, 0.125);
    EXPECT_EQ(back.views[1].frame_index, 4);
    EXPECT_EQ(back.views[2].gain, 0.75);
    EXPECT_EQ(back.normalized_from_world.scale, scene.normalized_from_world.scale);
    EXPECT_TRUE(fs::exists(back.ImagePath(back.views[1])));
  }
}

TEST(ProjectiveJson, TheManifestSaysWhichFrameCounts) {
  const TempFolder folder;
  WriteScene(ProjectiveScene(Frame::kProjective, folder.path()), folder.path());
  Scene metric = SmallScene(5);
  metric.image_folder = folder / "images";
  WriteScene(metric, folder.path());
  EXPECT_EQ(OpenScene(folder.path(), {}, SilentProgress()).points.size(), 5u);
  const Scene upgraded = ProjectiveScene(Frame::kQuasiAffine, folder.path());
  WriteScene(upgraded, folder.path());
  ExpectSameMatrices(OpenScene(folder.path(), {}, SilentProgress()), upgraded);

  auto manifest = nlohmann::json::parse(Read(folder / "lumigraph.json"));
  manifest["frame"] = "projective";
  Write(folder / "lumigraph.json", manifest.dump());
  EXPECT_REFUSED(ExitCode::kCorruptInput, "quasi_affine", OpenScene(folder.path(), {}, SilentProgress()));
  fs::remove(folder / kProjectiveName);
  EXPECT_REFUSED(ExitCode::kCorruptInput, kProjectiveName, OpenScene(folder.path(), {}, SilentProgress()));
}

TEST(ProjectiveJson, PhotosOfAnotherSizeAreRefusedOrTheMatricesScaled) {
  const TempFolder folder;
  const Scene scene = ProjectiveScene(Frame::kProjective, folder.path());
  WriteScene(scene, folder.path());
  for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(128, 96));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "--rescale-cameras", OpenScene(folder.path(), {}, SilentProgress()));
  OpenOptions rescale;
  rescale.rescale_cameras = true;
  const Scene back = OpenScene(folder.path(), rescale, SilentProgress());
  EXPECT_EQ(back.views[0].size_px, Eigen::Vector2i(128, 96));
  for (const Point& p : back.points)
    for (const Observation& o : p.track) {
      const auto x = Project(back.views[static_cast<std::size_t>(o.view.value)].P, p.X_in_world);
      ASSERT_TRUE(x);
      EXPECT_LT((*x - o.x_px).norm(), 1e3 * kRounding);
    }
}

TEST(ProjectiveJson, TheRendererReadsAViewOfAnyFrame) {
  const Scene scene = ProjectiveScene(Frame::kQuasiAffine);
  for (const View& view : scene.views) {
    const RenderView r = MakeRenderView(scene, view);
    EXPECT_EQ(r.P, view.P);
    EXPECT_EQ(r.size_px, Eigen::Vector2i(64, 48));
    EXPECT_EQ(r.time_s, view.time_s);
    EXPECT_EQ(r.gain, view.gain);
    EXPECT_LT((r.P * r.centre.homogeneous()).norm(), kRounding * r.P.norm() * r.centre.homogeneous().norm());
  }
  View affine;
  affine.name = "far.jpg";
  affine.P << 1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 0, 1;
  EXPECT_REFUSED(ExitCode::kDataRefused, "far.jpg", MakeRenderView(scene, affine));
}

TEST(ProjectiveJson, WhatNeedsCamerasSaysSoInOneLine) {
  const TempFolder folder;
  Scene scene = ProjectiveScene(Frame::kQuasiAffine, folder.path());
  EXPECT_REFUSED(ExitCode::kDataRefused, "rendering needs cameras and poses, and this is a quasi_affine scene",
                 RequireMetric(scene, "rendering"));
  EXPECT_REFUSED(ExitCode::kDataRefused, folder.path().string(), RequireMetric(scene, "rendering"));
  EXPECT_NO_THROW(RequireMetric(SmallScene(0), "rendering"));
}

TEST(ProjectiveJson, ViewsOutOfOrderAreSortedAndTracksFollow) {
  const TempFolder folder;
  const Scene scene = ProjectiveScene(Frame::kQuasiAffine);
  WriteProjectiveJson(scene, folder / "p.json");
  auto json = nlohmann::json::parse(Read(folder / "p.json"));
  std::swap(json["views"][0], json["views"][3]);
  for (auto& point : json["points"])
    for (auto& v : point["views"]) v = v == 0 ? 3 : v == 3 ? 0 : v.get<int>();
  Write(folder / "p.json", json.dump());
  ExpectSameMatrices(ReadProjectiveJson(folder / "p.json"), scene);
}

TEST(ProjectiveJson, WrongValuesAreRefusedByName) {
  const TempFolder folder;
  WriteProjectiveJson(ProjectiveScene(Frame::kQuasiAffine), folder / "p.json");
  const auto whole = nlohmann::json::parse(Read(folder / "p.json"));
  const auto refused = [&](const char* pointer, const nlohmann::json& value, const std::string& reason) {
    SCOPED_TRACE(pointer);
    auto json = whole;
    json[nlohmann::json::json_pointer(pointer)] = value;
    Write(folder / "p.json", json.dump());
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadProjectiveJson(folder / "p.json"));
    EXPECT_REFUSED(ExitCode::kCorruptInput, "p.json", ReadProjectiveJson(folder / "p.json"));
  };
  refused("/format", "lumigraph", "format");
  refused("/version", 2, "reads up to 1");
  refused("/version", 0, "version");
  refused("/frame", "metric", "metric");
  refused("/plane_at_infinity", {0, 0, 0, 0}, "plane_at_infinity is not a plane");
  refused("/plane_at_infinity", {0, 0, 1}, "plane_at_infinity is not an array");
  refused("/views", nullptr, "\"views\" is missing");
  refused("/views", nlohmann::json::array(), "views names a view that is not there");
  refused("/views/1/name", "", "views[1].name");
  refused("/views/1/name", whole["views"][0]["name"], "comes twice");
  refused("/views/1/width_px", 0, "views[1].width_px");
  refused("/views/1/height_px", 2000000000, "views[1].width_px, height_px");
  refused("/views/1/P", {1, 2, 3}, "views[1].P is not an array of the right length");
  refused("/views/1/P", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "views[1].P is no projection matrix");
  refused("/views/1/P/5", nullptr, "views[1].P is not made of numbers");
  refused("/points/2/X", nullptr, "\"points[2].X\" is missing");
  refused("/points/2/X", {0, 0, 0, 0}, "points[2].X is no point");
  refused("/points/2/X", {1, 1, 1, -1}, "points[2].X has no w > 0");
  refused("/points/2/color", {1, 2, 256}, "points[2].color");
  refused("/points/2/error_px", -1, "points[2].error_px");
  refused("/points/2/views/0", 4, "points[2].views names a view that is not there");
  refused("/points/2/views/0", -1, "points[2].views names a view that is not there");
  refused("/points/2/views/0", std::uint64_t(1) << 63, "points[2].views names a view that is not there");
  refused("/points/2/views", {0}, "points[2].x_px is not as long");
  refused("/points/2/x_px/1", "wide", "points[2].x_px is not made of numbers");
  for (const char* text :
       {"", "[", "{\"format\":\"lumigraph-projective\",\"version\":1,\"views\":[{\"P\":[1e999]}]}", "[]", "null"}) {
    Write(folder / "p.json", text);
    EXPECT_REFUSED(ExitCode::kCorruptInput, "p.json", ReadProjectiveJson(folder / "p.json"));
  }
  Write(folder / "p.json", std::string(1000000, '['));  // deep rather than long
  EXPECT_REFUSED(ExitCode::kCorruptInput, "p.json", ReadProjectiveJson(folder / "p.json"));
}

TEST(ProjectiveJson, NothingWrongIsWritten) {
  const TempFolder folder;
  const auto refused = [&](const std::function<void(Scene&)>& spoil) {
    Scene scene = ProjectiveScene(Frame::kQuasiAffine);
    spoil(scene);
    EXPECT_THROW(WriteProjectiveJson(scene, folder / "p.json"), std::invalid_argument);
  };
  refused([](Scene& s) { s.frame = Frame::kMetric; });
  refused([](Scene& s) { s.views[2].P(1, 1) = std::nan(""); });
  refused([](Scene& s) { s.views[2].P.setZero(); });
  refused([](Scene& s) { s.views[2].size_px.setZero(); });
  refused([](Scene& s) { s.points[2].X_in_world.w() = std::numeric_limits<double>::infinity(); });
  refused([](Scene& s) { s.points[2].X_in_world *= -1; });
  refused([](Scene& s) { s.points[2].track[0].view.value = 9; });
  refused([](Scene& s) { s.points[2].track[0].x_px.x() = std::nan(""); });
  refused([](Scene& s) { s.plane_at_infinity = Eigen::Vector4d::Zero(); });
  EXPECT_EQ(CountFiles(folder.path()), 0u);
  Scene named = ProjectiveScene(Frame::kProjective);
  named.views[0].name = "\xff\xfe.jpg";
  EXPECT_REFUSED(ExitCode::kDataRefused, "UTF-8", WriteProjectiveJson(named, folder / "p.json"));
}

}  // namespace
}  // namespace lumi::test
