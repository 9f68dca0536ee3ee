#include "tests/fuzz/seeds.h"

#include <fmt/format.h>

#include <fstream>
#include <numbers>

#include "proxy/dense/depth_files.h"
#include "render/path/camera_path.h"
#include "render/path/nerfstudio_path.h"
#include "render/settings_json.h"
#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"
#include "scene/files/mesh_io.h"
#include "scene/files/projective_json.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/transforms_json.h"
#include "tests/support/photo_files.h"

namespace lumi::fuzz {
namespace {
namespace fs = std::filesystem;

constexpr std::size_t kViews = 4, kPoints = 24;

// The first views and the points that two of them see.
Scene FewOf(const Scene& all) {
  Scene few = all;
  few.views.resize(std::min(kViews, few.views.size()));
  few.points.clear();
  for (Point p : all.points) {
    std::erase_if(p.track,
                  [&](const Observation& o) { return static_cast<std::size_t>(o.view.value) >= few.views.size(); });
    if (p.track.size() >= 2 && few.points.size() < kPoints) few.points.push_back(std::move(p));
  }
  return few;
}

Scene AsProjective(Scene scene) {
  scene.frame = Frame::kQuasiAffine;
  scene.plane_at_infinity = Eigen::Vector4d(0, 0, 0, 1);
  for (View& v : scene.views) {
    v.P = ProjectionMatrix(scene.CameraOf(v).K(), v.cam_from_world);
    v.size_px = {scene.CameraOf(v).width_px, scene.CameraOf(v).height_px};
  }
  for (Point& p : scene.points) p.X_in_world = p.x_in_world.homogeneous();
  return scene;
}

Mesh FanOf(const Scene& scene) {
  Mesh mesh;
  for (const Point& p : scene.points) {
    mesh.vertices.push_back(p.x_in_world);
    mesh.colors.push_back(p.color);
    const auto n = static_cast<std::int32_t>(mesh.vertices.size());
    if (n >= 3) mesh.faces.push_back({n - 3, n - 2, n - 1});
  }
  return mesh;
}

// The model's files, each behind the byte that says which it is (colmap_fixture.h).
void WriteModelSeeds(const Scene& scene, ColmapFormat format, const fs::path& out) {
  const fs::path model = out.parent_path() / "model";
  WriteColmapModel(scene, model, format);
  const std::string ending = format == ColmapFormat::kText ? ".txt" : ".bin";
  char which = '0';  // a multiple of three
  for (const char* name : {"cameras", "images", "points3D"})
    WriteTextAtomically(out / name, which++ + ReadText(model / (name + ending)));
  fs::remove_all(model);
}

std::string TwelveNumbers(const Matrix34d& m) {
  std::string line;
  for (int i = 0; i < 12; ++i) line += fmt::format("{}{}", i ? " " : "", m(i / 4, i % 4));
  return line;
}

void WritePosesSeeds(const Scene& scene, const fs::path& out) {
  std::string projection, poses, named, middlebury = fmt::format("{}\n", scene.views.size());
  for (const View& v : scene.views) {
    const Eigen::Matrix3d K = scene.CameraOf(v).K();
    projection += TwelveNumbers(ProjectionMatrix(K, v.cam_from_world)) + "\n";
    poses += TwelveNumbers(v.cam_from_world.Matrix()) + "\n";
    named += v.name + "," + TwelveNumbers(v.cam_from_world.Matrix()) + " 0 0 0 1 # its last row\n";
    middlebury += v.name;
    for (const Eigen::Matrix3d& m : {K, v.cam_from_world.R()})
      for (int i = 0; i < 9; ++i) middlebury += fmt::format(" {}", m(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) middlebury += fmt::format(" {}", v.cam_from_world.translation[i]);
    middlebury += "\n";
  }
  WriteTextAtomically(out / "projection", projection);
  WriteTextAtomically(out / "poses", poses);
  WriteTextAtomically(out / "named", named);
  WriteTextAtomically(out / "middlebury", middlebury);
}

void WritePathSeeds(const Scene& scene, const fs::path& out) {
  CameraPath path;
  path.width_px = 64;
  path.height_px = 48;
  MatrixPath matrices;
  matrices.width_px = 64;
  matrices.height_px = 48;
  for (const View& v : scene.views) {
    const double time_s = 0.5 * static_cast<double>(path.keys.size());
    path.keys.push_back({v.cam_from_world, 0.8, time_s, {0.5, 0.45}});
    MatrixKey key;
    key.time_s = time_s;
    key.P = key.filmed = key.steady = ProjectionMatrix(scene.CameraOf(v).K(), v.cam_from_world);
    key.view = v.name;
    key.anchors = {{{1, 2}, {3, 4}}, {{5.5, 6}, {7, 8}}};
    matrices.keys.push_back(key);
  }
  WriteCameraPath(out / "camera_path/ours", path);
  path.fps = 4;
  WriteNerfstudioPath(out / "camera_path/nerfstudio", path, 64, 48);
  WriteMatrixPath(out / "matrix_path/plain", matrices);
  matrices.model = "smooth";
  matrices.object_px = {1, 2, 30, 40};
  WriteMatrixPath(out / "matrix_path/stabilised", matrices);
}

void WriteTextSeeds(const fs::path& out) {
  const auto write = [&](const char* name, const std::string& text) { WriteTextAtomically(out / name, text); };
  write("view_times/seconds", "a.jpg,0.5\nb.jpg,1.25\n");
  write("view_times/phases", "image,phase_deg,period,frame\n\"a.jpg\",90,0,3\nb.jpg,270.5,1,7\n");
  write("colour_rule/colours", "(B - R) < 25 && R + G + B > 60");
  write("colour_rule/all", "not (H >= 20 and S <= 0.5) || min(L, V*255) != max(-X, +Y/2) && !(abs(R-G) == 1e1)");
  write("planes_json/planes", R"({"quads": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]], "planes": [{"points": [[0,0,1],)"
                              R"([1,0,1],[0,1,1.5]]}, {"normal": [0,0,2], "offset": 3}]})");
  write("point_pairs/json", R"({"pairs": [{"mesh": [0,0,0], "scene": [1,2,3]}, {"mesh": [1,0,0], "scene": [2,2,3]}]})");
  write("point_pairs/lines", "x y z X Y Z\n0 0 0 1 2 3\n1,0,0,2,2,3\n0;1;0;+1;3;3\n# end\n");
  write("camera_yaml/ros",
        "image_width: 64\nimage_height: 48\ncamera_name: test\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [60, 0, "
        "32,\n"
        "   0, 61, 24, 0, 0, 1]\ndistortion_model: plumb_bob # ROS\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
        "  data: [-0.05, 0.01, 0.001, -0.002, 0]\n");
  write("camera_yaml/opencv",
        "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ndistortion_model: fisheye\ncamera_matrix: "
        "!!opencv-matrix\n   "
        "rows: 3\n   cols: 3\n   dt: d\n   data: [ 40., 0., 32., 0., 41., 24., 0., 0., 1. ]\ndist_coeffs: "
        "!!opencv-matrix\n"
        "   rows: 4\n   cols: 1\n   dt: d\n   data: [ 0.01, -2e-3, 0.001, -1e-4 ]\n");
  write(
      "mesh_ply/ascii",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty list "
      "uchar float w\nproperty ushort red\nproperty ushort green\nproperty ushort blue\nelement face 2\nproperty list "
      "uchar int vertex_indices\nelement edge 1\nproperty int v\nend_header\n0 0 0 1 5 1 2 3\n1 0 0 0 1 2 3\n1 1 0 0 4 "
      "5 6\n"
      "0 1 0 2 1 2 7 8 9\n4 0 1 2 3\n3 0 1 3\n7\n");
  write("mesh_obj/relative",
        "# obj\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nf 1/1 2/2 \\\n 3//3 4\nf -1 -2 -3\n");
  write("scene_description/one",
        R"({"name": "s", "image": {"format": "png", "samples_per_pixel": 4},
"cameras": [{"name": "c", "model": "OPENCV", "size": [64, 48], "fov_deg": 60, "distortion": [0.1, 0, 0, 0]}],
"path": [{"kind": "ring", "radius": 2, "height": 1, "views": 6, "camera": "c", "look_at": [0, 0, 0]},
{"kind": "walk", "from": [0, 0, 1], "to": [4, 0, 1], "views": 5, "gait": {"step_hz": 2}, "hold": [9, 0, 1]},
{"kind": "clusters", "centres": [[0, 0, 1]], "views": 3},
{"kind": "grid", "centre": [0, 0, 2], "columns": 2, "rows": 2},
{"kind": "poses", "poses": [{"eye": [0, 0, 0], "target": [1, 0, 0]}]},
{"kind": "wave", "centre": [0, 0, 1], "hand": {"drift": 0.1}, "views": 4, "zoom": [1, 2]}],
"materials": [{"name": "m", "texture": {"kind": "noise", "colors": ["#ff8000", [0.1, 0.2, 0.3]],
"size": [0.1, 0.2]}}],
"objects": [{"kind": "group", "position": [0, 0, 1], "copies": {"count": [2, 1, 1], "step": [1, 0, 0]}, "objects": [
{"kind": "box", "size": [1, 1, 1], "material": "m", "spin": {"axis": [0, 0, 1], "period_s": 2}}]},
{"kind": "loft", "sections": [[0, 0, 0, 1, 1], {"centre": [0, 1, 0]}], "material": "m"},
{"kind": "sphere", "radius": 1, "material": "m"}, {"kind": "cylinder", "radius": 1, "height": 2, "material": "m"}],
"lights": [{"towards": [0, 0, 1], "size_deg": 2}, {"position": [1, 1, 1], "strength": 2}],
"background": {"zenith": [0, 0, 1]}, "ambient": {"sky": "#ffffff"},
"effects": {"noise_sigma": 2, "vignetting": 0.3, "rolling_shutter_s": 0.02}, "period_s": 2,
"fixed_video": {"eye": [3, 0, 1], "target": [0, 0, 1]}})");
}

void WriteDepthSeeds(const fs::path& out) {
  ImageF depth(4, 3, 1), normals(4, 3, 3);
  for (float& d : depth.data) d = 2;
  for (std::size_t i = 2; i < normals.data.size(); i += 3) normals.data[i] = -1;
  WriteColmapMatrix(out / "depth_map/depth", depth);
  WriteColmapMatrix(out / "depth_map/normals", normals);
  WritePlanes(out / "planes_map/planes", DepthMap(4, 3));
}

void WritePictureSeeds(const fs::path& out) {
  Image8 picture(24, 16, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) picture.data[i] = static_cast<std::uint8_t>(i * 7);
  for (const char* ending : {"jpg", "png", "bmp", "webp", "tga", "ppm"}) {
    const fs::path file = out / "photo" / (std::string("small.") + ending);
    WriteImage(file, picture);
  }
  WriteImage(out / "plain_jpeg" / "small.jpg", picture, 80, 6);  // its orientation stands in EXIF
  // EXIF and the place in each of its wrappings.
  WriteImage(out / "photo" / "exif.jpg", picture, 80, 6);
  WriteImage(out / "photo" / "exif.png", picture);
  test::AddExifToPng(out / "photo" / "exif.png",
                     test::ExifBlock({test::Ascii(271, "Acme"), test::Shorts(274, {6})},
                                     {test::Rationals(0x920A, {4.25}), test::Shorts(0xA405, {26})}, test::GpsFields()));
  WriteImage(out / "photo" / "small.tif", picture);
  test::WriteTiffWithGps(out / "photo" / "gps.tif");
  test::WriteDng(out / "photo" / "small.dng", 32, 24, {0.5, 0.2, 0.1});
  ImageF linear(8, 6, 3);
  for (std::size_t i = 0; i < linear.data.size(); ++i) linear.data[i] = 0.01F * static_cast<float>(i);
  for (const char* ending : {"exr", "hdr"}) WriteImage(out / "photo" / (std::string("linear.") + ending), linear);
}

// Files of the capture that are inputs as they are.
void CopySmall(const fs::path& from, const fs::path& to) {
  constexpr std::uintmax_t kSmall = 64 << 10;
  std::error_code error;
  if (!fs::is_regular_file(from, error) || fs::file_size(from, error) > kSmall) return;
  fs::create_directories(to.parent_path());
  fs::copy_file(from, to, fs::copy_options::overwrite_existing);
}

}  // namespace

const Scene& SeedScene() {
  static const Scene scene = [] {
    Scene s;
    s.cameras.push_back(Camera::Pinhole(64, 48, 60, 61, 31.5, 24.25));
    s.cameras.push_back({CameraModel::kOpenCV, 64, 48, {60, 62, 32, 24, -0.05, 0.01, 1e-3, -2e-3}});
    for (int i = 0; i < 3; ++i) {
      View view;
      view.name = fmt::format("photo{}.jpg", i);
      view.camera = {i % 2};
      view.cam_from_world = LookAt({std::sin(0.2 * i - 0.2) * 4, 0.3 * i, -4}, {0, 0, 0}, -Eigen::Vector3d::UnitY());
      s.views.push_back(view);
    }
    for (int i = 0; i < 6; ++i) {
      Point point;
      point.x_in_world = {std::sin(2.0 * i), std::cos(3.0 * i), 0.1 * i};
      for (int v = 0; v < 3; ++v)
        if (const auto x = s.cameras[static_cast<std::size_t>(v % 2)].Project(
                s.views[static_cast<std::size_t>(v)].cam_from_world * point.x_in_world))
          point.track.push_back({{v}, *x});
      s.points.push_back(point);
    }
    return s;
  }();
  return scene;
}

void WriteSeeds(const fs::path& capture, const fs::path& out) {
  OpenOptions options;
  options.check_photos = options.undistort = false;
  const Scene whole = OpenScene(capture, options, SilentProgress());
  const Scene scene = FewOf(whole);
  WriteModelSeeds(SeedScene(), ColmapFormat::kBinary, out / "colmap_binary");
  WriteModelSeeds(SeedScene(), ColmapFormat::kText, out / "colmap_text");
  WriteProjectiveJson(AsProjective(scene), out / "projective_json/capture");
  Scene named = SeedScene();  // whose photos the target has
  named.image_folder = out / "transforms_json/images";
  WriteTransformsJson(named, out / "transforms_json/capture");
  named.cameras.resize(1);
  for (View& v : named.views) v.camera = {0}, v.time_s = 0.5;
  WriteTransformsJson(named, out / "transforms_json/one_camera");
  WriteMesh(out / "mesh.ply", FanOf(scene));
  WriteMesh(out / "mesh.obj", FanOf(scene));
  CopySmall(out / "mesh.ply", out / "mesh_ply/binary");
  CopySmall(out / "mesh.obj", out / "mesh_obj/capture");
  fs::remove(out / "mesh.ply");
  fs::remove(out / "mesh.obj");
  WriteCameraYaml(scene.cameras.front(), out / "camera_yaml/ours");
  WritePosesSeeds(scene, out / "poses_text");
  WritePathSeeds(scene, out);
  WriteTextSeeds(out);
  WriteDepthSeeds(out);
  WritePictureSeeds(out);
  WriteTextAtomically(out / "settings/defaults", JsonKeys(RadianceSettings()).Text(1));
  Provenance record{"render", "1.0", {{"width", "64"}, {"k", "4"}}, {{"images", "12-ab"}}, {{"o.png", "9-cd"}}, 1.5};
  WriteProvenance(out, record);  // out/provenance/render.json
  CopySmall(capture / "lumigraph.json", out / "manifest/capture");
  CopySmall(capture / "provenance/simulate.json", out / "provenance/simulate");
  for (std::size_t i = 0; i < whole.views.size() && i < 2; ++i)
    CopySmall(whole.ImagePath(whole.views[i]), out / "photo" / whole.views[i].name);
}

}  // namespace lumi::fuzz
