#include "proxy/import/placement.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

// "x", "-y" ... as a direction.
std::optional<Eigen::Vector3d> AxisFromText(std::string_view text) {
  double sign = 1;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    sign = text.front() == '-' ? -1 : 1;
    text.remove_prefix(1);
  }
  if (text.size() != 1 || text[0] < 'x' || text[0] > 'z') return std::nullopt;
  return Eigen::Vector3d(sign * Eigen::Vector3d::Unit(text[0] - 'x'));
}

std::vector<double> NumbersOf(std::string_view line, bool& all_numbers) {
  std::vector<double> numbers;
  const auto separates = [](char c) { return c == ',' || c == ';' || c == ' ' || c == '\t' || c == '\r'; };
  all_numbers = true;
  while (!line.empty()) {
    if (separates(line.front())) {
      line.remove_prefix(1);
      continue;
    }
    std::size_t n = 0;
    while (n < line.size() && !separates(line[n])) ++n;
    std::string_view word = line.substr(0, n);
    line.remove_prefix(n);
    if (word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    all_numbers = all_numbers && error == std::errc() && end == word.data() + word.size() && std::isfinite(value);
    numbers.push_back(value);
  }
  return numbers;
}

Eigen::Vector3d PointOf(const std::filesystem::path& file, const Json& pair, const char* key, std::size_t number) {
  const auto wrong = [&] { return InputError(file, fmt::format("pairs[{}].{} is not [x, y, z]", number, key)); };
  if (!pair.is_object() || !pair.contains(key)) throw wrong();
  const Json& v = pair[key];
  if (!v.is_array() || v.size() != 3 || !v[0].is_number() || !v[1].is_number() || !v[2].is_number()) throw wrong();
  return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()};
}

}  // namespace

double MetresIn(const std::string& unit) {
  static constexpr std::pair<const char*, double> kUnits[] = {
      {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"dm", 0.1}, {"m", 1}, {"km", 1e3}, {"in", 0.0254}, {"ft", 0.3048}};
  for (const auto& [name, metres] : kUnits)
    if (unit == name) return metres;
  throw UsageError("\"" + unit + "\" is no --unit", "um, mm, cm, dm, m, km, in or ft; --scale takes any factor");
}

Eigen::Matrix3d AxesFromText(const std::string& text, const Eigen::Vector3d& scene_up) {
  const auto wrong = [&] {
    return UsageError("\"" + text + "\" is no --axes",
                      "y-up, z-up, -y-up ..., or the scene's x,y,z in the mesh's axes: x,-z,y");
  };
  if (text.ends_with("-up")) {
    const auto up = AxisFromText(std::string_view(text).substr(0, text.size() - 3));
    if (!up) throw wrong();
    const Eigen::Vector3d to = scene_up.normalized();
    // For opposite directions, a half turn about any perpendicular axis is the shortest: it is made about x, as between
    // OpenGL's frames and those of computer vision.
    constexpr double kOpposite = -1 + 1e-12;
    if (up->dot(to) < kOpposite) {
      const Eigen::Vector3d axis = std::abs(up->x()) > 0.5 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
      return Eigen::AngleAxisd(3.14159265358979323846, axis).toRotationMatrix().array().round();
    }
    return Eigen::Quaterniond::FromTwoVectors(*up, to).toRotationMatrix();
  }
  Eigen::Matrix3d axes;
  std::string_view rest = text;
  for (int row = 0; row < 3; ++row) {
    const std::size_t comma = rest.find(',');
    if ((comma == std::string_view::npos) != (row == 2)) throw wrong();
    const auto axis = AxisFromText(rest.substr(0, comma));
    if (!axis) throw wrong();
    axes.row(row) = axis->transpose();
    if (row < 2) rest.remove_prefix(comma + 1);
  }
  if (std::abs(axes.determinant()) < 0.5) throw UsageError("--axes " + text + " names an axis twice");
  return axes;
}

std::vector<PointPair> ReadPointPairs(const std::filesystem::path& file) {
  const std::string text = ReadText(file);
  std::vector<PointPair> pairs;
  if (file.extension() == ".json") {
    if (const char* wrong = JsonBeyondLimits(text)) throw InputError(file, wrong);
    Json json;
    try {
      json = Json::parse(text);
    } catch (const Json::exception& e) {
      throw InputError(file, JsonProblem(e.what()));
    }
    if (!json.is_object() || !json.contains("pairs") || !json["pairs"].is_array())
      throw InputError(file, "has no list \"pairs\"", R"({"pairs": [{"mesh": [x, y, z], "scene": [x, y, z]}, ...]})");
    for (std::size_t i = 0; i < json["pairs"].size(); ++i)
      pairs.push_back({PointOf(file, json["pairs"][i], "mesh", i), PointOf(file, json["pairs"][i], "scene", i)});
    return pairs;
  }
  std::string_view rest = text;
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    bool numeric = true;
    const std::vector<double> v = NumbersOf(line, numeric);
    if (v.empty() || line.front() == '#' || std::isalpha(static_cast<unsigned char>(line.front())) != 0) continue;
    if (!numeric || v.size() != 6)
      throw InputError(file,
                       fmt::format("line {}: six numbers are wanted, the mesh's x, y, z and the scene's", number));
    pairs.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
  }
  return pairs;
}

PairAlignment AlignPairs(const std::vector<PointPair>& pairs) {
  if (pairs.size() < 3)
    throw DataError(fmt::format("{} pairs of points are given, a similarity needs three", pairs.size()),
                    "add pairs that are not in one line");
  std::vector<Eigen::Vector3d> mesh, scene;
  Eigen::AlignedBox3d box;
  for (const PointPair& p : pairs) {
    mesh.push_back(p.mesh);
    scene.push_back(p.scene);
    box.extend(p.scene);
  }
  PairAlignment a;
  a.scene_from_mesh = AlignPoints(mesh, scene);
  if (!(a.scene_from_mesh.scale > 0) || !std::isfinite(a.scene_from_mesh.scale))
    throw DataError("the pairs' points lie in one line or in one place: the turn about it is open",
                    "add a pair beside the line");
  double sum = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    a.distance.push_back((a.scene_from_mesh * mesh[i] - scene[i]).norm());
    sum += a.distance.back() * a.distance.back();
  }
  a.rms = std::sqrt(sum / static_cast<double>(pairs.size()));
  a.rms_of_extent = a.rms / box.diagonal().norm();
  return a;
}

}  // namespace lumi
