#include "render/path/matrix_path.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "render/per_view.h"
#include "render/view_time.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kMatrixPathFormat = "lumigraph-path";
constexpr int kMatrixPathVersion = 1;
constexpr int kMostPx = 32768;

nlohmann::json ParsePath(const std::filesystem::path& file) {
  try {
    return nlohmann::json::parse(ReadText(file));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, std::string("not a camera path: ") + e.what());
  }
}

bool HasMatrices(const nlohmann::json& j) {
  if (!j.is_object() || !j.contains("keys") || !j["keys"].is_array() || j["keys"].empty()) return false;
  const auto& key = j["keys"].front();
  return key.is_object() && key.contains("P");
}

MatrixKey ReadKey(const nlohmann::json& k) {
  MatrixKey key;
  key.time_s = k.at("time_s").get<double>();
  const auto P = k.at("P").get<std::array<double, 12>>();
  for (int i = 0; i < 12; ++i) key.P(i / 4, i % 4) = P[static_cast<std::size_t>(i)];
  key.view = k.value("view", "");
  return key;
}

}  // namespace

bool IsMatrixPath(const std::filesystem::path& file) { return HasMatrices(ParsePath(file)); }

MatrixPath ReadMatrixPath(const std::filesystem::path& file) {
  const nlohmann::json j = ParsePath(file);
  MatrixPath path;
  try {
    if (!HasMatrices(j) || j.value("format", "") != kMatrixPathFormat) throw InputError(file, "not a path of matrices: \"format\": \"lumigraph-path\" with a P in each key");
    if (j.at("version").get<int>() > kMatrixPathVersion)
      throw InputError(file, fmt::format("a camera path of version {}; this program reads up to {}", j["version"].get<int>(), kMatrixPathVersion));
    path.fps = j.value("fps", 30.0);
    path.width_px = j.at("width").get<int>();
    path.height_px = j.at("height").get<int>();
    for (const auto& k : j["keys"]) path.keys.push_back(ReadKey(k));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, std::string("not a path of matrices: ") + e.what());
  }
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const MatrixKey& key = path.keys[i];
    const double largest = key.P.cwiseAbs().maxCoeff();
    if (!key.P.allFinite() || !(largest > 0) || !(CentreOfProjection(key.P / largest).norm() > 0.5))
      throw InputError(file, fmt::format("key {}: P is no projection matrix: twelve finite numbers of rank 3 are wanted", i));
    if (!std::isfinite(key.time_s) || (i > 0 && !(key.time_s > path.keys[i - 1].time_s))) throw InputError(file, fmt::format("key {}: times must ascend", i));
  }
  if (!(path.fps > 0 && path.fps <= 1000)) throw InputError(file, "fps must lie in (0, 1000]");
  if (path.width_px < 1 || path.height_px < 1 || path.width_px > kMostPx || path.height_px > kMostPx)
    throw InputError(file, fmt::format("width and height must lie in 1 to {}", kMostPx));
  return path;
}

void WriteMatrixPath(const std::filesystem::path& file, const MatrixPath& path) {
  nlohmann::ordered_json j;
  j["format"] = kMatrixPathFormat;
  j["version"] = kMatrixPathVersion;
  j["fps"] = path.fps;
  j["width"] = path.width_px;
  j["height"] = path.height_px;
  j["keys"] = nlohmann::ordered_json::array();
  for (const MatrixKey& key : path.keys) {
    nlohmann::ordered_json k = {{"time_s", key.time_s}, {"P", nlohmann::ordered_json::array()}};
    for (int i = 0; i < 12; ++i) k["P"].push_back(key.P(i / 4, i % 4));
    if (!key.view.empty()) k["view"] = key.view;
    j["keys"].push_back(k);
  }
  WriteTextAtomically(file, j.dump() + "\n");
}

MatrixPath MatrixPathOfPhotos(const Scene& scene, double fps) {
  MatrixPath path;
  path.fps = fps;
  const Eigen::Vector2i size = SizePx(scene, scene.views.front());
  path.width_px = size.x();
  path.height_px = size.y();
  const PhotoOrder order(scene);
  for (int rank = 0; rank < order.count(); ++rank) {
    const View& v = scene.views[static_cast<std::size_t>(order.view(rank))];
    MatrixKey key;
    key.time_s = rank / fps;
    key.P = scene.frame == Frame::kMetric ? MakeRenderView(scene, v).P : v.P;
    const Eigen::Vector2i own = SizePx(scene, v);
    key.P.row(0) *= static_cast<double>(size.x()) / own.x();
    key.P.row(1) *= static_cast<double>(size.y()) / own.y();
    key.view = v.name;
    path.keys.push_back(key);
  }
  return path;
}

std::vector<RenderView> MatrixViews(const Scene& scene, const MatrixPath& path, int width_px, int height_px) {
  std::unordered_map<std::string, const View*> called;
  for (const View& v : scene.views) called[v.name] = &v;
  const std::optional<double> first = FirstTime(scene);
  std::vector<RenderView> views;
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const MatrixKey& key = path.keys[i];
    RenderView v;
    v.P = key.P;
    v.P.row(0) *= static_cast<double>(width_px) / path.width_px;
    v.P.row(1) *= static_cast<double>(height_px) / path.height_px;
    v.size_px = {width_px, height_px};
    if (first) v.time_s = *first + (key.time_s - path.keys.front().time_s);
    if (!key.view.empty()) {
      const auto found = called.find(key.view);
      if (found == called.end())
        throw DataError(fmt::format("key {} of the path is of the photo {}, which the scene has not", i, key.view), "take the scene that the path was made for", scene.folder);
      v.time_s = found->second->time_s;
      v.gain = found->second->gain;
    }
    if (scene.frame == Frame::kMetric) {
      const Eigen::Vector4d c = CentreOfProjection(v.P);
      if (!(std::abs(c.w()) > 1e-12)) throw DataError(fmt::format("the centre of projection of key {} lies at infinity", i), "", scene.folder);
      v.centre = c.head<3>() / c.w();
    }
    views.push_back(v);
  }
  return views;
}

}  // namespace lumi
