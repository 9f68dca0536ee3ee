#include "tests/stabilize/walks.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi::test {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

// One degree of freedom of the hand: sines of falling strength.
class Tremor {
 public:
  Tremor(double rms, std::mt19937_64& random) {
    std::uniform_real_distribution<double> uniform(0, 1);
    constexpr int kSines = 9;
    double power = 0;
    for (int i = 0; i < kSines; ++i) {
      const double hz = 0.8 * std::pow(7 / 0.8, (i + 0.6 * uniform(random)) / kSines);
      const double strength = 1 / std::sqrt(1 + hz * hz / 4);
      sines_.push_back({hz, strength, kTwoPi * uniform(random)});
      power += 0.5 * strength * strength;
    }
    for (Sine& sine : sines_) sine.strength *= rms / std::sqrt(power);
  }
  double At(double time_s) const {
    double sum = 0;
    for (const Sine& sine : sines_) sum += sine.strength * std::sin(kTwoPi * sine.hz * time_s + sine.phase);
    return sum;
  }

 private:
  struct Sine {
    double hz, strength, phase;
  };
  std::vector<Sine> sines_;
};

Rigid3 Looking(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
  return LookAt(eye, eye + direction, -Eigen::Vector3d::UnitY());
}

std::optional<Eigen::Vector2d> Image(const Matrix34d& P, const Eigen::Vector4d& X) {
  const Eigen::Vector3d q = P * X;
  if (!(q.z() > 1e-9 * q.norm())) return std::nullopt;
  return Eigen::Vector2d(q.head<2>() / q.z());
}

}  // namespace

std::vector<Eigen::Vector4d> PointsIn(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Eigen::Vector4d> X;
  for (int i = 0; i < n; ++i) {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    X.push_back((low + Eigen::Vector3d(a, b, c).cwiseProduct(high - low)).homogeneous());
  }
  return X;
}

Matrix34d MatrixOf(const Pose& pose) {
  Eigen::Matrix3d K;
  K << pose.focal_px, 0, 0.5 * kWidthPx, 0, pose.focal_px, 0.5 * kHeightPx, 0, 0, 1;
  return ProjectionMatrix(K, pose.cam_from_world);
}

Walk Film(int frames, const std::function<Pose(double)>& at, std::vector<Eigen::Vector4d> X, const Hand& hand) {
  Walk walk;
  walk.X = std::move(X);
  std::mt19937_64 random(hand.seed);
  std::vector<Tremor> turn, move;
  for (int i = 0; i < 3; ++i) turn.emplace_back(hand.turn_rad, random);
  for (int i = 0; i < 3; ++i) move.emplace_back(hand.move, random);
  const Tremor zoom(hand.zoom, random);
  for (int i = 0; i < frames; ++i) {
    const double time_s = i / kFps;
    Pose pose = at(frames > 1 ? i / static_cast<double>(frames - 1) : 0.0);
    walk.ideal.push_back(MatrixOf(pose));
    Eigen::Vector3d turned(turn[0].At(time_s), turn[1].At(time_s), turn[2].At(time_s));
    if (hand.only_hz > 0) turned = Eigen::Vector3d(0, hand.turn_rad * std::sin(kTwoPi * hand.only_hz * time_s), 0);
    const Eigen::Quaterniond shake = Eigen::AngleAxisd(turned.x(), Eigen::Vector3d::UnitX()) *
                                     Eigen::AngleAxisd(turned.y(), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(0.7 * turned.z(), Eigen::Vector3d::UnitZ());
    pose.cam_from_world = Rigid3{shake, Eigen::Vector3d(move[0].At(time_s), move[1].At(time_s), move[2].At(time_s))} *
                          pose.cam_from_world;
    pose.focal_px *= std::exp(zoom.At(time_s));
    walk.shaky.push_back(MatrixOf(pose));
    std::vector<char>& seen = walk.seen.emplace_back();
    for (const Eigen::Vector4d& x : walk.X) {
      const auto image = Image(walk.shaky.back(), x);
      const bool near = (walk.shaky.back() * x).z() < 0.3;
      seen.push_back(image && !near && image->x() >= 0 && image->y() >= 0 && image->x() <= kWidthPx &&
                     image->y() <= kHeightPx);
    }
  }
  return walk;
}

Walk Forward(int frames, const Hand& hand) {
  std::vector<Eigen::Vector4d> X = PointsIn({-1.2, -1.1, 2}, {1.2, 1.1, 30}, 900, 8);
  for (std::size_t i = 0; i < X.size(); ++i) {
    if (i % 4 < 2)
      X[i].x() = i % 2 == 0 ? -1.2 : 1.2;
    else if (i % 9 != 0)
      X[i].y() = i % 2 == 0 ? -1.1 : 1.1;
    else
      X[i].z() = 30;
  }
  const double way = 1.2 * frames / kFps;
  return Film(
      frames,
      [=](double u) {
        return Pose{Looking({0.1, 0.05, way * u}, {0.02, 0.01, 1})};
      },
      X, hand);
}

Walk Sideways(int frames, const Hand& hand) {
  const double way = 0.8 * frames / kFps;
  return Film(
      frames,
      [=](double u) {
        return Pose{Looking({way * u, 0, 0}, {0, 0.03, 1})};
      },
      PointsIn({-9, -4, 5}, {9 + way, 4, 16}, 900, 7), hand);
}

Walk Diagonal(int frames, const Hand& hand) {
  const double way = 0.9 * frames / kFps;
  const Eigen::Vector3d along(std::sin(25 * kRadPerDeg), 0, std::cos(25 * kRadPerDeg));
  return Film(
      frames,
      [=](double u) {
        return Pose{Looking(way * u * along, {0, 0, 1})};
      },
      PointsIn({-12, -5, 6 + way}, {14, 5, 25 + way}, 900, 9), hand);
}

Walk Vertigo(int frames, double off_axis, const Hand& hand) {
  constexpr double kObjectAt = 6;
  const double way = 2.5;
  std::vector<Eigen::Vector4d> X = PointsIn({-7, -4, 9}, {7, 4, 25}, 600, 11);
  std::vector<std::int32_t> object;
  for (const Eigen::Vector4d& x :
       PointsIn({-0.5 + off_axis, -0.5, kObjectAt}, {0.5 + off_axis, 0.5, kObjectAt}, 60, 12)) {
    object.push_back(static_cast<std::int32_t>(X.size()));
    X.push_back(x);
  }
  Walk walk = Film(
      frames,
      [=](double u) {
        return Pose{Looking({0, 0, way * u}, {0, 0, 1}), kFocalPx * (kObjectAt - way * u) / kObjectAt};
      },
      X, hand);
  walk.object = object;
  return walk;
}

Walk Around(int frames, double arc_deg, const Hand& hand) {
  const auto at = [=](double u) {
    const double a = arc_deg * kRadPerDeg * (u - 0.5);
    const Eigen::Vector3d eye(4 * std::sin(a), -0.6, -4 * std::cos(a));
    return Pose{Looking(eye, Eigen::Vector3d(0, -0.1, 0) - eye)};
  };
  std::vector<Eigen::Vector4d> X = PointsIn({-1.3, -0.9, -1.3}, {1.3, 0.9, 1.3}, 400, 13);
  for (const Eigen::Vector4d& x : PointsIn({-12, -4, -12}, {12, 4, 12}, 900, 14))
    if (x.head<3>().norm() > 7) X.push_back(x);
  return Film(frames, at, X, hand);
}

Walk Wander(int frames, const Hand& hand) {
  const double seconds = frames / kFps;
  const auto at = [=](double u) {
    const double t = seconds * u;
    const Eigen::Vector3d eye(0.7 * t, 0.25 * std::sin(kTwoPi * 0.06 * t), 0.5 * std::sin(kTwoPi * 0.05 * t));
    return Pose{Looking(eye, {0.1 * std::sin(kTwoPi * 0.05 * t), 0.03 * std::sin(kTwoPi * 0.07 * t), 1})};
  };
  return Film(frames, at, PointsIn({-9, -4, 5}, {9 + 0.7 * seconds, 4, 16}, 900, 15), hand);
}

Scene Told(const Walk& walk, const Telling& telling) {
  std::mt19937_64 random(telling.seed);
  std::normal_distribution<double> gauss(0, 1);
  const Eigen::Matrix4d& H = telling.world_from_walk;
  const Eigen::Matrix4d inverse = H.fullPivLu().inverse();
  Scene scene;
  scene.frame = Frame::kQuasiAffine;
  Eigen::Vector4d plane;
  plane << telling.plane_tilt, 1;
  scene.plane_at_infinity = inverse.transpose() * plane;
  for (std::size_t t = 0; t < walk.shaky.size(); ++t) {
    View& view = scene.views.emplace_back();
    view.name = fmt::format("frame_{:06}.png", t);
    view.P = walk.shaky[t] * inverse;
    view.P /= view.P.norm();
    view.size_px = {kWidthPx, kHeightPx};
    view.frame_index = static_cast<int>(t);
    view.time_s = static_cast<double>(t) / kFps;
  }
  for (std::size_t j = 0; j < walk.X.size(); ++j) {
    Point point;
    const auto finish = [&] {
      if (point.track.size() >= 2) {
        point.X_in_world = (H * walk.X[j]).normalized();
        point.error_px = 1.25 * telling.noise_px;
        scene.points.push_back(point);
      }
      point.track.clear();
    };
    auto age = static_cast<int>(random() % static_cast<unsigned>(telling.track_frames));
    for (std::size_t t = 0; t < walk.shaky.size(); ++t) {
      if (++age % telling.track_frames == 0) finish();
      if (!walk.seen[t][j]) continue;
      const Eigen::Vector2d noise(gauss(random), gauss(random));
      point.track.push_back({ViewId{static_cast<int>(t)}, *Image(walk.shaky[t], walk.X[j]) + telling.noise_px * noise});
    }
    finish();
  }
  return scene;
}

FilmedScene ReadWalk(const Walk& walk, const Telling& telling) {
  return ReadFilmedScene(Told(walk, telling), std::nullopt);
}

Eigen::Matrix4d ProjectiveFrame(const Walk& walk, double condition, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  for (;;) {
    Eigen::Matrix4d A;
    for (int i = 0; i < 16; ++i) A(i / 4, i % 4) = gauss(random);
    const SingularValueDecomposition svd = DecomposeSingular(A);
    Eigen::Vector4d values;
    for (int i = 0; i < 4; ++i) values[i] = std::pow(condition, -i / 3.0);
    Eigen::Matrix4d H = svd.U * values.asDiagonal() * svd.V.transpose();
    // Its last row says where infinity goes: nothing that is seen may lie there. The first singular direction is free
    // to be replaced, so that any condition can be had.
    double low = 1e300, high = -1e300;
    for (const Eigen::Vector4d& x : walk.X)
      low = std::min(low, H.row(3).dot(x)), high = std::max(high, H.row(3).dot(x));
    if (low > 0) return H;
    if (high < 0) return -H;
  }
}

std::vector<Matrix34d> InWalk(const MatrixPath& path, const Telling& telling) {
  std::vector<Matrix34d> P;
  for (const MatrixKey& key : path.keys) P.push_back(key.P * telling.world_from_walk);
  return P;
}

std::vector<Matrix34d> InWalk(const FilmedScene& film, const std::vector<Matrix34d>& P, const Telling& telling) {
  std::vector<Matrix34d> in_walk;
  for (const Matrix34d& p : P) in_walk.push_back(film.InPixels(p) * telling.world_from_walk);
  return in_walk;
}

double JitterPx(const Walk& walk, const std::vector<Matrix34d>& P, int first, int last) {
  const auto n = static_cast<int>(P.size());
  const int reach =
      std::min(static_cast<int>(kFps), (n - 1) / 2);  // a Hann window of two seconds: nothing above 1 Hz passes
  double sum = 0;
  long count = 0;
  const auto off = [&](int t, std::size_t j) -> std::optional<Eigen::Vector2d> {
    const auto a = Image(P[static_cast<std::size_t>(t)], walk.X[j]),
               b = Image(walk.ideal[static_cast<std::size_t>(t)], walk.X[j]);
    if (!a || !b) return std::nullopt;
    return Eigen::Vector2d(*a - *b);
  };
  for (int t = std::max(reach, first); t + reach < n && t <= last; ++t)
    for (std::size_t j = 0; j < walk.X.size(); ++j) {
      if (!walk.seen[static_cast<std::size_t>(t)][j]) continue;
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      double weights = 0;
      bool whole = true;
      for (int d = -reach + 1; d < reach && whole; ++d) {
        // Over the frames that see it or nearly do: what leaves past the camera has no image to shake.
        const auto x = off(t + d, j);
        const double w = 0.5 + 0.5 * std::cos(std::numbers::pi * d / reach);
        whole = x && walk.seen[static_cast<std::size_t>(t + d)][j];
        if (whole) mean += w * *x, weights += w;
      }
      if (!whole) continue;
      sum += (*off(t, j) - mean / weights).squaredNorm();
      ++count;
    }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : std::nan("");
}

double WorstBendPx(const Walk& walk, const std::vector<Matrix34d>& P, int first, int last) {
  double worst = 0;
  for (int t = std::max(1, first); t + 1 < static_cast<int>(P.size()) && t <= last; ++t) {
    double sum = 0;
    long count = 0;
    for (std::size_t j = 0; j < walk.X.size(); ++j) {
      Eigen::Vector2d bend(0, 0);
      bool whole = true;
      for (int d = -1; d <= 1; ++d) {
        const auto at = static_cast<std::size_t>(t + d);
        const auto a = Image(P[at], walk.X[j]), b = Image(walk.ideal[at], walk.X[j]);
        whole = whole && a && b && walk.seen[at][j];
        if (whole) bend += (d == 0 ? -2 : 1) * (*a - *b);
      }
      if (whole) sum += bend.squaredNorm(), ++count;
    }
    if (count > 0) worst = std::max(worst, std::sqrt(sum / static_cast<double>(count)));
  }
  return worst;
}

Walk WindowOf(const Walk& walk, int first, int count) {
  Walk window = walk;
  const auto some = [&](auto& list) { list = {list.begin() + first, list.begin() + first + count}; };
  some(window.ideal), some(window.shaky), some(window.seen);
  return window;
}

Scene ToldFrom(const Walk& window, const Telling& telling, int first) {
  Scene scene = Told(window, telling);
  for (std::size_t t = 0; t < scene.views.size(); ++t) {
    const int frame = static_cast<int>(t) + first;
    scene.views[t].name = fmt::format("frame_{:06}.png", frame);
    scene.views[t].frame_index = frame;
    scene.views[t].time_s = frame / kFps;
  }
  return scene;
}

InWindows StabilizeInWindows(const Walk& walk, const StabilizeOptions& asked, int length, int overlap,
                             const Telling& telling) {
  InWindows result;
  StabilizeOptions options = asked;
  const auto total = static_cast<int>(walk.shaky.size());
  for (int first = 0, number = 0;; first += length - overlap, ++number) {
    const int count = std::min(length, total - first);
    const bool last = first + count == total;
    const Walk window = WindowOf(walk, first, count);
    Telling told = telling;
    told.seed += static_cast<unsigned>(number);
    told.world_from_walk = ProjectiveFrame(window, 50, told.seed);
    told.plane_tilt *= number % 2 == 0 ? 1 : -1;
    options.anchors = last ? 0 : overlap;
    if (number > 0) options.object_px.clear();  // it is known from the window before
    StabilizeReport& report = result.reports.emplace_back();
    const MatrixPath path =
        Stabilize(ReadFilmedScene(ToldFrom(window, told, first), std::nullopt), options, report, SilentProgress());
    const std::vector<Matrix34d> P = InWalk(path, told);
    if (number > 0) result.seams.push_back(first + report.first_shown);
    result.P.insert(result.P.end(), P.begin() + report.first_shown, P.begin() + report.last_shown + 1);
    if (last) break;
    options.before = path;
  }
  return result;
}

double LargestDistancePx(const Walk& walk, const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b) {
  double largest = 0;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (std::size_t j = 0; j < walk.X.size(); ++j) {
      if (!walk.seen[t][j]) continue;
      const auto x = Image(a[t], walk.X[j]), y = Image(b[t], walk.X[j]);
      largest = std::max(largest, x && y ? (*x - *y).norm() : 1e300);
    }
  return largest;
}

std::vector<double> ObjectSizes(const Walk& walk, const std::vector<Matrix34d>& P) {
  std::vector<double> sizes;
  for (const Matrix34d& p : P) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    std::vector<Eigen::Vector2d> images;
    for (const std::int32_t j : walk.object)
      images.push_back(Image(p, walk.X[static_cast<std::size_t>(j)]).value_or(Eigen::Vector2d::Constant(std::nan(""))));
    for (const auto& x : images) mean += x / static_cast<double>(images.size());
    double sum = 0;
    for (const auto& x : images) sum += (x - mean).squaredNorm();
    sizes.push_back(std::sqrt(sum / static_cast<double>(images.size())));
  }
  return sizes;
}

std::vector<double> ObjectBox(const Walk& walk) {
  constexpr double kMarginPx = 2;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
  for (const std::int32_t j : walk.object) {
    const Eigen::Vector2d x = Eigen::Vector3d(walk.shaky.front() * walk.X[static_cast<std::size_t>(j)]).hnormalized();
    low = low.cwiseMin(x), high = high.cwiseMax(x);
  }
  return {low.x() - kMarginPx, low.y() - kMarginPx, high.x() - low.x() + 2 * kMarginPx,
          high.y() - low.y() + 2 * kMarginPx};
}

}  // namespace lumi::test
