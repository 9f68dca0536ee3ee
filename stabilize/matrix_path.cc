#include "stabilize/matrix_path.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kFormat = "lumigraph-path";
constexpr int kVersion = 1;

}  // namespace

std::string MatrixPathJson(const MatrixPath& path) {
  nlohmann::ordered_json j;
  j["format"] = kFormat;
  j["version"] = kVersion;
  j["fps"] = path.fps;
  j["width"] = path.size_px.x();
  j["height"] = path.size_px.y();
  j["model"] = path.model;
  j["view_scale"] = path.view_scale;
  j["cropped"] = path.cropped;
  j["keys"] = nlohmann::ordered_json::array();
  for (const MatrixKey& key : path.keys) {
    nlohmann::ordered_json k;
    k["time_s"] = key.time_s;
    k["view"] = key.view;
    k["P"] = nlohmann::ordered_json::array();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) k["P"].push_back(key.P(r, c));
    if (!key.anchors.empty()) {
      k["anchors_px"] = nlohmann::ordered_json::array();
      for (const Anchor& a : key.anchors) k["anchors_px"].push_back({a.from_px.x(), a.from_px.y(), a.to_px.x(), a.to_px.y()});
    }
    j["keys"].push_back(std::move(k));
  }
  return j.dump() + "\n";
}

MatrixPath ReadMatrixPath(const std::filesystem::path& file) {
  const auto j = nlohmann::json::parse(ReadText(file), nullptr, false);
  if (!j.is_object() || j.value("format", "") != kFormat) throw InputError(file, "is no path of matrices", "lumi-stabilize SCENE -o PATH.json makes one");
  try {
    if (j.at("version").get<int>() > kVersion) throw InputError(file, "is of a newer version of the format");
    MatrixPath path;
    path.fps = j.at("fps");
    path.size_px = {j.at("width").get<int>(), j.at("height").get<int>()};
    path.model = j.value("model", "");
    path.view_scale = j.value("view_scale", 1.0);
    path.cropped = j.value("cropped", false);
    if (!(path.fps > 0) || path.size_px.minCoeff() < 1) throw InputError(file, "fps, width and height are positive");
    for (const auto& k : j.at("keys")) {
      MatrixKey key;
      key.time_s = k.at("time_s");
      key.view = k.value("view", "");
      const auto& P = k.at("P");
      if (P.size() != 12) throw InputError(file, fmt::format("key {}: P has 12 numbers", path.keys.size()));
      for (int i = 0; i < 12; ++i) key.P(i / 4, i % 4) = P[static_cast<std::size_t>(i)].get<double>();
      if (!key.P.allFinite() || key.P.isZero()) throw InputError(file, fmt::format("key {}: P is no projection matrix", path.keys.size()));
      if (k.contains("anchors_px"))
        for (const auto& a : k.at("anchors_px")) {
          if (a.size() != 4) throw InputError(file, fmt::format("key {}: an anchor has 4 numbers", path.keys.size()));
          key.anchors.push_back({{a[0].get<double>(), a[1].get<double>()}, {a[2].get<double>(), a[3].get<double>()}});
        }
      path.keys.push_back(std::move(key));
    }
    return path;
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, std::string("a value is absent or of another kind: ") + e.what());
  }
}

}  // namespace lumi
