#include "scene/files/camera_yaml.h"

#include <fmt/format.h>

#include <algorithm>
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

// The part of YAML that camera files use: "key: value" at the left margin, and below a key an indented block with
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
  if (s.size() >= 2 && (s.front() == '"' || s.front() == '\'') && s.back() == s.front())
    return s.substr(1, s.size() - 2);
  return s;
}

Document Parse(const fs::path& file, std::string_view text) {
  Document document;
  std::string key;  // the last one at the margin
  std::string_view line;
  for (std::size_t number = 1; NextLine(text, line); ++number) {
    const auto fail = [&](const std::string& what) {
      return InputError(file, fmt::format("line {}: {}", number, what));
    };
    line = WithoutComment(line);
    const std::string_view content = Trim(line);
    if (content.empty() || content.starts_with("%") || content.starts_with("---") || content.starts_with("..."))
      continue;
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
        if (values.size() == kMaxMatrixValues)
          values.clear(), values.push_back(NAN);  // no matrix of a camera: its size will not fit
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
  if (K[3] != 0 || K[6] != 0 || K[7] != 0 || K[8] != 1)
    throw InputError(path, "camera_matrix is no upper triangular matrix with 1 at its end");
  std::vector<double> d = matrix("distortion_coefficients");
  if (d.empty()) d = matrix("dist_coeffs");
  const auto it = document.scalars.find("distortion_model");
  const std::string model = it == document.scalars.end() ? "plumb_bob" : it->second;
  const Eigen::Vector2d c = FromOpenCvPixel({K[2], K[5]});
  CameraYaml yaml;
  yaml.says_distortion = !d.empty();
  Camera& camera =
      yaml.camera = {CameraModel::kPlumbBob, width, height, {K[0], K[4], c.x(), c.y(), K[1], 0, 0, 0, 0, 0}};
  if (const auto wrong = Validate(camera)) throw InputError(path, *wrong);
  if (model == "fisheye" || model == "equidistant") {
    if (d.size() != 4)
      throw InputError(path, fmt::format("a fisheye camera has 4 distortion coefficients, not {}", d.size()));
    if (K[1] != 0)
      throw InputError(path, fmt::format("a fisheye camera with skew ({} px) is not read", K[1]),
                       "calibrate without skew");
    camera = {CameraModel::kOpenCVFisheye, width, height, {K[0], K[4], c.x(), c.y(), d[0], d[1], d[2], d[3]}};
  } else if (model == "plumb_bob" || model == "rational_polynomial") {
    constexpr std::size_t kFewest = 4, kMost = 14;  // OpenCV's: 4, 5, 8, 12 or 14
    if (!d.empty() && (d.size() < kFewest || d.size() > kMost))
      throw InputError(
          path,
          fmt::format("{} distortion coefficients, where there are 4 (k1, k2, p1, p2), 5 (k3) or none", d.size()));
    d.resize(kMost, 0.0);
    std::copy(d.begin(), d.begin() + 5, camera.params.end() - 5);
    for (std::size_t i = 5; i < d.size(); ++i)
      if (d[i] != 0)
        throw InputError(path,
                         fmt::format("distortion coefficient {} is {}, and those beyond k3 are not read", i + 1, d[i]),
                         "calibrate without it");
  } else {
    throw InputError(
        path, fmt::format("distortion_model \"{}\" is not read (plumb_bob and fisheye are)", model.substr(0, 40)));
  }
  return yaml;
}

Camera ReadCameraYaml(const fs::path& path) {
  const Camera c = ReadWholeCameraYaml(path).camera;
  if (c.model == CameraModel::kOpenCVFisheye) return c;
  const char* way_out = "undistort the photos first (lumi-calibrate --undistort)";
  const double skew = c.Get(CameraTerm::kSkew), k3 = c.Get(CameraTerm::kK3);
  if (skew != 0)
    throw InputError(path, fmt::format("the camera has skew ({} px), which COLMAP's models cannot hold", skew),
                     way_out);
  if (k3 != 0)
    throw InputError(path, fmt::format("the camera has a k3 ({}), and COLMAP's models end at k2, p1, p2", k3), way_out);
  const CameraModel model = c.IsPinhole() ? CameraModel::kPinhole : CameraModel::kOpenCV;
  Camera camera{model, c.width_px, c.height_px, {}};
  for (int i = 0; i < ParameterCount(model); ++i)
    camera.params.push_back(c.Get(InfoOf(model).terms[static_cast<std::size_t>(i)]));
  return camera;
}

void WriteCameraYaml(const Camera& camera, const fs::path& path) {
  if (const auto wrong = Validate(camera)) throw std::invalid_argument("WriteCameraYaml: " + *wrong);
  using enum CameraTerm;
  const bool fisheye = camera.model == CameraModel::kOpenCVFisheye;
  std::vector<double> distortion;
  for (const CameraTerm term :
       fisheye ? std::vector{kTheta1, kTheta2, kTheta3, kTheta4} : std::vector{kK1, kK2, kP1, kP2, kK3})
    distortion.push_back(camera.Get(term));
  const auto matrix = [](const char* name, int rows, int cols, const std::vector<double>& data) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  dt: d\n  data: [{}]\n", name, rows, cols, fmt::join(data, ", "));
  };
  // Plain YAML for ROS; its first line and the "dt" of each matrix are what OpenCV's FileStorage needs to read it.
  const Eigen::Vector2d f = camera.FocalPx(), c = ToOpenCvPixel(camera.PrincipalPointPx());
  const double skew = camera.Get(kSkew);
  WriteTextAtomically(
      path, fmt::format("%YAML 1.1\n---\nimage_width: {}\nimage_height: {}\ncamera_name: camera\n", camera.width_px,
                        camera.height_px) +
                matrix("camera_matrix", 3, 3, {f.x(), skew, c.x(), 0, f.y(), c.y(), 0, 0, 1}) +
                fmt::format("distortion_model: {}\n", fisheye ? "fisheye" : "plumb_bob") +
                matrix("distortion_coefficients", 1, static_cast<int>(distortion.size()), distortion) +
                matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1}) +
                matrix("projection_matrix", 3, 4, {f.x(), skew, c.x(), 0, 0, f.y(), c.y(), 0, 0, 0, 1, 0}));
}

}  // namespace lumi
