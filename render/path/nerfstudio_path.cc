#include "render/path/nerfstudio_path.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "scene/files/atomic_file.h"
#include "scene/files/json_problem.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::json;

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kRigid = 1e-3;               // a matrix written with four digits still is a rotation
constexpr double kDefaultTransition_s = 0.5;  // nerfstudio's, where a file names none

// y and z turn over between its cameras and ours (x right, y down, z forward).
const Eigen::Vector3d kFlip(1, -1, -1);

Rigid3 CamFromWorld(const Json& matrix, const std::filesystem::path& file, const std::string& where) {
  std::vector<double> m;
  for (const Json& row : matrix) {
    if (row.is_array())
      for (const Json& v : row) m.push_back(v.get<double>());
    else
      m.push_back(row.get<double>());
  }
  if (m.size() != 16 && m.size() != 12)
    throw InputError(file, fmt::format("{}: a camera_to_world of {} numbers, not 16", where, m.size()));
  Eigen::Matrix3d R;
  Eigen::Vector3d c;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) R(row, column) = m[static_cast<std::size_t>(4 * row + column)];
    c[row] = m[static_cast<std::size_t>(4 * row + 3)];
  }
  const bool affine = m.size() == 12 || (m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1);
  if (!affine || !R.allFinite() || !c.allFinite() ||
      !((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < kRigid) || R.determinant() < 0)
    throw InputError(file, fmt::format("{}: camera_to_world is no rotation and position, row by row", where));
  Rigid3 cam;
  cam.rotation = Eigen::Quaterniond(Eigen::Matrix3d((R * kFlip.asDiagonal()).transpose())).normalized();
  cam.translation = -(cam.rotation * c);
  return cam;
}

Json Matrix(const Rigid3& cam_from_world) {
  const Eigen::Matrix3d R = cam_from_world.R().transpose() * kFlip.asDiagonal();
  const Eigen::Vector3d c = cam_from_world.OriginInSource();
  Json m = Json::array();
  for (int row = 0; row < 3; ++row)
    for (const double v : {R(row, 0), R(row, 1), R(row, 2), c[row]}) m.push_back(v);
  for (const double v : {0.0, 0.0, 0.0, 1.0}) m.push_back(v);
  return m;
}

PathKey Key(const Json& entry, const char* matrix, const std::filesystem::path& file, const std::string& where) {
  PathKey key;
  key.cam_from_world = CamFromWorld(JsonAt<Json>(entry, matrix, where + ": "), file, where);
  key.vertical_fov_rad = JsonAt<double>(entry, "fov", where + ": ") / kDegreesPerRadian;
  return key;
}

// Numbers that may be missing or null.
double Or(const Json& j, const char* name, double otherwise) {
  return j.contains(name) && j[name].is_number() ? j[name].get<double>() : otherwise;
}

// Older viewers kept keyframes as text, without times.
bool HasTimedKeyframes(const Json& j) {
  if (!j.contains("keyframes") || !j["keyframes"].is_array() || j["keyframes"].empty()) return false;
  for (const Json& k : j["keyframes"])
    if (!k.is_object() || !k.contains("matrix") || !k["matrix"].is_array()) return false;
  return true;
}

}  // namespace

bool IsNerfstudioPath(const Json& j) { return j.is_object() && j.contains("camera_path"); }

CameraPath ParseNerfstudioPath(const Json& j, const std::filesystem::path& file, PathDetail detail) {
  if (const std::string type = j.value("camera_type", "perspective"); type != "perspective")
    throw InputError(file, fmt::format("its cameras are {}; this program draws perspective ones", type));
  CameraPath path;
  path.width_px = JsonAt<int>(j, "render_width");
  path.height_px = JsonAt<int>(j, "render_height");
  const Json& frames = j.at("camera_path");
  if (!frames.is_array() || frames.empty()) throw InputError(file, "\"camera_path\" holds no frames");
  // ns-render plays its frames in `seconds`.
  const double seconds = Or(j, "seconds", 0);
  path.fps = seconds > 0 ? static_cast<double>(frames.size()) / seconds : Or(j, "fps", 30);
  if (!(path.fps > 0 && path.fps <= 1000)) throw InputError(file, "fps must lie in (0, 1000]");
  if (detail == PathDetail::kKeyframes && HasTimedKeyframes(j)) {
    const double usual = Or(j, "default_transition_sec", kDefaultTransition_s);
    const auto transition = [&](const Json& k) {
      return k.value("override_transition_enabled", Json(false)) == true ? Or(k, "override_transition_sec", usual)
                                                                         : usual;
    };
    double time = 0;
    for (const Json& k : j["keyframes"]) {
      PathKey key = Key(k, "matrix", file, fmt::format("keyframe {}", path.keys.size()));
      key.time_s = time += path.keys.empty() ? 0 : transition(k);
      path.keys.push_back(key);
    }
    if (j.value("is_cycle", Json(false)) == true && path.keys.size() > 1) {
      PathKey key = path.keys.front();
      key.time_s = time + transition(j["keyframes"].front());
      path.keys.push_back(key);
    }
    return path;
  }
  for (const Json& frame : frames) {
    PathKey key = Key(frame, "camera_to_world", file, fmt::format("frame {}", path.keys.size()));
    key.time_s = static_cast<double>(path.keys.size()) / path.fps;
    path.keys.push_back(key);
  }
  path.frames = static_cast<int>(path.keys.size());
  return path;
}

void WriteNerfstudioPath(const std::filesystem::path& file, const CameraPath& path, int width_px, int height_px) {
  const int width = path.width_px > 0 ? path.width_px : width_px,
            height = path.height_px > 0 ? path.height_px : height_px;
  const double aspect = static_cast<double>(width) / height;
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  j["camera_type"] = "perspective";
  j["render_height"] = height;
  j["render_width"] = width;
  const int count = FrameCount(path);
  j["fps"] = path.fps;
  j["seconds"] = count / path.fps;
  j["is_cycle"] = false;
  j["smoothness_value"] = 0.0;
  j["default_fov"] = path.keys.empty() ? 50.0 : path.keys.front().vertical_fov_rad * kDegreesPerRadian;
  j["default_transition_sec"] = kDefaultTransition_s;
  j["keyframes"] = Json::array();
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const PathKey& key = path.keys[i];
    nlohmann::ordered_json k{
        {"matrix", Matrix(key.cam_from_world)}, {"fov", key.vertical_fov_rad * kDegreesPerRadian}, {"aspect", aspect}};
    k["override_transition_enabled"] = i > 0;
    k["override_transition_sec"] = i > 0 ? Json(key.time_s - path.keys[i - 1].time_s) : Json(nullptr);
    j["keyframes"].push_back(k);
  }
  j["camera_path"] = Json::array();
  for (int f = 0; f < count; ++f) {
    const PathKey pose =
        PoseOnPath(path, path.keys.front().time_s + (count > 1 ? Duration(path) * f / (count - 1) : 0));
    j["camera_path"].push_back(nlohmann::ordered_json{{"camera_to_world", Matrix(pose.cam_from_world)},
                                                      {"fov", pose.vertical_fov_rad * kDegreesPerRadian},
                                                      {"aspect", aspect}});
  }
  WriteTextAtomically(file, j.dump(1) + "\n");
}

}  // namespace lumi
