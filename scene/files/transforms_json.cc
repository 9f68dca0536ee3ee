#include "scene/files/transforms_json.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/error.h"
#include "scene/program/printable.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

// How far a transform_matrix may be from a rotation, an element: these files carry six digits or more.
constexpr double kRotationTolerance = 1e-3;

// The OpenGL camera (x right, y up, z back) to ours (x right, y down, z forward), and back.
const Eigen::Vector3d kFlip(1, -1, -1);

std::string TermKey(CameraTerm term) {
  switch (term) {
    case CameraTerm::kK1:
    case CameraTerm::kTheta1: return "k1";
    case CameraTerm::kK2:
    case CameraTerm::kTheta2: return "k2";
    case CameraTerm::kK3:
    case CameraTerm::kTheta3: return "k3";
    case CameraTerm::kTheta4: return "k4";
    case CameraTerm::kP1: return "p1";
    case CameraTerm::kP2: return "p2";
    default: throw std::invalid_argument("TermKey: not of a lens that transforms.json has");
  }
}

struct Reader {
  const fs::path& file;

  InputError Fail(const std::string& what) const { return InputError(file, what); }

  double ToDouble(const Json& value, const std::string& what) const {
    if (!value.is_number() || !std::isfinite(value.get<double>())) throw Fail(what + " is no number");
    return value.get<double>();
  }
  // The value at the frame, else the one at the top of the file.
  std::optional<double> Number(const Json& frame, const Json& root, const char* key) const {
    for (const Json* object : {&frame, &root})
      if (const auto it = object->find(key); it != object->end() && !it->is_null()) return ToDouble(*it, key);
    return std::nullopt;
  }
  std::string Text(const Json& frame, const Json& root, const char* key) const {
    for (const Json* object : {&frame, &root})
      if (const auto it = object->find(key); it != object->end()) {
        if (!it->is_string()) throw Fail(fmt::format("{} is no text", key));
        return it->get<std::string>();
      }
    return {};
  }

  // A key of our own; other writers of these files leave orientation to the photos' EXIF.
  int Orientation(const Json& frame) const {
    const double value = Number(frame, frame, "orientation").value_or(1);
    if (!(value >= 1 && value <= 8) || value != std::floor(value))
      throw Fail(fmt::format("orientation = {} is none: 1 to 8", value));
    return static_cast<int>(value);
  }

  int Side(double value, const char* key) const {
    if (!(value >= 1 && value <= (1 << 20)) || value != std::floor(value))
      throw Fail(fmt::format("{} = {} is no size", key, value));
    return static_cast<int>(value);
  }

  Camera ReadCamera(const Json& frame, const Json& root, const fs::path& photo) const {
    const auto number = [&](const char* key) { return Number(frame, root, key); };
    const auto w = number("w"), h = number("h");
    int width = 0, height = 0;
    if (w && h) {
      width = Side(*w, "w");
      height = Side(*h, "h");
    } else {
      const ImageInfo info = ReadImageInfo(photo);
      width = info.width;
      height = info.height;
    }
    // Focal lengths, or fields of view in radians.
    const auto focal = [&](const char* length, const char* angle, int side) -> std::optional<double> {
      if (const auto f = number(length)) return f;
      const auto a = number(angle);
      if (!a) return std::nullopt;
      if (!(*a > 0 && *a < 3.14159)) throw Fail(fmt::format("{} = {} is no field of view", angle, *a));
      return side / (2 * std::tan(*a / 2));
    };
    auto fx = focal("fl_x", "camera_angle_x", width), fy = focal("fl_y", "camera_angle_y", height);
    if (!fx) fx = fy;
    if (!fy) fy = fx;
    if (!fx)
      throw Fail(
          "the keys \"fl_x\" (focal length, pixels) and \"camera_angle_x\" are missing, at the top and at the frame");
    const double cx = number("cx").value_or(width / 2.0), cy = number("cy").value_or(height / 2.0);
    const auto k = [&](const char* key) { return number(key).value_or(0.0); };
    const std::string model = Text(frame, root, "camera_model");
    bool fisheye = model == "OPENCV_FISHEYE";
    for (const Json* object : {&frame, &root})
      if (const auto it = object->find("is_fisheye"); it != object->end() && it->is_boolean())
        fisheye |= it->get<bool>();
    if (!fisheye && !model.empty() && !CameraModelFromName(model))
      throw InputError(file, fmt::format("camera_model {} is not read", model.substr(0, 40)),
                       "undistort the photos first");
    Camera camera = Camera::Pinhole(width, height, *fx, *fy, cx, cy);
    if (fisheye) {
      camera.model = CameraModel::kOpenCVFisheye;
      camera.params.insert(camera.params.end(), {k("k1"), k("k2"), k("k3"), k("k4")});
    } else {
      if (k("k3") != 0 || k("k4") != 0)
        throw InputError(file, "k3 and k4 of a lens that is no fisheye are not read", "undistort the photos first");
      if (k("k1") != 0 || k("k2") != 0 || k("p1") != 0 || k("p2") != 0) {
        camera.model = CameraModel::kOpenCV;
        camera.params.insert(camera.params.end(), {k("k1"), k("k2"), k("p1"), k("p2")});
      }
    }
    if (const auto wrong = Validate(camera)) throw Fail(*wrong);
    return camera;
  }

  Rigid3 ReadPose(const Json& frame, const std::string& name) const {
    const auto fail = [&](const char* what) { return Fail(fmt::format("{}: transform_matrix {}", name, what)); };
    const auto it = frame.find("transform_matrix");
    if (it == frame.end() || !it->is_array() || (it->size() != 4 && it->size() != 3)) throw fail("is no 4x4 matrix");
    Eigen::Matrix<double, 3, 4> m;
    for (int r = 0; r < 3; ++r) {
      const Json& row = (*it)[static_cast<std::size_t>(r)];
      if (!row.is_array() || row.size() != 4) throw fail("is no 4x4 matrix");
      for (int c = 0; c < 4; ++c) m(r, c) = ToDouble(row[static_cast<std::size_t>(c)], name + ": transform_matrix");
    }
    const Eigen::Matrix3d R_gl = m.leftCols<3>();
    if (!((R_gl * R_gl.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRotationTolerance) ||
        !(R_gl.determinant() > 0))
      throw fail("is no rotation and translation");
    const Eigen::Matrix3d world_from_cam = R_gl * kFlip.asDiagonal();
    const Eigen::Quaterniond nearest(NearestRotation(world_from_cam));
    const Rigid3 pose = Rigid3{nearest.normalized(), m.col(3)}.Inverse();
    if (!pose.translation.allFinite()) throw fail("leads beyond what numbers can hold");
    return pose;
  }
};

// The photo a frame names: as it is, or with the endings that files of this kind leave out.
std::optional<fs::path> FindPhoto(const fs::path& folder, const std::string& file_path) {
  const fs::path named = (folder / file_path).lexically_normal();
  std::error_code error;
  if (fs::is_regular_file(named, error)) return named;
  if (!HasImageExtension(named))
    for (const char* ending : {".png", ".jpg", ".jpeg"})
      if (fs::path with = named.string() + ending; fs::is_regular_file(with, error)) return with;
  return std::nullopt;
}

// The photo's path relative to the folder of the JSON, or "../" and the path below the folder above it; empty: the
// photo lies outside of both.
fs::path NameFor(const fs::path& folder, const fs::path& photo) {
  const fs::path name = photo.lexically_normal().lexically_relative(folder);
  auto part = name.begin();
  if (part != name.end() && *part == "..") ++part;
  return name.empty() || (part != name.end() && *part == "..") ? fs::path() : name;
}

fs::path FolderOf(const fs::path& json) { return fs::absolute(json).lexically_normal().parent_path(); }

fs::path CommonFolder(const fs::path& a, const fs::path& b) {
  fs::path common;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end() && *i == *j; ++i, ++j) common /= *i;
  return common;
}

}  // namespace

Scene ReadTransformsJson(const fs::path& path, std::vector<std::string>* skipped) {
  Json root;
  try {
    root = Json::parse(ReadJsonText(path));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(path, "is " + JsonProblem(e.what()));
  }
  const Reader reader{path};
  const auto frames = root.is_object() ? root.find("frames") : root.end();
  if (!root.is_object() || frames == root.end() || !frames->is_array()) throw InputError(path, "has no frames");
  const fs::path folder = FolderOf(path);
  fs::path image_folder = folder;
  std::vector<std::pair<fs::path, View>> found;
  std::map<std::tuple<CameraModel, int, int, std::vector<double>>, CameraId> cameras;  // equal ones become one
  Scene scene;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const Json& frame = (*frames)[i];
    if (!frame.is_object()) throw InputError(path, fmt::format("frames[{}] is no object", i));
    const std::string file_path = reader.Text(frame, frame, "file_path");
    if (file_path.empty() || file_path.find('\0') != std::string::npos)
      throw InputError(path, fmt::format("frames[{}] has no file_path", i));
    if (NameFor(folder, folder / file_path).empty())
      throw InputError(
          path,
          fmt::format("frames[{}].file_path \"{}\" leads out of the file's folder and the one above it", i, file_path),
          "put the photos beside the file");
    const auto photo = FindPhoto(folder, file_path);
    if (!photo) {
      if (skipped) skipped->push_back(file_path);
      continue;
    }
    View view;
    view.cam_from_world = reader.ReadPose(frame, file_path);
    view.time_s = reader.Number(frame, frame, "time");
    view.orientation = reader.Orientation(frame);
    const Camera camera = reader.ReadCamera(frame, root, *photo);
    const auto [known, added] = cameras.try_emplace({camera.model, camera.width_px, camera.height_px, camera.params},
                                                    CameraId{static_cast<std::int32_t>(scene.cameras.size())});
    if (added) scene.cameras.push_back(camera);
    view.camera = known->second;
    image_folder = CommonFolder(image_folder, photo->parent_path());
    found.emplace_back(*photo, std::move(view));
  }
  if (found.empty())
    throw InputError(path, frames->empty() ? std::string("has no frames")
                                           : fmt::format("none of its {} photos is there", frames->size()));
  for (auto& [photo, view] : found) {
    view.name = photo.lexically_relative(image_folder).generic_string();
    scene.views.push_back(std::move(view));
  }
  std::sort(scene.views.begin(), scene.views.end(), [](const View& a, const View& b) { return a.name < b.name; });
  for (std::size_t i = 1; i < scene.views.size(); ++i)
    if (scene.views[i].name == scene.views[i - 1].name)
      throw InputError(path, fmt::format("the photo {} comes twice", scene.views[i].name));
  scene.folder = folder;
  scene.image_folder = image_folder;
  return scene;
}

void WriteTransformsJson(const Scene& scene, const fs::path& path) {
  if (scene.frame != Frame::kMetric)
    throw DataError("a scene without metric cameras cannot be a transforms.json",
                    "make it again with known intrinsics: lumi-reconstruct --camera camera.yaml", path);
  const fs::path folder = FolderOf(path);
  const auto put_camera = [](Json& object, const Camera& c) {
    const Eigen::Vector2d f = c.FocalPx(), p = c.PrincipalPointPx();
    object["camera_model"] = c.IsPinhole()                            ? "PINHOLE"
                             : c.model == CameraModel::kOpenCVFisheye ? "OPENCV_FISHEYE"
                                                                      : "OPENCV";
    object["w"] = c.width_px;
    object["h"] = c.height_px;
    object["fl_x"] = f.x();
    object["fl_y"] = f.y();
    object["cx"] = p.x();
    object["cy"] = p.y();
    object["camera_angle_x"] = 2 * std::atan(c.width_px / (2 * f.x()));
    object["camera_angle_y"] = 2 * std::atan(c.height_px / (2 * f.y()));
    for (std::size_t i = static_cast<std::size_t>(InfoOf(c.model).FocalCount()) + 2; i < c.params.size(); ++i)
      object[TermKey(InfoOf(c.model).terms[i])] = c.params[i];
  };
  // One camera stands at the top, where every reader looks; several stand at their frames.
  const bool one = std::all_of(scene.views.begin(), scene.views.end(),
                               [&](const View& v) { return v.camera == scene.views.front().camera; });
  Json root = Json::object();
  if (one && !scene.views.empty()) put_camera(root, scene.CameraOf(scene.views.front()));
  root["frames"] = Json::array();
  for (const View& view : scene.views) {
    Json frame = Json::object();
    const fs::path photo = fs::absolute(scene.ImagePath(view));
    fs::path name = NameFor(folder, photo);
    if (name.empty()) name = NameFor(fs::weakly_canonical(folder), fs::weakly_canonical(photo));  // one is a link
    if (name.empty())
      throw DataError("the photo lies neither in the folder of the transforms.json nor in the one above it",
                      "copy the photos beside it", scene.ImagePath(view));
    if (!IsUtf8(name.string()))
      throw DataError("the photo's name is not UTF-8 and cannot be written as JSON", "rename it", view.name);
    frame["file_path"] = name.generic_string();
    if (!one) put_camera(frame, scene.CameraOf(view));
    const Rigid3 world_from_cam = view.cam_from_world.Inverse();
    const Eigen::Matrix3d R_gl = world_from_cam.R() * kFlip.asDiagonal();
    Json matrix = Json::array();
    for (int r = 0; r < 3; ++r) matrix.push_back({R_gl(r, 0), R_gl(r, 1), R_gl(r, 2), world_from_cam.translation[r]});
    matrix.push_back({0.0, 0.0, 0.0, 1.0});
    frame["transform_matrix"] = std::move(matrix);
    if (view.time_s) frame["time"] = *view.time_s;
    if (view.orientation != 1) frame["orientation"] = view.orientation;
    root["frames"].push_back(std::move(frame));
  }
  WriteTextAtomically(path, root.dump(1) + "\n");
}

}  // namespace lumi
