#include "export/gltf_export.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "export/vertex_colors.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

using nlohmann::json;

const SimulatedCapture& Desk() {
  static const SimulatedCapture desk("desk", 6, 160);
  return desk;
}

struct Glb {
  json text;
  std::string binary;
};

Glb Read(const std::filesystem::path& file) {
  const std::string bytes = ReadText(file);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2U);
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t json_size = word(12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_size % 4, 0U);
  EXPECT_EQ(bytes.substr(24 + json_size, 4), std::string("BIN\0", 4));
  EXPECT_EQ(28 + json_size + word(20 + json_size), bytes.size());
  return {json::parse(bytes.substr(20, json_size)), bytes.substr(28 + json_size)};
}

TEST(Gltf, HoldsTheProxyAndTheCameras) {
  const std::filesystem::path file = Desk() / "desk.glb";
  const GltfSummary summary = ExportGltf({Desk().path(), file, "", Desk() / "points.ply"}, SilentProgress());
  const Scene scene = OpenScene(Desk().path(), {}, SilentProgress());
  const Mesh mesh = LoadProxy(scene, "");
  const Glb glb = Read(file);
  EXPECT_EQ(summary.faces, static_cast<long>(mesh.faces.size()));
  EXPECT_GT(summary.seen, 0.5);
  for (const json& accessor : glb.text["accessors"]) {
    const json& view = glb.text["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), glb.binary.size());
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
  }
  const auto position = [&](std::size_t i) {
    Eigen::Vector3f v;
    std::memcpy(v.data(), glb.binary.data() + 12 * i, 12);
    return v;
  };
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 97)
    EXPECT_LE((position(i) - mesh.vertices[i].cast<float>()).norm(), 1e-6F * mesh.vertices[i].norm());

  // A point before a photo's camera, seen by glTF's: x right, y up, looking along -z, the same pixel.
  ASSERT_EQ(glb.text["cameras"].size(), scene.views.size());
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const json& node = glb.text["nodes"][i + 1];
    EXPECT_EQ(node["name"], scene.views[i].name);
    Eigen::Matrix4d world_from_node;
    for (int k = 0; k < 16; ++k) world_from_node(k % 4, k / 4) = node["matrix"][static_cast<std::size_t>(k)];
    const Eigen::Vector3d x = scene.points[7].x_in_world;
    const Eigen::Vector3d in_node = (world_from_node.inverse() * x.homogeneous()).head<3>();
    const Eigen::Vector3d in_cam = scene.views[i].cam_from_world * x;
    EXPECT_LE((in_node - Eigen::Vector3d(in_cam.x(), -in_cam.y(), -in_cam.z())).norm(), 1e-9 * in_cam.norm());
    const json& camera = glb.text["cameras"][i]["perspective"];
    const double fy = 1 / std::tan(0.5 * camera["yfov"].get<double>());
    EXPECT_NEAR(0.5 * scene.CameraOf(scene.views[i]).height_px * fy, scene.CameraOf(scene.views[i]).FocalPx().y(),
                1e-6);
  }
  // Up is y.
  const json& root = glb.text["nodes"].back()["matrix"];
  Eigen::Matrix4d top;
  for (int k = 0; k < 16; ++k) top(k % 4, k / 4) = root[static_cast<std::size_t>(k)];
  EXPECT_LE((top.topLeftCorner<3, 3>() * scene.up - Eigen::Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_TRUE(ReadText(Desk() / "points.ply").starts_with("ply\nformat binary_little_endian"));
}

// Such as a map's coordinates: floats have half a metre there.
TEST(Gltf, ASceneFarFromTheOriginKeepsItsDetail) {
  const std::filesystem::path folder = Desk() / "far";
  std::filesystem::copy(Desk().path(), folder, std::filesystem::copy_options::recursive);
  Scene scene = OpenScene(folder, {}, SilentProgress());
  Mesh mesh = LoadProxy(scene, "");
  const double size = 1 / scene.normalized_from_world.scale;
  const Similarity3 move{1, Eigen::Quaterniond::Identity(), size * Eigen::Vector3d(5e5, 4e6, 100)};
  for (Eigen::Vector3d& v : mesh.vertices) v = move * v;
  WriteMesh(ProxyPath(folder, scene.active_proxy), mesh);
  Transform(scene, move);
  WriteScene(scene, folder);
  scene = OpenScene(folder, {}, SilentProgress());
  mesh = LoadProxy(scene, "");
  ExportGltf({folder, folder / "far.glb", "", folder / "far.ply"}, SilentProgress());
  const Glb glb = Read(folder / "far.glb");
  const auto matrix_of = [](const json& node) {
    Eigen::Matrix4d m;
    for (int k = 0; k < 16; ++k) m(k % 4, k / 4) = node["matrix"][static_cast<std::size_t>(k)];
    return m;
  };
  const Eigen::Matrix4d gltf_from_local = matrix_of(glb.text["nodes"].back());
  const Eigen::Vector3d origin =
      gltf_from_local.topLeftCorner<3, 3>().inverse() * gltf_from_local.topRightCorner<3, 1>();
  constexpr double kOfTheSize = 1e-6;
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 97) {
    Eigen::Vector3f v;
    std::memcpy(v.data(), glb.binary.data() + 12 * i, 12);
    EXPECT_LE((v.cast<double>() + origin - mesh.vertices[i]).norm(), kOfTheSize * size);
  }
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const Eigen::Vector3d centre = matrix_of(glb.text["nodes"][i + 1]).topRightCorner<3, 1>();
    EXPECT_LE(centre.norm(), 100 * size) << "floats hold it";
    EXPECT_LE((centre + origin - scene.views[i].CentreInWorld()).norm(), kOfTheSize * size);
  }
  EXPECT_NE(ReadText(folder / "far.ply").find("property double x\n"), std::string::npos);
}

TEST(Gltf, VerticesHaveTheColourOfAConstantWorld) {
  LumigraphOptions options;
  options.scene = Desk().path();
  Lumigraph lumigraph(options, SilentProgress());
  lumigraph.MakePictures("", false);
  lumigraph.ReadPhotos(SilentProgress());
  auto& photos = const_cast<std::vector<Photo>&>(lumigraph.photos());
  for (Photo& photo : photos)
    for (Image8& level : photo.levels)
      for (std::size_t i = 0; i < level.data.size(); ++i) level.data[i] = static_cast<std::uint8_t>(40 + 50 * (i % 3));
  const VertexColors colors = ColorVertices(lumigraph, SilentProgress());
  for (const Eigen::Array3f& rgb : colors.rgb)
    ASSERT_LE((rgb * 255 - Eigen::Array3f(40, 90, 140)).abs().maxCoeff(), 1e-2F);
}

TEST(Gltf, OtherEndingsAreRefused) {
  EXPECT_THROW(ExportGltf({Desk().path(), Desk() / "desk.gltf", "", {}}, SilentProgress()), UsageError);
  EXPECT_THROW(ExportGltf({Desk().path(), Desk() / "desk.glb", "", Desk() / "p.txt"}, SilentProgress()), UsageError);
}

}  // namespace
}  // namespace lumi
