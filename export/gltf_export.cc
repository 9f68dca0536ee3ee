#include "export/gltf_export.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "export/held_photos.h"
#include "export/own_output.h"
#include "export/vertex_colors.h"
#include "render/lumigraph/lumigraph.h"
#include "scene/files/atomic_file.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"

namespace lumi {
namespace {

constexpr const char* kExportGenerator = "lumi-export";  // how files of ours are known

using nlohmann::json;

// glTF 2.0's numbers for types and uses of data.
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126, kArrayBuffer = 34962, kElementBuffer = 34963;
constexpr double kNear = 1e-3;  // of the scene's size: a glTF camera must have one

// Binary data and the views into it.
class Buffer {
 public:
  // The index of an accessor for `count` items of these bytes.
  template <typename T>
  int Add(const std::vector<T>& values, int component, const char* type, std::size_t count, int target) {
    while (bytes_.size() % 4 != 0) bytes_.push_back('\0');
    views_.push_back(
        {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", values.size() * sizeof(T)}, {"target", target}});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    accessors_.push_back(
        {{"bufferView", views_.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(accessors_.size()) - 1;
  }
  json& accessor(int i) { return accessors_[static_cast<std::size_t>(i)]; }
  const json& accessors() const { return accessors_; }
  const json& views() const { return views_; }
  std::string bytes() const { return bytes_; }

 private:
  std::string bytes_;
  json views_ = json::array(), accessors_ = json::array();
};

// COLOR_0 is linear in glTF.
std::uint16_t Linear(float srgb) {
  const double c = static_cast<double>(srgb), linear = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * std::clamp(linear, 0.0, 1.0)));
}

std::string Chunk(const char* kind, std::string bytes, char padding) {
  while (bytes.size() % 4 != 0) bytes.push_back(padding);
  const auto size = static_cast<std::uint32_t>(bytes.size());
  std::string chunk(reinterpret_cast<const char*>(&size), 4);
  return chunk.append(kind, 4) + bytes;
}

json MatrixOf(const Eigen::Matrix4d& m) {
  json columns = json::array();
  for (int i = 0; i < 16; ++i) columns.push_back(m(i % 4, i / 4));
  return columns;
}

// What mesh and cameras are written relative to, in world: the origin, or the scene's centre where it is so far away
// (as in a map's coordinates) that floats, which a mesh has and viewers compute with, would lose its detail.
Eigen::Vector3d OriginOf(const Scene& scene) {
  constexpr double kFar = 100;  // sizes of the scene: floats then have 1e-5 of it
  const Similarity3 world_from_normalized = scene.normalized_from_world.Inverse();
  const Eigen::Vector3d& centre = world_from_normalized.translation;
  return centre.norm() > kFar * world_from_normalized.scale ? centre : Eigen::Vector3d::Zero();
}

// y up from the world, whose unit is made a metre where that is known.
Eigen::Matrix4d GltfFromWorld(const Scene& scene) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scene.metres_per_unit.value_or(1) *
                            Eigen::Quaterniond::FromTwoVectors(scene.up, Eigen::Vector3d::UnitY()).toRotationMatrix();
  m.topRightCorner<3, 1>() = m.topLeftCorner<3, 3>() * OriginOf(scene);
  return m;
}

void AddCameras(const Scene& scene, json& gltf) {
  for (const View& view : scene.views) {
    const Camera& camera = scene.CameraOf(view);
    const double fy = camera.FocalPx().y();
    gltf["cameras"].push_back(
        {{"type", "perspective"},
         {"name", view.name},
         {"perspective",
          {{"yfov", 2 * std::atan(0.5 * camera.height_px / fy)},
           {"aspectRatio", static_cast<double>(camera.width_px) * fy / (camera.height_px * camera.FocalPx().x())},
           {"znear", kNear / scene.normalized_from_world.scale}}}});
    // glTF's cameras look along -z, y up.
    Eigen::Matrix4d world_from_cam = Eigen::Matrix4d::Identity();
    world_from_cam.topLeftCorner<3, 3>() =
        view.cam_from_world.rotation.toRotationMatrix().transpose() * Eigen::Vector3d(1, -1, -1).asDiagonal();
    world_from_cam.topRightCorner<3, 1>() = view.CentreInWorld() - OriginOf(scene);
    gltf["nodes"].push_back(
        {{"name", view.name}, {"camera", gltf["cameras"].size() - 1}, {"matrix", MatrixOf(world_from_cam)}});
  }
}

std::string Glb(const Lumigraph& lumigraph, const VertexColors& colors) {
  const Mesh& mesh = lumigraph.mesh();
  Buffer buffer;
  std::vector<float> positions;
  std::vector<std::uint16_t> rgba;
  const Eigen::Vector3d origin = OriginOf(lumigraph.scene());
  Eigen::Vector3f least = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()), most = -least;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f v = (mesh.vertices[i] - origin).cast<float>();
    least = least.cwiseMin(v);
    most = most.cwiseMax(v);
    positions.insert(positions.end(), v.data(), v.data() + 3);
    for (int c = 0; c < 3; ++c) rgba.push_back(Linear(colors.rgb[i][c]));
    rgba.push_back(65535);
  }
  std::vector<std::uint32_t> indices;
  for (const auto& f : mesh.faces)
    for (const std::int32_t v : f) indices.push_back(static_cast<std::uint32_t>(v));
  const int position = buffer.Add(positions, kFloat, "VEC3", mesh.vertices.size(), kArrayBuffer);
  buffer.accessor(position)["min"] = {least.x(), least.y(), least.z()};
  buffer.accessor(position)["max"] = {most.x(), most.y(), most.z()};
  const int color = buffer.Add(rgba, kUnsignedShort, "VEC4", mesh.vertices.size(), kArrayBuffer);
  buffer.accessor(color)["normalized"] = true;
  const int index = buffer.Add(indices, kUnsignedInt, "SCALAR", indices.size(), kElementBuffer);

  json gltf = {
      {"asset", {{"version", "2.0"}, {"generator", std::string(kExportGenerator) + " " + kVersion}}},
      {"extensionsUsed", {"KHR_materials_unlit"}},
      {"materials",
       {{{"name", "photographs"},
         {"doubleSided", true},
         {"extensions", {{"KHR_materials_unlit", json::object()}}},
         {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}}},
      {"meshes",
       {{{"name", lumigraph.proxy_name()},
         {"primitives",
          {{{"attributes", {{"POSITION", position}, {"COLOR_0", color}}}, {"indices", index}, {"material", 0}}}}}}},
      {"nodes", {{{"name", lumigraph.proxy_name()}, {"mesh", 0}}}}};
  AddCameras(lumigraph.scene(), gltf);
  std::vector<std::size_t> children(gltf["nodes"].size());
  for (std::size_t i = 0; i < children.size(); ++i) children[i] = i;
  gltf["nodes"].push_back(
      {{"name", "lumigraph"}, {"children", children}, {"matrix", MatrixOf(GltfFromWorld(lumigraph.scene()))}});
  gltf["scenes"] = {{{"nodes", {children.size()}}}};
  gltf["scene"] = 0;
  gltf["accessors"] = buffer.accessors();
  gltf["bufferViews"] = buffer.views();
  gltf["buffers"] = {{{"byteLength", buffer.bytes().size()}}};
  const std::string chunks = Chunk("JSON", gltf.dump(-1, ' ', true, json::error_handler_t::replace), ' ') +
                             Chunk(std::string("BIN\0", 4).c_str(), buffer.bytes(), '\0');
  const std::uint32_t head[3] = {0x46546C67U, 2, static_cast<std::uint32_t>(12 + chunks.size())};
  return std::string(reinterpret_cast<const char*>(head), sizeof head) + chunks;
}

// As trainers of splats read their first points: position, normal, colour. Positions are doubles where floats would not
// do.
long WritePoints(const Lumigraph& lumigraph, const VertexColors& colors, const std::filesystem::path& file) {
  const Mesh& mesh = lumigraph.mesh();
  std::vector<Eigen::Vector3d> centres;
  for (const View& view : lumigraph.scene().views) centres.push_back(view.CentreInWorld());
  const std::vector<Eigen::Vector3d> normals = VertexNormals(mesh, centres);
  const bool far = OriginOf(lumigraph.scene()) != Eigen::Vector3d::Zero();
  std::string body;
  long count = 0;
  const auto add = [&](const Eigen::Vector3d& x, const Eigen::Vector3d& n, const Eigen::Array3f& rgb) {
    const Eigen::Vector3f near = x.cast<float>(), normal = n.cast<float>();
    if (far)
      body.append(reinterpret_cast<const char*>(x.data()), 24);
    else
      body.append(reinterpret_cast<const char*>(near.data()), 12);
    body.append(reinterpret_cast<const char*>(normal.data()), 12);
    for (int c = 0; c < 3; ++c) body.push_back(static_cast<char>(std::lround(255 * rgb[c])));
    ++count;
  };
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (colors.seen[i]) add(mesh.vertices[i], normals[i], colors.rgb[i]);
  for (const Point& p : lumigraph.scene().points)
    add(p.x_in_world, Eigen::Vector3d::Zero(),
        Eigen::Array3f(static_cast<float>(p.color[0]), static_cast<float>(p.color[1]), static_cast<float>(p.color[2])) /
            255);
  std::string head =
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n", kExportGenerator, count);
  for (const char* name : {"x", "y", "z"}) head += fmt::format("property {} {}\n", far ? "double" : "float", name);
  for (const char* name : {"nx", "ny", "nz"}) head += fmt::format("property float {}\n", name);
  for (const char* name : {"red", "green", "blue"}) head += fmt::format("property uchar {}\n", name);
  WriteTextAtomically(file, head + "end_header\n" + body);
  return count;
}

}  // namespace

void ListKeys(JsonKeys& j, GltfSummary& s) {
  j("output", s.output, "proxy", s.proxy, "vertices", s.vertices, "faces", s.faces, "cameras", s.cameras, "seen",
    s.seen, "mb", s.mb, "points", s.points, "points_written", s.points_written, "seconds", s.seconds);
}

std::string Describe(const GltfSummary& s) {
  std::string text = fmt::format(
      "{}: {:.1f} MB, {} vertices ({:.0f} % seen by a photo), {} faces, {} cameras; each vertex has one colour from "
      "all "
      "sides\n",
      s.output, s.mb, s.vertices, 100 * s.seen, s.faces, s.cameras);
  if (!s.points.empty()) text += fmt::format("{}: {} points\n", s.points, s.points_written);
  return text;
}

GltfSummary ExportGltf(const GltfOptions& o, ProgressSink& sink) {
  if (o.output.extension() != ".glb")
    throw UsageError(fmt::format("-o {}: a glTF file of one piece ends in .glb", o.output.string()), "-o FILE.glb");
  if (!o.points.empty() && o.points.extension() != ".ply")
    throw UsageError(fmt::format("--points {}: points are written as .ply", o.points.string()));
  RequireOurFile(o.output, kExportGenerator, "glTF file");
  if (!o.points.empty()) RequireOurFile(o.points, kExportGenerator, "file of points");
  const Stopwatch watch;
  LumigraphOptions open;
  open.scene = o.scene;
  Lumigraph lumigraph(open, sink);
  RequireMetric(lumigraph.scene(), "a glTF file");
  lumigraph.MakePictures(o.proxy, false);
  if (!lumigraph.one_mesh())
    throw UsageError("a glTF file needs one proxy for all views",
                     "make one with lumi-proxy auto, and leave --proxy out");
  lumigraph.ReadPhotos(sink, HalvingsToHold(lumigraph.scene(), 0, 1, sink));
  lumigraph.ChooseMeasures({}, {});
  const VertexColors colors = ColorVertices(lumigraph, sink);
  const std::string glb = Glb(lumigraph, colors);
  WriteBytesAtomically(o.output, glb.data(), glb.size());
  GltfSummary summary;
  if (!o.points.empty()) {
    summary.points_written = WritePoints(lumigraph, colors, o.points);
    summary.points = o.points.string();
  }
  summary.output = o.output.string();
  summary.proxy = lumigraph.proxy_name();
  summary.vertices = static_cast<long>(colors.rgb.size());
  summary.faces = static_cast<long>(lumigraph.mesh().faces.size());
  summary.cameras = static_cast<long>(lumigraph.scene().views.size());
  summary.seen = colors.rgb.empty() ? 0
                                    : static_cast<double>(std::ranges::count(colors.seen, true)) /
                                          static_cast<double>(colors.seen.size());
  summary.mb = static_cast<double>(glb.size()) / 1e6;
  summary.seconds = watch.Seconds();
  return summary;
}

}  // namespace lumi
