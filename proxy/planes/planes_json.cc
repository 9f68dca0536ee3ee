#include "proxy/planes/planes_json.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/files/json_limits.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kFlat = 0.02;  // of a quad's diagonal: how far its corners may lie off one plane

using nlohmann::json;

std::vector<Eigen::Vector3d> CornersOf(const json& list, const std::string& where) {
  if (!list.is_array()) throw std::invalid_argument(where + " is no list of points");
  std::vector<Eigen::Vector3d> points;
  for (const json& p : list) {
    if (!p.is_array() || p.size() != 3)
      throw std::invalid_argument(fmt::format("{}, point {}: three coordinates are wanted", where, points.size()));
    Eigen::Vector3d x;
    for (int k = 0; k < 3; ++k) {
      if (!p[static_cast<std::size_t>(k)].is_number())
        throw std::invalid_argument(fmt::format("{}, point {}: is no number", where, points.size()));
      x[k] = p[static_cast<std::size_t>(k)].get<double>();
    }
    if (!x.allFinite()) throw std::invalid_argument(fmt::format("{}, point {}: is not finite", where, points.size()));
    points.push_back(x);
  }
  return points;
}

FittedPlane ThroughPoints(const std::vector<Eigen::Vector3d>& points, const std::string& where) {
  if (points.size() < 3) throw std::invalid_argument(where + ": a plane needs three points");
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : points) mean += x / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : points) scatter += (x - mean) * (x - mean).transpose();
  const SymmetricEigen eigen = EigenOfSymmetric(scatter);
  if (!(eigen.values[1] > 1e-12 * eigen.values[2])) throw std::invalid_argument(where + ": the points lie in a line");
  FittedPlane plane;
  plane.normal = eigen.vectors.col(0);
  plane.offset = plane.normal.dot(mean);
  return plane;
}

void AddQuad(const std::vector<Eigen::Vector3d>& c, const std::string& where, Mesh& quads) {
  if (c.size() != 4)
    throw std::invalid_argument(fmt::format("{}: four corners are wanted, there are {}", where, c.size()));
  const Eigen::Vector3d normal = (c[2] - c[0]).cross(c[3] - c[1]);
  const double diagonal = std::max((c[2] - c[0]).norm(), (c[3] - c[1]).norm());
  for (std::size_t k = 0; k < 4; ++k)
    if (!((c[(k + 1) % 4] - c[k]).cross(c[(k + 2) % 4] - c[(k + 1) % 4]).dot(normal) > 0))
      throw std::invalid_argument(where + ": its corners do not go around a convex quad");
  if (!(std::abs(normal.normalized().dot(c[1] - c[0])) <= kFlat * diagonal))
    throw std::invalid_argument(where + ": its corners do not lie in one plane");
  const auto first = static_cast<std::int32_t>(quads.vertices.size());
  quads.vertices.insert(quads.vertices.end(), c.begin(), c.end());
  quads.faces.push_back({first, first + 1, first + 2});
  quads.faces.push_back({first, first + 2, first + 3});
}

}  // namespace

GivenPlanes ReadPlanesJson(const std::filesystem::path& file) {
  const json root = json::parse(ReadJsonText(file), nullptr, false);
  if (root.is_discarded() || !root.is_object())
    throw InputError(file, "is no JSON object with \"quads\" or \"planes\"");
  GivenPlanes given;
  try {
    const json quads = root.value("quads", json::array()), planes = root.value("planes", json::array());
    if (!quads.is_array() || !planes.is_array()) throw std::invalid_argument("\"quads\" and \"planes\" are lists");
    for (std::size_t i = 0; i < quads.size(); ++i) {
      const std::string where = fmt::format("quad {}", i);
      AddQuad(CornersOf(quads[i], where), where, given.quads);
    }
    for (std::size_t i = 0; i < planes.size(); ++i) {
      const std::string where = fmt::format("plane {}", i);
      const json& p = planes[i];
      if (p.is_object() && p.contains("points")) {
        given.planes.push_back(ThroughPoints(CornersOf(p["points"], where), where));
      } else if (p.is_object() && p.contains("normal") && p.value("offset", json()).is_number()) {
        FittedPlane plane;
        plane.normal = CornersOf(json::array({p["normal"]}), where).front();
        const double n = plane.normal.stableNorm();
        if (!(n > 0)) throw std::invalid_argument(where + ": its normal has no length");
        plane.normal /= n;
        plane.offset = p["offset"].get<double>() / n;
        given.planes.push_back(plane);
      } else {
        throw std::invalid_argument(where + ": \"points\", or \"normal\" and \"offset\", are wanted");
      }
      if (!given.planes.back().normal.allFinite() || !std::isfinite(given.planes.back().offset))
        throw std::invalid_argument(where + ": its numbers are too large");
    }
  } catch (const std::invalid_argument& wrong) {
    throw InputError(file, wrong.what());
  }
  if (given.planes.empty() && given.quads.faces.empty()) throw InputError(file, "holds neither quads nor planes");
  return given;
}

}  // namespace lumi
