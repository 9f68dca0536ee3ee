#include "scene/files/camera_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/files/opencv_pixels.h"
#include "scene/files/text_scan.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using text_scan::NextLine;
using text_scan::ToNumber;
using text_scan::Trim;

constexpr std::size_t kMaxYamlBytes = 1 << 24;
constexpr std::size_t kMaxMatrixValues = 4096;

// As much YAML as cameras are written in: "key: value" at the left margin, and below a key an indented block with
// "data: [numbers]" that may run over several lines. Everything else is passed over.
struct Document {
  std::map<std::string, std::string> scalars;
  std::map<std::string, std::vector<double>> matrices;
};

std::string_view WithoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i)
    if (line[i] == '#' && (i == 0 || text_scan::IsBlank(line[i - 1]))) return line.substr(0, i);
  return line;
}

std::string_view Unquoted(std::string_view s) {
  if (s.size() >= 2 && (s.front() == '"' || s.front() == '\'') && s.back() == s.front()) return s.substr(1, s.size() - 2);
  return s;
}

Document Parse(const fs::path& file, std::string_view text) {
  Document document;
  std::string key;  // the last one at the margin
  std::string_view line;
  for (std::size_t number = 1; NextLine(text, line); ++number) {
    const auto fail = [&](const std::string& what) { return InputError(file, fmt::format("line {}: {}", number, what)); };
    line = WithoutComment(line);
    const std::string_view content = Trim(line);
    if (content.empty() || content.starts_with("%") || content.starts_with("---") || content.starts_with("...")) continue;
    const std::size_t colon = content.find(':');
    if (colon == std::string_view::npos) continue;
    const bool at_margin = !text_scan::IsBlank(line.front());
    const std::string name(Unquoted(Trim(content.substr(0, colon))));
    std::string_view value = Trim(content.substr(colon + 1));
    if (at_margin) key = name;
    if (!value.starts_with('[')) {
      if (at_margin && !value.empty() && !value.starts_with('!'))
        if (!document.scalars.emplace(name, Unquoted(value)).second) throw fail(fmt::format("{} comes twice", name));
      continue;
    }
    if (!at_margin && name != "data") continue;
    if (document.matrices.contains(key)) throw fail(fmt::format("{} comes twice", key));
    std::vector<double>& values = document.matrices[key];
    value.remove_prefix(1);
    for (bool closed = false; !closed;) {
      const std::size_t end = value.find(']');
      closed = end != std::string_view::npos;
      std::string_view rest = value.substr(0, end);
      while (!(rest = Trim(rest)).empty()) {
        const std::size_t comma = rest.find(',');
        const std::string_view word = Trim(rest.substr(0, comma));
        // OpenCV writes ".Nan" and ".Inf"; those are refused below like any word.
        const auto x = ToNumber<double>(word);
        if (!x || !std::isfinite(*x)) throw fail(fmt::format("{}: \"{}\" is no number", key, word.substr(0, 40)));
        if (values.size() == kMaxMatrixValues) values.clear(), values.push_back(NAN);  // no matrix of a camera: its size will not fit
        values.push_back(*x);
        rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
      }
      if (closed) break;
      if (!NextLine(text, line)) throw fail(fmt::format("{}: the brackets do not close", key));
      ++number;
      value = WithoutComment(line);
    }
  }
  return document;
}

// Plain YAML for ROS; its first line and the "dt" of each matrix are what OpenCV's FileStorage needs to read it. K: row by row, OpenCV's pixels.
void WriteYaml(const fs::path& path, int width_px, int height_px, const std::vector<double>& K, const char* model, const std::vector<double>& distortion) {
  const auto matrix = [](const char* name, int rows, int cols, const std::vector<double>& data) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  dt: d\n  data: [{}]\n", name, rows, cols, fmt::join(data, ", "));
  };
  WriteTextAtomically(path, fmt::format("%YAML 1.1\n---\nimage_width: {}\nimage_height: {}\ncamera_name: camera\n", width_px, height_px) +
                                matrix("camera_matrix", 3, 3, K) + fmt::format("distortion_model: {}\n", model) +
                                matrix("distortion_coefficients", 1, static_cast<int>(distortion.size()), distortion) +
                                matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1}) +
                                matrix("projection_matrix", 3, 4, {K[0], K[1], K[2], 0, K[3], K[4], K[5], 0, K[6], K[7], K[8], 0}));
}

}  // namespace

CameraYaml ReadWholeCameraYaml(const fs::path& path) {
  const Document document = Parse(path, ReadText(path, kMaxYamlBytes));
  const auto size = [&](const char* name) {
    const auto it = document.scalars.find(name);
    const auto value = it == document.scalars.end() ? std::nullopt : ToNumber<int>(it->second);
    if (!value || *value <= 0) throw InputError(path, fmt::format("{} is missing or no size", name));
    return *value;
  };
  const auto matrix = [&](const char* name) -> std::vector<double> {
    const auto it = document.matrices.find(name);
    return it == document.matrices.end() ? std::vector<double>{} : it->second;
  };
  const int width = size("image_width"), height = size("image_height");
  const std::vector<double> K = matrix("camera_matrix");
  if (K.size() != 9) throw InputError(path, "camera_matrix is missing or does not have 9 numbers");
  if (K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1) throw InputError(path, "camera_matrix is no upper triangular matrix with 1 at its end");
  std::vector<double> d = matrix("distortion_coefficients");
  if (d.empty()) d = matrix("dist_coeffs");
  const auto it = document.scalars.find("distortion_model");
  const std::string model = it == document.scalars.end() ? "plumb_bob" : it->second;
  const Eigen::Vector2d c = FromOpenCvPixel({K[2], K[5]});
  CameraYaml yaml;
  yaml.says_distortion = !d.empty();
  PlumbBobCamera& camera = yaml.plumb_bob = {width, height, K[0], K[4], c.x(), c.y(), K[1]};
  if (const auto wrong = Validate(camera)) throw InputError(path, *wrong);
  if (model == "fisheye" || model == "equidistant") {
    if (d.size() != 4) throw InputError(path, fmt::format("a fisheye camera has 4 distortion coefficients, not {}", d.size()));
    if (camera.skew != 0) throw InputError(path, fmt::format("a fisheye camera with skew ({} px) is not read", camera.skew), "calibrate without skew");
    yaml.fisheye = Camera{CameraModel::kOpenCVFisheye, width, height, {K[0], K[4], c.x(), c.y(), d[0], d[1], d[2], d[3]}};
  } else if (model == "plumb_bob" || model == "rational_polynomial") {
    constexpr std::size_t kFewest = 4, kMost = 14;  // OpenCV's: 4, 5, 8, 12 or 14
    if (!d.empty() && (d.size() < kFewest || d.size() > kMost))
      throw InputError(path, fmt::format("{} distortion coefficients, where there are 4 (k1, k2, p1, p2), 5 (k3) or none", d.size()));
    d.resize(kMost, 0.0);
    camera.k1 = d[0], camera.k2 = d[1], camera.p1 = d[2], camera.p2 = d[3], camera.k3 = d[4];
    for (std::size_t i = 5; i < d.size(); ++i)
      if (d[i] != 0) throw InputError(path, fmt::format("distortion coefficient {} is {}, and those beyond k3 are not read", i + 1, d[i]), "calibrate without it");
  } else {
    throw InputError(path, fmt::format("distortion_model \"{}\" is not read (plumb_bob and fisheye are)", model.substr(0, 40)));
  }
  return yaml;
}

Camera ReadCameraYaml(const fs::path& path) {
  const CameraYaml yaml = ReadWholeCameraYaml(path);
  if (yaml.fisheye) return *yaml.fisheye;
  const PlumbBobCamera& c = yaml.plumb_bob;
  const char* way_out = "undistort the photos first (lumi-calibrate --undistort)";
  if (c.skew != 0) throw InputError(path, fmt::format("the camera has skew ({} px), which COLMAP's models cannot hold", c.skew), way_out);
  if (c.k3 != 0) throw InputError(path, fmt::format("the camera has a k3 ({}), and COLMAP's models end at k2, p1, p2", c.k3), way_out);
  Camera camera = Camera::Pinhole(c.width_px, c.height_px, c.fx, c.fy, c.cx, c.cy);
  if (c.k1 != 0 || c.k2 != 0 || c.p1 != 0 || c.p2 != 0) {
    camera.model = CameraModel::kOpenCV;
    camera.params.insert(camera.params.end(), {c.k1, c.k2, c.p1, c.p2});
  }
  return camera;
}

void WriteCameraYaml(const Camera& camera, const fs::path& path) {
  if (const auto wrong = Validate(camera)) throw std::invalid_argument("WriteCameraYaml: " + *wrong);
  const bool fisheye = camera.model == CameraModel::kOpenCVFisheye;
  const auto& p = camera.params;
  std::vector<double> d;
  switch (camera.model) {
    case CameraModel::kSimplePinhole:
    case CameraModel::kPinhole: d = {0, 0, 0, 0, 0}; break;
    case CameraModel::kSimpleRadial: d = {p[3], 0, 0, 0, 0}; break;
    case CameraModel::kRadial: d = {p[3], p[4], 0, 0, 0}; break;
    case CameraModel::kOpenCV: d = {p[4], p[5], p[6], p[7], 0}; break;
    case CameraModel::kOpenCVFisheye: d = {p[4], p[5], p[6], p[7]}; break;
  }
  const Eigen::Vector2d f = camera.FocalPx(), c = ToOpenCvPixel(camera.PrincipalPointPx());
  WriteYaml(path, camera.width_px, camera.height_px, {f.x(), 0, c.x(), 0, f.y(), c.y(), 0, 0, 1}, fisheye ? "fisheye" : "plumb_bob", d);
}

void WriteCameraYaml(const PlumbBobCamera& camera, const fs::path& path) {
  const Eigen::Vector2d c = ToOpenCvPixel({camera.cx, camera.cy});
  WriteYaml(path, camera.width_px, camera.height_px, {camera.fx, camera.skew, c.x(), 0, camera.fy, c.y(), 0, 0, 1}, "plumb_bob",
            {camera.k1, camera.k2, camera.p1, camera.p2, camera.k3});
}

}  // namespace lumi
