#include "scene/files/matrix_path.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kMatrixPathFormat = "lumigraph-path";
constexpr int kMatrixPathVersion = 1;
constexpr int kMostPx = 32768;

nlohmann::json ParsePath(const std::filesystem::path& file) {
  try {
    return nlohmann::json::parse(ReadJsonText(file));
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, "not a camera path: " + JsonProblem(e.what()));
  }
}

bool HasMatrices(const nlohmann::json& j) {
  if (!j.is_object() || !j.contains("keys") || !j["keys"].is_array() || j["keys"].empty()) return false;
  const auto& key = j["keys"].front();
  return key.is_object() && key.contains("P");
}

Matrix34d ReadMatrix(const nlohmann::json& k, const char* name, const std::string& where) {
  const auto numbers = JsonAt<std::array<double, 12>>(k, name, where);
  Matrix34d P;
  for (int i = 0; i < 12; ++i) P(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
  return P;
}

nlohmann::ordered_json RowByRow(const Matrix34d& P) {
  nlohmann::ordered_json numbers = nlohmann::ordered_json::array();
  for (int i = 0; i < 12; ++i) numbers.push_back(P(i / 4, i % 4));
  return numbers;
}

MatrixKey ReadKey(const nlohmann::json& k, const std::string& where) {
  MatrixKey key;
  key.time_s = JsonAt<double>(k, "time_s", where);
  key.P = ReadMatrix(k, "P", where);
  if (k.contains("filmed") && k.contains("steady"))
    key.filmed = ReadMatrix(k, "filmed", where), key.steady = ReadMatrix(k, "steady", where);
  key.view = JsonOr<std::string>(k, "view", "", where);
  key.view_scale = JsonOr(k, "view_scale", 1.0, where);
  if (k.contains("anchors_px"))
    for (const auto& a : k.at("anchors_px")) {
      const auto n = a.get<std::array<double, 4>>();
      key.anchors.push_back({{n[0], n[1]}, {n[2], n[3]}});
    }
  return key;
}

}  // namespace

bool IsMatrixPath(const std::filesystem::path& file) { return HasMatrices(ParsePath(file)); }

MatrixPath ReadMatrixPath(const std::filesystem::path& file) {
  const nlohmann::json j = ParsePath(file);
  MatrixPath path;
  try {
    if (!HasMatrices(j) || j.value("format", "") != kMatrixPathFormat)
      throw InputError(file, "not a path of matrices: \"format\": \"lumigraph-path\" with a P in each key");
    if (const int version = JsonAt<int>(j, "version"); version > kMatrixPathVersion)
      throw InputError(
          file, fmt::format("a camera path of version {}; this program reads up to {}", version, kMatrixPathVersion));
    path.fps = JsonOr(j, "fps", 30.0);
    path.width_px = JsonAt<int>(j, "width");
    path.height_px = JsonAt<int>(j, "height");
    path.model = JsonOr<std::string>(j, "model", "");
    path.view_scale = JsonOr(j, "view_scale", 1.0);
    path.cropped = JsonOr(j, "cropped", false);
    if (j.contains("object_px")) {
      const auto box = JsonAt<std::array<double, 4>>(j, "object_px");
      path.object_px.assign(box.begin(), box.end());
    }
    for (const auto& k : j["keys"]) path.keys.push_back(ReadKey(k, fmt::format("keys[{}].", path.keys.size())));
  } catch (const JsonFault& e) {
    throw InputError(file, std::string("not a path of matrices: ") + e.what());
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, "not a path of matrices: " + JsonProblem(e.what()));
  }
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const MatrixKey& key = path.keys[i];
    const double largest = key.P.cwiseAbs().maxCoeff();
    if (!key.P.allFinite() || !(largest > 0) || !(CentreOfProjection(key.P / largest).norm() > 0.5))
      throw InputError(file,
                       fmt::format("key {}: P is no projection matrix: twelve finite numbers of rank 3 are wanted", i));
    if (!std::isfinite(key.time_s) || (i > 0 && !(key.time_s > path.keys[i - 1].time_s)))
      throw InputError(file, fmt::format("key {}: times must ascend", i));
  }
  if (!(path.fps > 0 && path.fps <= 1000)) throw InputError(file, "fps must lie in (0, 1000]");
  if (path.width_px < 1 || path.height_px < 1 || path.width_px > kMostPx || path.height_px > kMostPx)
    throw InputError(file, fmt::format("width and height must lie in 1 to {}", kMostPx));
  return path;
}

void WriteMatrixPath(const std::filesystem::path& file, const MatrixPath& path) {
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  j["format"] = kMatrixPathFormat;
  j["version"] = kMatrixPathVersion;
  j["fps"] = path.fps;
  j["width"] = path.width_px;
  j["height"] = path.height_px;
  if (!path.model.empty()) {
    j["model"] = path.model;
    j["view_scale"] = path.view_scale;
    j["cropped"] = path.cropped;
    if (!path.object_px.empty()) j["object_px"] = path.object_px;
  }
  j["keys"] = nlohmann::ordered_json::array();
  for (const MatrixKey& key : path.keys) {
    nlohmann::ordered_json k = {{"time_s", key.time_s}, {"P", RowByRow(key.P)}};
    if (!key.view.empty()) k["view"] = key.view;
    if (!path.model.empty()) k["view_scale"] = key.view_scale;
    if (!key.anchors.empty()) {
      k["anchors_px"] = nlohmann::ordered_json::array();
      for (const Anchor& a : key.anchors)
        k["anchors_px"].push_back({a.from_px.x(), a.from_px.y(), a.to_px.x(), a.to_px.y()});
    }
    if (!key.filmed.isZero(0)) k["filmed"] = RowByRow(key.filmed), k["steady"] = RowByRow(key.steady);
    j["keys"].push_back(k);
  }
  WriteTextAtomically(file, j.dump() + "\n");
}

}  // namespace lumi
