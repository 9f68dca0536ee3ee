#include "reconstruct/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kAssumedFocalFactor = 1.2;  // of the longer side, as COLMAP assumes where nothing is known
constexpr double kAgreePx = 2;
// Of the shifts, so many on each side may be wrong matches.
constexpr double kOutlierShare = 0.02;
// Photos that were rectified: depths are laid out so that the farthest point is so many times as far as the nearest.
constexpr double kDepthRatio = 4;

std::map<std::string, GridPosition> ReadPositions(const std::filesystem::path& path) {
  std::istringstream text(ReadText(path));
  std::map<std::string, GridPosition> positions;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    std::vector<std::string> fields;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) fields.push_back(cell);
    if (fields.size() < 5)
      throw InputError(path,
                       fmt::format("line {}: five columns are expected (file,row,column,vertical,horizontal)", number));
    try {
      std::size_t used_v = 0, used_h = 0;
      GridPosition p;
      p.vertical = std::stod(fields[3], &used_v);
      p.horizontal = std::stod(fields[4], &used_h);
      if (used_v != fields[3].size() || used_h != fields[4].size() || !std::isfinite(p.vertical) ||
          !std::isfinite(p.horizontal))
        throw std::invalid_argument(line);
      positions[fields[0]] = p;
    } catch (const std::logic_error&) {
      if (number > 1)
        throw InputError(path, fmt::format("line {}: the position is no number", number));  // line 1: the header
    }
  }
  return positions;
}

bool ReadNumber(const std::string& text, double* value) {
  char* end = nullptr;
  *value = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == 0 && std::isfinite(*value);
}

double Sorted(const std::vector<double>& values, double share) {
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace

Rigid3 GridPose(double horizontal, double vertical) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-horizontal, -vertical, 0)};
}

std::pair<int, int> ParseGridSize(const std::string& text) {
  int rows = 0, columns = 0;
  char cross = 0, rest = 0;
  std::istringstream in(text);
  if (!(in >> rows >> cross >> columns) || (cross != 'x' && cross != 'X') || (in >> rest) || rows < 1 || columns < 1 ||
      rows > 10000 || columns > 10000)
    throw UsageError(fmt::format("--grid-size {}: ROWSxCOLUMNS is expected, such as 17x17", text));
  return {rows, columns};
}

std::optional<GridPosition> PositionFromName(const std::string& name) {
  std::vector<std::string> fields;
  std::istringstream text(std::filesystem::path(name).stem().string());
  for (std::string field; std::getline(text, field, '_');)
    if (!field.empty()) fields.push_back(field);
  double row = 0, column = 0;
  GridPosition p;
  if (fields.size() < 5 || !ReadNumber(fields[fields.size() - 4], &row) ||
      !ReadNumber(fields[fields.size() - 3], &column) || row != std::floor(row) || column != std::floor(column) ||
      !ReadNumber(fields[fields.size() - 2], &p.vertical) || !ReadNumber(fields.back(), &p.horizontal))
    return std::nullopt;
  return p;
}

std::vector<GridPosition> GridPositions(const Capture& capture, const ReconstructOptions& options) {
  const int n = static_cast<int>(capture.photos.size());
  std::vector<GridPosition> positions(capture.photos.size());
  if (!options.grid_size.empty()) {
    const auto [rows, columns] = ParseGridSize(options.grid_size);
    if (rows * columns != n)
      throw DataError(fmt::format("--grid-size {} means {} photos, {} are here", options.grid_size, rows * columns, n),
                      "photos are taken row by row in the order of their names");
    for (int i = 0; i < n; ++i)
      positions[static_cast<std::size_t>(i)] = {static_cast<double>(i % columns), static_cast<double>(i / columns)};
  } else if (!options.grid_positions.empty()) {
    const auto known = ReadPositions(options.grid_positions);
    for (int i = 0; i < n; ++i) {
      const auto it = known.find(capture.photos[static_cast<std::size_t>(i)].name);
      if (it == known.end())
        throw DataError(fmt::format("no position for {}", capture.photos[static_cast<std::size_t>(i)].name),
                        "its name must stand in the first column", options.grid_positions);
      positions[static_cast<std::size_t>(i)] = it->second;
    }
  } else {
    for (int i = 0; i < n; ++i) {
      const auto named = PositionFromName(capture.photos[static_cast<std::size_t>(i)].name);
      if (!named)
        throw DataError(
            fmt::format("{} does not say where its camera stood (as NAME_ROW_COLUMN_VERTICAL_HORIZONTAL would)",
                        capture.photos[static_cast<std::size_t>(i)].name),
            "give --grid-size ROWSxCOLUMNS or --grid-positions FILE.csv");
      positions[static_cast<std::size_t>(i)] = *named;
    }
  }
  return positions;
}

GridFit FitGrid(const std::vector<GridPosition>& positions, const std::vector<RigMatch>& matches, double focal_px,
                std::optional<double> plane) {
  GridFit fit;
  // The sign of the vertical coordinate relative to the horizontal one: under the right sign a match moves along the
  // line between its cameras.
  std::vector<double> shifts;
  for (const double relative : {1.0, -1.0}) {
    std::vector<double> along;
    double agreement = 0;
    for (const RigMatch& m : matches) {
      const GridPosition &a = positions[static_cast<std::size_t>(m.a)], &b = positions[static_cast<std::size_t>(m.b)];
      const Eigen::Vector2d way(b.horizontal - a.horizontal, relative * (b.vertical - a.vertical));
      if (!(way.norm() > 0)) continue;
      const Eigen::Vector2d moved_px = m.x_a_px - m.x_b_px;
      const double shift = moved_px.dot(way) / way.squaredNorm(), off_px = (moved_px - shift * way).norm();
      agreement += 1 / (1 + (off_px / kAgreePx) * (off_px / kAgreePx));
      if (off_px < kAgreePx) along.push_back(shift);
    }
    if (relative > 0 || agreement > fit.agreement) {
      fit.agreement = agreement;
      fit.sign_v = relative;
      shifts = std::move(along);
    }
  }
  if (shifts.empty()) {
    if (!matches.empty())
      throw DataError("no match between neighbours of the grid moves as parallel cameras say",
                      "check the order of the photos, --grid-size or --grid-positions");
    if (plane && *plane > 0) fit.shear_px = focal_px / *plane;
    return fit;
  }
  fit.agreement /= static_cast<double>(matches.size());
  std::ranges::sort(shifts);
  const double low = Sorted(shifts, kOutlierShare), high = Sorted(shifts, 1 - kOutlierShare),
               middle = Sorted(shifts, 0.5);
  // Cameras that were not rectified see every point move against them.
  fit.signs_known = low >= 0 || high <= 0;
  if (fit.signs_known && middle < 0) {
    fit.sign_h = -fit.sign_h;
    fit.sign_v = -fit.sign_v;
  }
  if (plane)
    fit.shear_px = *plane > 0 ? focal_px / *plane : 0;
  else if (!fit.signs_known)
    fit.shear_px = (high - kDepthRatio * low) / (kDepthRatio - 1);
  return fit;
}

std::vector<HeldView> AssumeGrid(const Capture& capture, const ReconstructOptions& options,
                                 const std::vector<GridPosition>& positions, const std::filesystem::path& database,
                                 ProgressSink& sink) {
  double least_distance = 0;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const double d =
        std::hypot(positions[i].horizontal - positions[0].horizontal, positions[i].vertical - positions[0].vertical);
    if (d > 0 && (least_distance == 0 || d < least_distance)) least_distance = d;
  }
  constexpr std::size_t kPerPair = 40;
  constexpr double kReach = 3;  // times the least distance between cameras
  const auto matches = MatchesOfRig(capture, database, kPerPair, 0, [&](int a, int b) {
    const GridPosition &p = positions[static_cast<std::size_t>(a)], &q = positions[static_cast<std::size_t>(b)];
    return std::hypot(p.horizontal - q.horizontal, p.vertical - q.vertical) <= kReach * least_distance;
  });
  const auto camera_of = [&](const InputPhoto& photo) {
    if (const auto given = IntrinsicsFromOptions(options, photo.width_px, photo.height_px)) return *given;
    const double f = kAssumedFocalFactor * std::max(photo.width_px, photo.height_px);
    return Camera::Pinhole(photo.width_px, photo.height_px, f, f, photo.width_px / 2.0, photo.height_px / 2.0);
  };
  const Camera first = camera_of(capture.photos.front());
  if (!IntrinsicsFromOptions(options, first.width_px, first.height_px))
    sink.Message(fmt::format(
        "a grid of parallel cameras looks the same under any focal length: {:.0f} px is assumed (--focal-px)",
        first.FocalPx().x()));
  const GridFit fit = FitGrid(positions, matches, first.FocalPx().x(), options.grid_plane);
  std::vector<HeldView> views(capture.photos.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    HeldView& view = views[i];
    view.name = capture.photos[i].name;
    view.camera = camera_of(capture.photos[i]);
    const double h = fit.sign_h * positions[i].horizontal, v = fit.sign_v * positions[i].vertical;
    view.cam_from_world = GridPose(h, v);
    if (fit.shear_px == 0) continue;
    // Rectified photos coincide on a plane: each one's principal point is shifted by the plane's own parallax.
    const Eigen::Vector2d f = view.camera.FocalPx(), c = view.camera.PrincipalPointPx(),
                          scale = f / first.FocalPx().x();
    view.camera = Camera::Pinhole(view.camera.width_px, view.camera.height_px, f.x(), f.y(),
                                  c.x() + fit.shear_px * scale.x() * h, c.y() + fit.shear_px * scale.y() * v);
  }
  if (!matches.empty()) {
    sink.Message(fmt::format("grid: {} photos, {:.0f} % of the matches between neighbours agree", views.size(),
                             100 * fit.agreement));
    if (fit.shear_px > 0 && !options.grid_plane)
      sink.Message(
          fmt::format("the photos were rectified to coincide on a plane; its distance is put at {:.4g}, so that all "
                      "lies in front of the cameras (--grid-plane)",
                      first.FocalPx().x() / fit.shear_px));
  }
  return views;
}

}  // namespace lumi
