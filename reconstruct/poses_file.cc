#include "reconstruct/poses_file.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/transforms_json.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/error.h"
#include "scene/program/printable.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Rotations written with four digits and more; beyond it is no rotation (or it is scaled: then it is a projection).
constexpr double kRotationTolerance = 5e-3;
// Skew as a shear of the picture (s / fy): beyond this it is no camera, but a matrix that was read wrongly.
constexpr double kMaxShear = 0.3;

std::optional<double> Number(const std::string& token) {
  const char* begin = token.c_str();
  char* end = nullptr;
  const double value = std::strtod(begin, &end);
  if (end == begin || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<Rigid3> PoseOf(const Eigen::Matrix<double, 3, 4>& m) {
  const Eigen::Matrix3d R = m.leftCols<3>();
  if (!((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRotationTolerance) ||
      !(R.determinant() > 0))
    return std::nullopt;
  return Rigid3{Eigen::Quaterniond(NearestRotation(R)).normalized(), m.col(3)};
}

struct Line {
  int number = 0;
  std::string name;
  std::vector<double> values;
};

std::vector<Line> ReadLines(const fs::path& path) {
  std::istringstream text(ReadText(path));
  std::vector<Line> lines;
  std::string raw;
  for (int number = 1; std::getline(text, raw); ++number) {
    if (const auto comment = raw.find('#'); comment != std::string::npos) raw.resize(comment);
    for (char& c : raw)
      if (c == ',' || c == ';' || c == '\r' || c == '\t') c = ' ';
    std::istringstream tokens(raw);
    Line line{number, {}, {}};
    std::string token;
    bool first = true;
    while (tokens >> token) {
      if (const auto value = Number(token))
        line.values.push_back(*value);
      else if (first)
        line.name = token;
      else
        throw InputError(path, fmt::format("line {}: '{}' is no number", number, Printable(token.substr(0, 40))));
      first = false;
    }
    if (!line.values.empty() || !line.name.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<PosedCamera> ReadMiddlebury(const fs::path& path, const std::vector<Line>& lines) {
  const double count = lines.front().values.front();
  if (count != static_cast<double>(lines.size() - 1))
    throw InputError(path, fmt::format("announces {} cameras, but {} lines follow", count, lines.size() - 1));
  std::vector<PosedCamera> cameras;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const Line& line = lines[i];
    if (line.values.size() != 21 || line.name.empty())
      throw InputError(path, fmt::format("line {}: a name and 21 numbers (K, R, t) are expected, {} numbers are there",
                                         line.number, line.values.size()));
    PosedCamera camera;
    camera.name = line.name;
    camera.K = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(line.values.data());
    Eigen::Matrix<double, 3, 4> m;
    m.leftCols<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(line.values.data() + 9);
    m.col(3) = Eigen::Map<const Eigen::Vector3d>(line.values.data() + 18);
    const auto pose = PoseOf(m);
    if (!pose) throw InputError(path, fmt::format("line {}: R is no rotation", line.number));
    camera.cam_from_world = *pose;
    cameras.push_back(camera);
  }
  return cameras;
}

std::vector<PosedCamera> ReadTwelves(const fs::path& path, const std::vector<Line>& lines, PosesFormat format) {
  std::vector<PosedCamera> cameras;
  for (const Line& line : lines) {
    // A 4x4 matrix is a 3x4 one with 0 0 0 1 below.
    const bool four_rows = line.values.size() == 16 && line.values[12] == 0 && line.values[13] == 0 &&
                           line.values[14] == 0 && line.values[15] == 1;
    if (line.values.size() != 12 && !four_rows)
      throw InputError(path,
                       fmt::format("line {}: twelve numbers (a 3x4 matrix, row by row) are expected, {} are there",
                                   line.number, line.values.size()),
                       "known formats: COLMAP model, transforms.json, Middlebury *_par.txt, twelve numbers a line");
    if (!cameras.empty() && cameras.front().name.empty() != line.name.empty())
      throw InputError(path, fmt::format("line {}: some lines have a name, some have none", line.number));
    const Matrix34d m = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(line.values.data());
    PosedCamera camera;
    camera.name = line.name;
    const auto pose = PoseOf(m);
    if (format == PosesFormat::kUnset && pose)
      throw UsageError(fmt::format("{}: twelve numbers a line can be a camera's pose or its inverse", path.string()),
                       "say which: --poses-format cam_from_world or world_from_cam");
    if (format == PosesFormat::kProjection || format == PosesFormat::kUnset) {
      const auto decomposed = DecomposeProjection(m);
      if (!decomposed) throw InputError(path, fmt::format("line {}: the projection matrix is singular", line.number));
      camera.K = decomposed->K;
      camera.cam_from_world = decomposed->cam_from_world;
    } else {
      if (!pose)
        throw InputError(path, fmt::format("line {}: its left 3x3 block is no rotation", line.number),
                         "is it --poses-format projection?");
      camera.cam_from_world = format == PosesFormat::kWorldFromCam ? pose->Inverse() : *pose;
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

std::vector<PosedCamera> FromScene(const Scene& scene) {
  std::vector<PosedCamera> cameras;
  for (const View& view : scene.views)
    cameras.push_back({view.name, scene.CameraOf(view), std::nullopt, view.cam_from_world});
  return cameras;
}

}  // namespace

std::optional<DecomposedProjection> DecomposeProjection(const Matrix34d& P_any) {
  Eigen::Matrix3d M = P_any.leftCols<3>();
  Matrix34d P = P_any;
  const double det = M.determinant(), size = M.cwiseAbs().maxCoeff();
  // K R of a real camera has a condition of about its focal length in pixels; far beyond it is singular to rounding.
  if (!std::isfinite(det) || !(size > 0)) return std::nullopt;
  const Eigen::VectorXd singular = SingularValues(M);
  if (!(singular[2] > 1e-12 * singular[0])) return std::nullopt;
  if (det < 0) P = -P;
  M = P.leftCols<3>();
  // RQ through QR of the matrix read from its lower right corner.
  Eigen::Matrix3d exchange = Eigen::Matrix3d::Zero();
  exchange(0, 2) = exchange(1, 1) = exchange(2, 0) = 1;
  const Eigen::Matrix3d turned = (exchange * M).transpose(), Q = OrthonormalColumns(turned);
  const Eigen::Matrix3d U = Eigen::Matrix3d(Q.transpose() * turned).triangularView<Eigen::Upper>();
  Eigen::Matrix3d K = exchange * U.transpose() * exchange;
  Eigen::Matrix3d R = exchange * Q.transpose();
  const Eigen::Vector3d signs = K.diagonal().unaryExpr([](double v) { return v < 0 ? -1.0 : 1.0; });
  K = K * signs.asDiagonal();
  R = signs.asDiagonal() * R;
  const Eigen::Vector3d t = K.triangularView<Eigen::Upper>().solve(Eigen::Vector3d(P.col(3)));
  return DecomposedProjection{K / K(2, 2), {Eigen::Quaterniond(R).normalized(), t}};
}

std::vector<PosedCamera> ReadPosesFile(const fs::path& path, PosesFormat format) {
  std::error_code ec;
  std::vector<PosedCamera> cameras;
  if (fs::is_directory(path, ec)) {
    const auto model = FindColmapModel(path);
    if (!model)
      throw InputError(path, "no COLMAP model in it",
                       "cameras.txt and images.txt (or .bin) are looked for there and in sparse/");
    cameras = FromScene(ReadColmapModel(*model));
  } else if (path.extension() == ".json") {
    cameras = FromScene(ReadTransformsJson(path));
  } else {
    const std::vector<Line> lines = ReadLines(path);
    if (lines.empty()) throw InputError(path, "no camera in it");
    const Line& first = lines.front();
    cameras =
        first.name.empty() && first.values.size() == 1 ? ReadMiddlebury(path, lines) : ReadTwelves(path, lines, format);
  }
  if (cameras.empty()) throw InputError(path, "no camera in it");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::string which = cameras[i].name.empty() ? fmt::format("camera {}", i) : Printable(cameras[i].name);
    const Rigid3& pose = cameras[i].cam_from_world;
    if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite() ||
        (cameras[i].K && !cameras[i].K->allFinite()))
      throw InputError(path, fmt::format("{}: its numbers are too large or too small to be a camera's", which));
    if (!cameras[i].K) continue;
    const Eigen::Matrix3d& K = *cameras[i].K;
    if (!(K(0, 0) > 0 && K(1, 1) > 0))
      throw InputError(path, fmt::format("{}: focal lengths {} and {} are not positive", which, K(0, 0), K(1, 1)));
    if (!(std::abs(K(0, 1)) < kMaxShear * K(1, 1)))
      throw InputError(
          path,
          fmt::format("{}: a skew of {:.3g} px beside focal lengths of {:.5g} and {:.5g} px is no camera's", which,
                      K(0, 1), K(0, 0), K(1, 1)),
          "are the numbers a projection matrix, row by row?");
  }
  return cameras;
}

}  // namespace lumi
