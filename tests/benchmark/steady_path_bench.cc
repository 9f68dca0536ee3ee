// A stabilised path against the ideal one of a simulated walk: feature jitter above 1 Hz, an object's size, frames
// against the frames of the walk without its shake.
//
//   steady_path_bench CAPTURE SCENE PATH.json [VIDEO.mp4 STEADY.mp4] [--object X,Y,WIDTH,HEIGHT]
//
// The projective world of SCENE is brought to the simulation's by the one 4x4 transformation that takes its points to
// where truth/depth has them; the simulation's own points are then seen by the stabilised matrices and by the ideal
// cameras.
#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/progress.h"

namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using lumi::Matrix34d;
using nlohmann::json;

std::vector<Matrix34d> Cameras(const fs::path& file) {
  std::vector<Matrix34d> P;
  const json views = json::parse(lumi::ReadText(file))["views"];
  for (const json& v : views) {
    const auto& k = v["params"];
    Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
    K(0, 0) = k[0];
    K(1, 1) = k[1];
    K(0, 2) = k[2];
    K(1, 2) = k[3];
    Matrix34d T;
    for (int i = 0; i < 12; ++i) T(i / 4, i % 4) = v["cam_from_world"][static_cast<std::size_t>(i)].get<double>();
    P.push_back(K * T);
  }
  return P;
}

Vector2d ImageOf(const Matrix34d& P, const Vector4d& X) {
  const Vector3d q = P * X;
  return q.z() > 0 ? Vector2d(q.hnormalized()) : Vector2d::Constant(std::nan(""));
}

// T with X_scene ~ T X_true: x ~ P T G at the points' sights, linear in T, weighed by 1 / w and Huber's weights of the
// round before. The world's numbers of the order of one, and images in picture widths.
Eigen::Matrix4d SceneFromTruth(const std::vector<Vector4d>& truth, const std::vector<Matrix34d>& P_px,
                               const std::vector<std::pair<int, Vector2d>>& seen, const Eigen::Vector2i& size_px) {
  Vector3d centre = Vector3d::Zero();
  for (const Vector4d& g : truth) centre += g.head<3>() / static_cast<double>(truth.size());
  double spread = 0;
  for (const Vector4d& g : truth) spread += (g.head<3>() - centre).norm() / static_cast<double>(truth.size());
  Eigen::Matrix4d normal_from_truth = Eigen::Matrix4d::Identity();
  normal_from_truth.topLeftCorner<3, 3>() /= spread;
  normal_from_truth.topRightCorner<3, 1>() = -centre / spread;
  Eigen::Matrix3d units = Eigen::Matrix3d::Identity();
  units.topLeftCorner<2, 2>() /= size_px.x();
  units.topRightCorner<2, 1>() = -0.5 * size_px.cast<double>() / size_px.x();
  std::vector<Matrix34d> P;
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  for (const Matrix34d& p : P_px) {
    P.push_back(units * p);
    P.back() /= P.back().norm();
    gram += P.back().transpose() * P.back();
  }
  const auto eigen = lumi::EigenOfSymmetric(gram);
  const Eigen::Matrix4d balance =
      eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();  // world from balanced
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  std::vector<double> weight(truth.size(), 1);
  for (int round = 0; round < 20; ++round) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(16, 16);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Matrix34d p = P[static_cast<std::size_t>(seen[i].first)] * balance;
      const Vector4d g = normal_from_truth * truth[i];
      const Vector2d x = (seen[i].second - 0.5 * size_px.cast<double>()) / size_px.x();
      for (int r = 0; r < 2; ++r) {
        const Vector4d a = p.row(r) - x[r] * p.row(2);
        Eigen::VectorXd row(16);
        for (int k = 0; k < 4; ++k) row.segment<4>(4 * k) = weight[i] * a[k] * g;
        A += row * row.transpose();
      }
    }
    const Eigen::VectorXd t = lumi::EigenOfSymmetric(A).vectors.col(0);
    for (int i = 0; i < 16; ++i) T(i / 4, i % 4) = t[i];
    std::vector<double> errors, w;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Vector3d q = P[static_cast<std::size_t>(seen[i].first)] * balance * T * normal_from_truth * truth[i];
      errors.push_back((q.hnormalized() - (seen[i].second - 0.5 * size_px.cast<double>()) / size_px.x()).norm());
      w.push_back(std::abs(q.z()));
    }
    const double usual = 2 * lumi::Median(errors), depth = lumi::Median(w);
    for (std::size_t i = 0; i < truth.size(); ++i)
      weight[i] = std::sqrt(std::min(1.0, usual / std::max(errors[i], 1e-12))) * depth / std::max(w[i], 1e-3 * depth);
  }
  const Eigen::Matrix4d scene_from_truth = balance * T * normal_from_truth;
  // In front is in front.
  int front = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    front += P_px[static_cast<std::size_t>(seen[i].first)].row(2).dot(scene_from_truth * truth[i]) > 0 ? 1 : -1;
  return front < 0 ? Eigen::Matrix4d(-scene_from_truth) : scene_from_truth;
}

// RMS of what a window of two seconds (Hann's, nothing of 1 Hz and above passes) leaves of a series.
void AddAboveOneHz(const std::vector<Vector2d>& d, int reach, double& sum, long& count) {
  for (int t = reach; t + reach < static_cast<int>(d.size()); ++t) {
    Vector2d mean = Vector2d::Zero();
    double weights = 0;
    for (int k = -reach + 1; k < reach; ++k) {
      const double w = 0.5 + 0.5 * std::cos(3.14159265358979 * k / reach);
      mean += w * d[static_cast<std::size_t>(t + k)];
      weights += w;
    }
    const Vector2d off = d[static_cast<std::size_t>(t)] - mean / weights;
    if (!off.allFinite()) continue;
    sum += off.squaredNorm();
    ++count;
  }
}

int Run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) {
    std::fprintf(stderr,
                 "steady_path_bench CAPTURE SCENE PATH.json [VIDEO.mp4 STEADY.mp4] [--object X,Y,WIDTH,HEIGHT]\n");
    return 2;
  }
  const fs::path capture = arguments[0];
  std::vector<double> box;
  std::vector<fs::path> videos;
  for (std::size_t i = 3; i < arguments.size(); ++i)
    if (arguments[i] == "--object" && i + 1 < arguments.size()) {
      const json numbers = json::parse("[" + arguments[++i] + "]");
      box = numbers.get<std::vector<double>>();
    } else {
      videos.emplace_back(arguments[i]);
    }
  const std::vector<Matrix34d> shaken = Cameras(capture / "truth" / "cameras.json"),
                               ideal = Cameras(capture / "truth" / "steady.json");
  lumi::OpenOptions open;
  open.check_photos = false;
  const lumi::Scene scene = lumi::OpenScene(arguments[1], open, lumi::SilentProgress());
  const lumi::MatrixPath path = lumi::ReadMatrixPath(arguments[2]);
  std::map<std::string, int> frame_of;
  for (std::size_t t = 0; t < path.keys.size(); ++t) frame_of[path.keys[t].view] = static_cast<int>(t);
  std::vector<fs::path> depth_files;
  for (const auto& e : fs::directory_iterator(capture / "truth" / "depth")) depth_files.push_back(e.path());
  std::sort(depth_files.begin(), depth_files.end());

  // A point's place by the depth where its middle sight saw it.
  std::map<int, lumi::ImageF> depths;
  std::vector<Vector4d> G;
  std::vector<std::pair<int, Vector2d>> seen;
  std::vector<Matrix34d> P(path.keys.size());
  for (const lumi::View& v : scene.views)
    if (const auto it = frame_of.find(v.name); it != frame_of.end()) P[static_cast<std::size_t>(it->second)] = v.P;
  std::vector<std::vector<int>> frames_of_point;
  for (const lumi::Point& point : scene.points) {
    if (point.error_px > 1 || point.track.size() < 4) continue;
    const lumi::Observation& o = point.track[point.track.size() / 2];
    const auto it = frame_of.find(scene.views[static_cast<std::size_t>(o.view.value)].name);
    if (it == frame_of.end()) continue;
    // Every eighth frame's depth is enough, and fits into memory.
    if (it->second % 8 != 0) continue;
    auto& depth = depths[it->second];
    if (depth.empty()) depth = lumi::ReadImageF(depth_files[static_cast<std::size_t>(it->second)]);
    const int u = static_cast<int>(o.x_px.x()), v = static_cast<int>(o.x_px.y());
    if (u < 1 || v < 1 || u + 1 >= depth.width || v + 1 >= depth.height) continue;
    const double z = depth.At(u, v, 0);
    double low = z, high = z;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        low = std::min<double>(low, depth.At(u + dx, v + dy, 0));
        high = std::max<double>(high, depth.At(u + dx, v + dy, 0));
      }
    if (!(low > 0) || high > 1.02 * low) continue;  // an edge: whose depth it is cannot be told
    const Matrix34d& camera = shaken[static_cast<std::size_t>(it->second)];
    Eigen::Matrix3d M = camera.leftCols<3>();
    const Vector3d world = M.inverse() * (z * Vector3d(o.x_px.x(), o.x_px.y(), 1) - camera.col(3));
    G.emplace_back(world.homogeneous());
    seen.emplace_back(it->second, o.x_px);
    std::vector<int> frames;
    for (const lumi::Observation& s : point.track)
      if (const auto f = frame_of.find(scene.views[static_cast<std::size_t>(s.view.value)].name); f != frame_of.end())
        frames.push_back(f->second);
    frames_of_point.push_back(std::move(frames));
  }
  if (G.size() < 20) throw lumi::DataError(fmt::format("{} points have a place in the simulation", G.size()));
  const Eigen::Matrix4d T = SceneFromTruth(G, P, seen, path.size_px());
  std::vector<double> errors;
  for (std::size_t i = 0; i < G.size(); ++i)
    errors.push_back((ImageOf(P[static_cast<std::size_t>(seen[i].first)], T * G[i]) - seen[i].second).norm());

  // Along each point, over the frames around those that saw it, as long as both see it well inside.
  const int reach = std::max(1, static_cast<int>(std::lround(path.fps)));
  double jitter = 0, before = 0, offset = 0;
  long counted = 0, counted_before = 0, offsets = 0;
  const double width = path.size_px().x();
  for (std::size_t i = 0; i < G.size(); ++i) {
    if (errors[i] > 1.5) continue;
    const int first = std::max(0, frames_of_point[i].front() - reach),
              last = std::min(static_cast<int>(path.keys.size()) - 1, frames_of_point[i].back() + reach);
    std::vector<Vector2d> d, shake;
    for (int t = first; t <= last; ++t) {
      const Vector2d wanted = ImageOf(ideal[static_cast<std::size_t>(t)], G[i]),
                     is = ImageOf(path.keys[static_cast<std::size_t>(t)].P, T * G[i]);
      const bool inside = (wanted - 0.5 * path.size_px().cast<double>()).norm() < width;
      d.push_back(inside ? Vector2d(is - wanted) : Vector2d::Constant(std::nan("")));
      shake.push_back(inside ? Vector2d(ImageOf(shaken[static_cast<std::size_t>(t)], G[i]) - wanted)
                             : Vector2d::Constant(std::nan("")));
      if (inside && (is - wanted).allFinite()) {
        offset += (is - wanted).squaredNorm();
        ++offsets;
      }
    }
    AddAboveOneHz(d, reach, jitter, counted);
    AddAboveOneHz(shake, reach, before, counted_before);
  }
  std::printf("points %zu, median distance of their places %.3f px\n", G.size(), lumi::Median(errors));
  std::printf(
      "jitter above 1 Hz against the ideal path: %.3f px RMS (as filmed %.3f px); distance from it, all frequencies "
      "%.2f px RMS\n",
      std::sqrt(jitter / std::max(1L, counted)), std::sqrt(before / std::max(1L, counted_before)),
      std::sqrt(offset / std::max(1L, offsets)));

  // The object's size: RMS distance of its points from their middle, in each frame over the first's.
  if (box.size() == 4) {
    // All of it that the first frame shows: what truth/silhouettes has within the box, at truth/depth.
    std::vector<fs::path> silhouettes;
    for (const auto& e : fs::directory_iterator(capture / "truth" / "silhouettes")) silhouettes.push_back(e.path());
    std::sort(silhouettes.begin(), silhouettes.end());
    const lumi::ImageF depth = lumi::ReadImageF(depth_files.front());
    const lumi::Image8 mask = lumi::ReadImage8(silhouettes.front());
    const Eigen::Matrix3d inverse = shaken.front().leftCols<3>().inverse();
    std::vector<Vector4d> object;
    for (int y = static_cast<int>(box[1]); y < std::min<int>(depth.height, static_cast<int>(box[1] + box[3])); y += 3)
      for (int x = static_cast<int>(box[0]); x < std::min<int>(depth.width, static_cast<int>(box[0] + box[2])); x += 3)
        if (mask.At(x, y, 0) > 127 && depth.At(x, y, 0) > 0)
          object.emplace_back(
              (inverse * (depth.At(x, y, 0) * Vector3d(x + 0.5, y + 0.5, 1) - shaken.front().col(3))).homogeneous());
    if (object.size() < 20) throw lumi::DataError("no part of a silhouette lies in the object's box");
    const auto size = [&](const Matrix34d& M, const Eigen::Matrix4d& world) {
      Vector2d mean = Vector2d::Zero();
      for (const Vector4d& g : object) mean += ImageOf(M, world * g) / static_cast<double>(object.size());
      double sum = 0;
      for (const Vector4d& g : object) sum += (ImageOf(M, world * g) - mean).squaredNorm();
      return std::sqrt(sum);
    };
    double largest = 0, filmed = 0, meant = 0;
    const double at_first = size(path.keys.front().P, T),
                 filmed_first = size(shaken.front(), Eigen::Matrix4d::Identity()),
                 ideal_first = size(ideal.front(), Eigen::Matrix4d::Identity());
    for (std::size_t t = 0; t < path.keys.size(); ++t) {
      largest = std::max(largest, std::abs(size(path.keys[t].P, T) / at_first - 1));
      filmed = std::max(filmed, std::abs(size(shaken[t], Eigen::Matrix4d::Identity()) / filmed_first - 1));
      meant = std::max(meant, std::abs(size(ideal[t], Eigen::Matrix4d::Identity()) / ideal_first - 1));
    }
    std::printf("object of %zu points: its size changes by up to %.2f %% (as filmed %.2f %%, ideal cameras %.2f %%)\n",
                object.size(), 100 * largest, 100 * filmed, 100 * meant);
  }
  if (videos.size() == 2) {
    lumi::VideoReader a(videos[0]), b(videos[1]);
    double psnr = 0;
    int frames = 0;
    for (;;) {
      const auto x = a.Next(), y = b.Next();
      if (!x || !y) break;
      double square = 0;
      for (std::size_t i = 0; i < x->rgb.data.size() && i < y->rgb.data.size(); ++i)
        square += std::pow(static_cast<double>(x->rgb.data[i]) - y->rgb.data[i], 2);
      psnr += 10 * std::log10(255.0 * 255 * static_cast<double>(x->rgb.data.size()) / std::max(square, 1.0));
      ++frames;
    }
    std::printf("PSNR against the walk without its shake: %.2f dB over %d frames\n", psnr / std::max(1, frames),
                frames);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "steady_path_bench: %s\n", e.what());
    return 1;
  }
}
