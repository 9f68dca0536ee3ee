#include "simulate/scene_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/program/error.h"
#include "simulate/examples.h"

namespace lumi {
namespace {

constexpr const char* kRest =
    R"("cameras": [{"name": "c", "size": [8, 6], "fov_deg": 50}], "path": {"kind": "ring", "radius": 2},
                                 "materials": [{"name": "m"}])";

struct BadCase {
  std::string json;
  std::string message;
};

class BadScene : public ::testing::TestWithParam<BadCase> {};

TEST_P(BadScene, IsRefusedByFileAndPlace) {
  try {
    ParseScene(GetParam().json, "bad.json", ".");
    FAIL() << "was accepted: " << GetParam().json;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr(GetParam().message));
    EXPECT_EQ(error.file(), "bad.json");
    EXPECT_EQ(error.code(), ExitCode::kCorruptInput);
  }
}

std::string With(const std::string& more) { return std::string("{") + kRest + (more.empty() ? "" : ", " + more) + "}"; }
std::string Object(const std::string& object) {
  return With(R"("objects": [{"kind": "sphere", "radius": 1, "material": "m"}, )" + object + "]");
}

INSTANTIATE_TEST_SUITE_P(
    All, BadScene,
    ::testing::Values(
        BadCase{"", "line 1: this is not JSON"}, BadCase{"{\n\"cameras\": [\n,]}", "line 3: this is not JSON"},
        BadCase{R"({"cameras": 0.1e19645})", "a number is too large: '0.1e19645'"},
        BadCase{"[1, 2]", "must be an object"}, BadCase{"{}", "cameras: needs at least one camera"},
        BadCase{R"({"cameras": 3})", "cameras: must be an array"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}]})", "path: is missing"},
        BadCase{R"({"cameras": [{"size": [8, 6]}]})", "cameras[0].fov_deg: is missing"},
        BadCase{R"({"cameras": [{"size": [8, 0], "fov_deg": 50}]})",
                "cameras[0].size: must be whole numbers of pixels"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 190}]})", "cameras[0].fov_deg: must be < 179"},
        BadCase{R"({"cameras": [{"model": "OPENCV", "size": [8, 6], "params": [1, 2]}]})",
                "cameras[0].params: must be 8 numbers"},
        BadCase{R"({"cameras": [{"model": "LENS", "size": [8, 6], "fov_deg": 50}]})",
                "cameras[0].model: \"LENS\" is not a camera model"},
        BadCase{Object(R"({"kind": "sphere", "material": "m"})"), "objects[1].radius: is missing"},
        BadCase{Object(R"({"kind": "sphere", "radius": 0, "material": "m"})"), "objects[1].radius: must be > 0"},
        BadCase{Object(R"({"kind": "sphere", "radius": "big", "material": "m"})"),
                "objects[1].radius: must be a number"},
        BadCase{Object(R"({"kind": "sphere", "radius": 1, "radious": 2, "material": "m"})"),
                "objects[1].radious: unknown key"},
        BadCase{Object(R"({"kind": "spere", "material": "m"})"),
                "objects[1].kind: \"spere\" is not one of quad, box, sphere"},
        BadCase{Object(R"({"kind": "sphere", "radius": 1, "material": "gold"})"),
                "objects[1].material: there is no material \"gold\""},
        BadCase{Object(R"({"kind": "box", "size": [1, 2], "material": "m"})"), "objects[1].size: must be 3 numbers"},
        BadCase{Object(R"({"kind": "mesh", "file": "absent.ply", "material": "m"})"),
                "objects[1].file: there is no file"},
        BadCase{Object(R"({"kind": "loft", "sections": [{"centre": [0, 0, 0]}], "material": "m"})"),
                "objects[1].sections: needs at least 2"},
        BadCase{Object(R"({"kind": "sphere", "radius": 1, "material": "m", "spin": {"period_s": -1}})"),
                "objects[1].spin.period_s: must be > 0"},
        BadCase{Object(R"({"kind": "sphere", "radius": [1, 0, 1], "material": "m"})"),
                "objects[1].radius: must be > 0"},
        BadCase{Object(R"({"kind": "loft", "sections": [[0, 0, 0, 1], [0, 0, 1, 1]], "material": "m"})"),
                "objects[1].sections[0].section: must be 5 numbers"},
        BadCase{
            Object(
                R"({"kind": "sphere", "radius": 1, "material": "m", "copies": {"count": [0, 1, 1], "step": [1, 1, 1]}})"),
            "objects[1].copies.count: must be whole numbers >= 1"},
        BadCase{Object(R"({"kind": "group", "objects": []})"), "objects[1].objects: needs at least one"},
        BadCase{Object(R"({"kind": "group", "objects": [{"kind": "sphere", "radius": 0, "material": "m"}]})"),
                "objects[1].objects[0].radius: must be > 0"},
        BadCase{With(R"("lights": [{"strength": 1}])"), "lights[0].towards: is missing"},
        BadCase{With(R"("image": {"samples_per_pixel": 5})"), "image.samples_per_pixel: must be a square number"},
        BadCase{With(R"("effects": {"vignetting": 2})"), "effects.vignetting: must be <= 1"},
        BadCase{With(R"("effects": {"fog": 1})"), "effects.fog: unknown key"},
        BadCase{With(R"("background": {"color": "#12"})"), "background.color: must be a colour"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "spiral"}})",
                "path.kind: \"spiral\" is not one of"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "ring", "radius": 1, "views": 0}})",
                "path.views: must be >= 1"},
        BadCase{
            R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "ring", "radius": 1, "camera": "x"}})",
            "path.camera: there is no camera \"x\""},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "ring", "radius": 1},
                    "materials": [{"name": "a", "texture": {"kind": "noise", "size": -1}}]})",
                "materials[0].texture.size: must be > 0"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "ring", "radius": 1},
                    "materials": [{"name": "a"}, {"name": "a"}]})",
                "materials: there are two named \"a\""}));

std::string Nested(int groups, const std::string& inside) {
  std::string json = inside;
  for (int i = 0; i < groups; ++i) json = R"({"kind": "group", "objects": [)" + json + "]}";
  return json;
}
const std::string kBall = R"({"kind": "sphere", "radius": 1, "material": "m"})";
const std::string kMany = R"("copies": {"count": [100, 100, 10], "step": [1, 1, 1]})";

// A few bytes that ask for more than memory or the stack hold, and numbers that are none.
INSTANTIATE_TEST_SUITE_P(
    Limits, BadScene,
    ::testing::Values(
        BadCase{Object(R"({"kind": "group", )" + kMany +
                       R"(, "objects": [{"kind": "sphere", "radius": 1, "material": "m", )" + kMany + "}]}"),
                "objects[1]: the scene has more than 100000 objects"},
        BadCase{Object(R"({"kind": "sphere", "radius": 1, "material": "m", "name": ")" + std::string(3000, 'x') +
                       "\", " + kMany + "}"),
                "objects[1]: the scene has more than 100000 objects"},
        BadCase{Object(Nested(40, kBall)), "groups are nested more than 32 deep"},
        BadCase{Object(Nested(1000, kBall)), "is nested too deeply"},
        BadCase{
            R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": [{"kind": "ring", "radius": 1, "views": 150000},
                    {"kind": "ring", "radius": 1, "views": 150000}]})",
            "path: has more than 200000 views"},
        BadCase{R"({"cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "grid", "centre": [0, 0, 0],
                    "columns": 1000, "rows": 1000}})",
                "path.rows: times columns must be at most 200000"},
        BadCase{With(R"("background": {"color": "#-1-1-1"})"), "background.color: must be a colour"},
        BadCase{With(R"("background": {"color": [1e300, 0, 0]})"), "background.color: is brighter than can be held"},
        BadCase{Object(R"({"kind": "mesh", "file": ")" + std::string(5000, 'x') + R"(", "material": "m"})"),
                "objects[1].file: there is no file"},
        BadCase{With(R"("name": "../../photo")"), "name: must be fit for a file's name"},
        BadCase{With("\"name\": \"" + std::string(300, 'x') + "\""), "name: must be fit for a file's name"}));

TEST(SceneDescription, GroupsInGroupsAreReadAsDeepAsAnybodyNestsThem) {
  EXPECT_EQ(ParseScene(Object(Nested(20, kBall)), "scene.json", ".").objects.size(), 2U);
}

TEST(SceneDescription, SeveralCamerasTakeTurns) {
  const SceneDescription scene = ParseScene(R"({
    "cameras": [{"name": "wide", "size": [8, 6], "fov_deg": 80}, {"name": "long", "size": [6, 8], "fov_deg": 20}],
    "path": {"kind": "ring", "radius": 2, "views": 4, "camera": ["long", "wide"]}})",
                                            "a.json", ".");
  EXPECT_EQ(scene.paths[0].cameras, (std::vector<int>{1, 0}));
  EXPECT_EQ(scene.cameras[1].camera.width_px, 6);
}

TEST(SceneDescription, CopiesOfAGroupStandWhereItsPartsWould) {
  const SceneDescription scene = ParseScene(With(R"("objects": [
    {"kind": "group", "position": [10, 0, 1], "rotate_deg": [0, 0, 90], "foreground": false, "spin": {"period_s": 2},
     "copies": {"count": [2, 1, 2], "step": [3, 0, 5]},
     "objects": [{"kind": "sphere", "radius": [1, 2, 4], "position": [1, 0, 0], "material": "m"},
                 {"kind": "quad", "size": [1, 1], "material": "m", "foreground": true, "spin": {"period_s": 7}}]}])"),
                                            "a.json", ".");
  ASSERT_EQ(scene.objects.size(), 8u);
  const Eigen::Vector3d kGroups[] = {{10, 0, 1}, {13, 0, 1}, {10, 0, 6}, {13, 0, 6}};
  for (std::size_t i = 0; i < 4; ++i) {
    const ObjectDescription &ball = scene.objects[2 * i], &quad = scene.objects[2 * i + 1];
    EXPECT_LT((ball.world_from_object.translation() - kGroups[i] - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
    EXPECT_LT((ball.world_from_object * Eigen::Vector3d(0, 4, 0) - kGroups[i] - Eigen::Vector3d(-2, 1, 0)).norm(),
              1e-12);
    EXPECT_EQ(ball.radius, 4);
    EXPECT_FALSE(ball.foreground);
    EXPECT_EQ(ball.spin->centre, kGroups[i]);
    EXPECT_EQ(ball.spin->period_s, 2);
    EXPECT_TRUE(quad.foreground);
    EXPECT_EQ(quad.spin->period_s, 7);
  }
}

TEST(SceneDescription, ALoftsSectionsMayBeRows) {
  const SceneDescription scene = ParseScene(With(R"("objects": [
    {"kind": "loft", "material": "m", "up": [0, 1, 0], "sections": [[1, 2, 3, 0.4, 0.5], {"centre": [1, 2, 4], "half_size": [6, 7]}]}])"),
                                            "a.json", ".");
  const auto& sections = scene.objects[0].sections;
  EXPECT_EQ(sections[0].centre, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(sections[0].half_size, Eigen::Vector2d(0.4, 0.5));
  EXPECT_EQ(sections[1].half_size, Eigen::Vector2d(6, 7));
}

TEST(SceneDescription, AnExampleThatIsNotThereIsNamedWithThoseThatAre) {
  try {
    ExampleJson("moon");
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("moon"));
    EXPECT_THAT(error.hint(), ::testing::HasSubstr("desk, plaza, hallway, car, person"));
  }
}

}  // namespace
}  // namespace lumi
