#include "render/path/camera_path.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "render/path/nerfstudio_path.h"
#include "scene/files/atomic_file.h"
#include "scene/files/json_limits.h"
#include "scene/files/json_problem.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kFormat = "lumigraph-path";
constexpr int kVersion = 1;
constexpr double kMinFov_rad = 1e-3, kMaxFov_rad = 3.1;
constexpr double kMostOffCentre = 10;  // pictures

Eigen::Vector2d PrincipalPoint(const Camera& camera) {
  return camera.PrincipalPointPx().array() / Eigen::Array2d(camera.width_px, camera.height_px);
}
double VerticalFov(const Camera& camera) { return 2 * std::atan(0.5 * camera.height_px / camera.FocalPx().y()); }

// An order of the centres that makes a short walk: nearest neighbours from the end of the longest axis, then 2-opt.
std::vector<std::size_t> ShortWalk(const std::vector<Eigen::Vector3d>& c) {
  const std::size_t n = c.size();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& x : c) mean += x;
  mean /= static_cast<double>(n);
  std::size_t start = 0;
  for (std::size_t i = 1; i < n; ++i)
    if ((c[i] - mean).squaredNorm() > (c[start] - mean).squaredNorm()) start = i;
  std::vector<std::size_t> order{start};
  std::vector<bool> used(n, false);
  used[start] = true;
  while (order.size() < n) {
    std::size_t best = n;
    for (std::size_t i = 0; i < n; ++i)
      if (!used[i] && (best == n || (c[i] - c[order.back()]).squaredNorm() < (c[best] - c[order.back()]).squaredNorm()))
        best = i;
    used[best] = true;
    order.push_back(best);
  }
  const auto length = [&](std::size_t a, std::size_t b) { return (c[order[a]] - c[order[b]]).norm(); };
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    bool shorter = false;
    for (std::size_t i = 0; i + 2 < n; ++i)
      for (std::size_t j = i + 2; j < n; ++j) {
        const double tail_old = j + 1 < n ? length(j, j + 1) : 0, tail_new = j + 1 < n ? length(i + 1, j + 1) : 0;
        if (length(i, j) + tail_new < length(i, i + 1) + tail_old - 1e-12) {
          std::reverse(order.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                       order.begin() + static_cast<std::ptrdiff_t>(j) + 1);
          shorter = true;
        }
      }
    if (!shorter) break;
  }
  return order;
}

Eigen::Quaterniond WeightedMean(const std::vector<std::pair<double, Eigen::Quaterniond>>& terms) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  const Eigen::Vector4d reference = terms.front().second.coeffs();
  for (const auto& [w, q] : terms) sum += (q.coeffs().dot(reference) < 0 ? -w : w) * q.coeffs();
  return Eigen::Quaterniond(Eigen::Vector4d(sum.normalized()));
}

// Cubic Hermite over uneven times with Catmull-Rom tangents, written as weights of the four keys around t.
std::array<double, 4> KeyWeights(const std::vector<PathKey>& keys, std::size_t i, double t) {
  const double t1 = keys[i].time_s, t2 = keys[i + 1].time_s, d = t2 - t1, s = (t - t1) / d;
  const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s), h01 = s * s * (3 - 2 * s),
               h11 = s * s * (s - 1);
  std::array<double, 4> w{0, h00, h01, 0};
  // Tangent at key i: (x2 - x0) / (t2 - t0); one-sided at the ends.
  if (i > 0) {
    const double m = h10 * d / (t2 - keys[i - 1].time_s);
    w[0] -= m;
    w[2] += m;
  } else {
    w[1] -= h10;
    w[2] += h10;
  }
  if (i + 2 < keys.size()) {
    const double m = h11 * d / (keys[i + 2].time_s - t1);
    w[1] -= m;
    w[3] += m;
  } else {
    w[1] -= h11;
    w[2] += h11;
  }
  return w;
}

}  // namespace

Eigen::Vector2i FilmSize(const Scene& scene) {
  if (scene.views.empty()) throw DataError("the scene has no photos, so there is no path through them");
  int higher = 0;
  std::optional<Eigen::Vector2i> high, wide;
  for (const View& view : scene.views) {
    const Eigen::Vector2i size = UprightSize(SizePx(scene, view), view.orientation);
    const bool is_high = size.y() > size.x();
    higher += is_high ? 1 : -1;
    if (auto& first = is_high ? high : wide; !first) first = size;
  }
  return higher > 0 ? *high : wide ? *wide : *high;
}

CameraPath PathThroughPhotos(const Scene& scene, double seconds, double fps) {
  const Eigen::Vector2i film = FilmSize(scene);
  const std::size_t n = scene.views.size();
  std::vector<Eigen::Vector3d> centres;
  std::vector<Rigid3> upright;
  std::vector<double> fovs, axes_x, axes_y;
  bool is_video = true;
  for (const View& v : scene.views) {
    centres.push_back(v.CentreInWorld());
    is_video = is_video && v.frame_index.has_value();
    const auto [camera, pose] = UprightCamera(scene.CameraOf(v), v.cam_from_world, v.orientation);
    upright.push_back(pose);
    if ((camera.height_px > camera.width_px) != (film.y() > film.x())) continue;
    fovs.push_back(VerticalFov(camera));
    const Eigen::Vector2d axis = PrincipalPoint(camera);
    axes_x.push_back(axis.x());
    axes_y.push_back(axis.y());
  }
  std::vector<std::size_t> order(n);
  if (is_video) {
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return *scene.views[a].frame_index < *scene.views[b].frame_index; });
  } else {
    order = ShortWalk(centres);
  }

  // Low-pass over the neighbours in the walk (a hand's tremor is not part of the tour), ends held.
  const double sigma = std::clamp(static_cast<double>(n) / 24.0, 0.3, 4.0);
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  CameraPath path;
  path.fps = fps;
  std::vector<Eigen::Vector3d> smooth;
  for (int i = 0; i < static_cast<int>(n); ++i) {
    Eigen::Vector3d c = Eigen::Vector3d::Zero();
    double total = 0;
    std::vector<std::pair<double, Eigen::Quaterniond>> turns;
    const int r = std::min({reach, i, static_cast<int>(n) - 1 - i});
    for (int d = -r; d <= r; ++d) {
      const double w = std::exp(-0.5 * d * d / (sigma * sigma));
      const std::size_t v = order[static_cast<std::size_t>(i + d)];
      c += w * centres[v];
      total += w;
      turns.emplace_back(w, upright[v].rotation);
    }
    PathKey key;
    key.cam_from_world.rotation = WeightedMean(turns);
    smooth.push_back(c / total);
    key.cam_from_world.translation = -(key.cam_from_world.rotation * smooth.back());
    key.vertical_fov_rad = Median(fovs);
    key.principal_point = {Median(axes_x), Median(axes_y)};
    path.keys.push_back(key);
  }
  // Time in proportion to the way: distance in units of the scene's size, plus half the turn.
  const double unit = scene.normalized_from_world.scale;
  double way = 0;
  for (std::size_t i = 1; i < n; ++i) {
    const double turn = path.keys[i].cam_from_world.rotation.angularDistance(path.keys[i - 1].cam_from_world.rotation);
    way += std::max(1e-6, unit * (smooth[i] - smooth[i - 1]).norm() + 0.5 * turn);
    path.keys[i].time_s = way;
  }
  if (way > 0)
    for (PathKey& key : path.keys) key.time_s *= seconds / way;
  return path;
}

double Duration(const CameraPath& path) {
  return path.keys.empty() ? 0 : path.keys.back().time_s - path.keys.front().time_s;
}

int FrameCount(const CameraPath& path) {
  if (path.keys.empty()) return 0;
  return path.frames > 0 ? path.frames : std::max(1, static_cast<int>(std::lround(Duration(path) * path.fps)));
}

PathKey PoseOnPath(const CameraPath& path, double time_s) {
  if (path.keys.empty()) throw std::invalid_argument("PoseOnPath: the path has no keys");
  PathKey pose = path.keys.front();
  pose.time_s = std::clamp(time_s, path.keys.front().time_s, path.keys.back().time_s);
  if (path.keys.size() == 1) return pose;
  const auto after = std::lower_bound(path.keys.begin() + 1, path.keys.end() - 1, pose.time_s,
                                      [](const PathKey& key, double t) { return key.time_s < t; });
  const auto i = static_cast<std::size_t>(after - path.keys.begin()) - 1;
  const auto w = KeyWeights(path.keys, i, pose.time_s);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  std::vector<std::pair<double, Eigen::Quaterniond>> turns;
  pose.vertical_fov_rad = 0;
  pose.principal_point.setZero();
  for (std::size_t d = 0; d < 4; ++d) {
    if (w[d] == 0) continue;
    const PathKey& key = path.keys[i + d - 1];
    centre += w[d] * key.cam_from_world.OriginInSource();
    pose.vertical_fov_rad += w[d] * key.vertical_fov_rad;
    pose.principal_point += w[d] * key.principal_point;
    turns.emplace_back(w[d], key.cam_from_world.rotation);
  }
  // A cubic may pass its keys: the field of view stays one.
  pose.vertical_fov_rad = std::clamp(pose.vertical_fov_rad, kMinFov_rad, kMaxFov_rad);
  pose.cam_from_world.rotation = WeightedMean(turns);
  pose.cam_from_world.translation = -(pose.cam_from_world.rotation * centre);
  return pose;
}

RenderView MakeRenderView(const PathKey& key, int width_px, int height_px) {
  const double focal = 0.5 * height_px / std::tan(0.5 * key.vertical_fov_rad);
  RenderView v = MakeRenderView(Camera::Pinhole(width_px, height_px, focal, focal, key.principal_point.x() * width_px,
                                                key.principal_point.y() * height_px),
                                key.cam_from_world);
  v.time_s = key.time_s;
  return v;
}

std::vector<RenderView> SamplePath(const CameraPath& path, int width_px, int height_px) {
  std::vector<RenderView> views;
  const int frames = FrameCount(path);
  for (int f = 0; f < frames; ++f) {
    const double t = path.keys.front().time_s + (frames > 1 ? Duration(path) * f / (frames - 1) : 0);
    views.push_back(MakeRenderView(PoseOnPath(path, t), width_px, height_px));
  }
  return views;
}

static CameraPath OwnPath(const nlohmann::json& j, const std::filesystem::path& file) {
  CameraPath path;
  if (const int version = JsonAt<int>(j, "version"); version > kVersion)
    throw InputError(file, "a camera path of version " + std::to_string(version) + "; this program reads up to " +
                               std::to_string(kVersion));
  path.fps = JsonOr(j, "fps", 30.0);
  path.width_px = JsonOr(j, "width", 0);
  path.height_px = JsonOr(j, "height", 0);
  const auto keys = JsonAt<nlohmann::json>(j, "keys");
  if (!keys.is_array()) throw JsonFault("\"keys\" must be a list");
  for (const auto& k : keys) {
    PathKey key;
    const std::string where = "keys[" + std::to_string(path.keys.size()) + "].";
    const auto c = JsonAt<std::array<double, 3>>(k, "position", where);
    const auto q = JsonAt<std::array<double, 4>>(k, "cam_from_world_xyzw", where);
    key.cam_from_world.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
    const double norm = key.cam_from_world.rotation.norm();
    if (!(norm > 1e-9) || !std::isfinite(norm))
      throw InputError(file, "key " + std::to_string(path.keys.size()) + ": the rotation is zero");
    key.cam_from_world.rotation.normalize();
    key.cam_from_world.translation = -(key.cam_from_world.rotation * Eigen::Vector3d(c[0], c[1], c[2]));
    key.vertical_fov_rad = JsonAt<double>(k, "vertical_fov_deg", where) * kRadPerDeg;
    key.time_s = JsonAt<double>(k, "time_s", where);
    if (k.contains("principal_point")) {
      const auto p = JsonAt<std::array<double, 2>>(k, "principal_point", where);
      key.principal_point = {p[0], p[1]};
    }
    path.keys.push_back(key);
  }
  return path;
}

CameraPath ReadCameraPath(const std::filesystem::path& file, PathDetail detail) {
  const std::string text = ReadJsonText(file);
  CameraPath path;
  try {
    const auto j = nlohmann::json::parse(text);
    if (!j.is_object()) throw InputError(file, "not a camera path: no JSON object");
    if (IsNerfstudioPath(j))
      path = ParseNerfstudioPath(j, file, detail);
    else if (j.value("format", "") == kFormat)
      path = OwnPath(j, file);
    else
      throw InputError(file,
                       "not a camera path: neither \"format\": \"lumigraph-path\" nor nerfstudio's \"camera_path\"");
  } catch (const JsonFault& e) {
    throw InputError(file, std::string("not a camera path: ") + e.what());
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, "not a camera path: " + JsonProblem(e.what()));
  }
  if (path.keys.empty()) throw InputError(file, "the path has no keys");
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const PathKey& key = path.keys[i];
    if (!key.cam_from_world.translation.allFinite() ||
        !(key.vertical_fov_rad > 0 && key.vertical_fov_rad < kMaxFov_rad) ||
        !(key.principal_point.array().abs() <= kMostOffCentre).all() || !std::isfinite(key.time_s) ||
        (i > 0 && !(key.time_s > path.keys[i - 1].time_s)))
      throw InputError(file, "key " + std::to_string(i) +
                                 ": times must ascend, fields of view lie in (0, 177] degrees, principal points within "
                                 "10 pictures, all numbers be finite");
  }
  if (!(path.fps > 0 && path.fps <= 1000)) throw InputError(file, "fps must lie in (0, 1000]");
  if (path.width_px < 0 || path.height_px < 0 || path.width_px > 32768 || path.height_px > 32768)
    throw InputError(file, "width and height must lie in 0 to 32768");
  if (Duration(path) > kMaxPathSeconds) throw InputError(file, "the path is longer than a day");
  return path;
}

void WriteCameraPath(const std::filesystem::path& file, const CameraPath& path) {
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  j["format"] = kFormat;
  j["version"] = kVersion;
  j["fps"] = path.fps;
  j["width"] = path.width_px;
  j["height"] = path.height_px;
  j["keys"] = nlohmann::ordered_json::array();
  for (const PathKey& key : path.keys) {
    const Eigen::Vector3d c = key.cam_from_world.OriginInSource();
    const Eigen::Quaterniond& q = key.cam_from_world.rotation;
    j["keys"].push_back({{"time_s", key.time_s},
                         {"position", {c.x(), c.y(), c.z()}},
                         {"cam_from_world_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                         {"vertical_fov_deg", key.vertical_fov_rad * kDegPerRad}});
    if (key.principal_point != Eigen::Vector2d(0.5, 0.5))
      j["keys"].back()["principal_point"] = {key.principal_point.x(), key.principal_point.y()};
  }
  WriteTextAtomically(file, j.dump(2) + "\n");
}

}  // namespace lumi
