#include "stabilize/jitter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumi {
namespace {

constexpr double kLargestHole =
    0.25;  // of the window's reach, from one frame to the next: beyond, nothing holds the fit
constexpr double kSlackOfTimes = 1e-6;  // of the reach

// The frames around one, and what each says of the fit's value there; none where the window is not full.
struct ParabolaWindow {
  int first = 0;
  std::vector<double> weight;  // their sum is 1
};

ParabolaWindow WindowAround(const FilmedScene& film, int middle, double reach_s) {
  const auto n = static_cast<int>(film.frames.size());
  const auto time = [&](int t) {
    return (film.frames[static_cast<std::size_t>(t)].time_s - film.frames[static_cast<std::size_t>(middle)].time_s) /
           reach_s;
  };
  ParabolaWindow window;
  if (time(0) > -1 + kSlackOfTimes || time(n - 1) < 1 - kSlackOfTimes) return window;
  int first = middle, last = middle;
  while (first > 0 && time(first - 1) > -1 + kSlackOfTimes) --first;
  while (last + 1 < n && time(last + 1) < 1 - kSlackOfTimes) ++last;
  const double hole = std::max(kLargestHole, 1.5 / (reach_s * film.fps));
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (int t = first; t <= last; ++t) {
    if (t > 0 && time(t) - time(t - 1) > hole) return window;
    const Eigen::Vector3d powers(1, time(t), time(t) * time(t));
    moments += (0.5 + 0.5 * std::cos(std::numbers::pi * time(t))) * powers * powers.transpose();
  }
  if (last + 1 < n && time(last + 1) - time(last) > hole) return window;
  const Eigen::LDLT<Eigen::Matrix3d> solver(moments);
  const Eigen::Vector3d value = solver.solve(Eigen::Vector3d::UnitX());
  if (last - first < 2 || !value.allFinite()) {  // too few for a parabola: it leaves nothing over
    window.first = middle;
    window.weight = {1};
    return window;
  }
  window.first = first;
  for (int t = first; t <= last; ++t)
    window.weight.push_back((0.5 + 0.5 * std::cos(std::numbers::pi * time(t))) *
                            value.dot(Eigen::Vector3d(1, time(t), time(t) * time(t))));
  return window;
}

}  // namespace

double ShakePx(const FilmedScene& film, const std::vector<Matrix34d>& P) {
  // What a parabola, fitted under a Hann window of two seconds, leaves over: half at 0.8 Hz, all from 1.3 Hz on. (A
  // mean would take the curve of a steady turn for a shake.)
  const auto n = static_cast<int>(P.size());
  const int reach =
      std::clamp((n - 1) / 2, 1, std::max(1, static_cast<int>(std::lround(film.fps))));  // all of a short video
  std::vector<std::vector<int>> seen(film.X.size());
  for (int t = 0; t < n; ++t)
    for (const SightOfPoint& s : film.frames[static_cast<std::size_t>(t)].sights)
      seen[static_cast<std::size_t>(s.point)].push_back(t);
  const int stride = n > 4 * reach ? 4 : 1;
  std::vector<ParabolaWindow> windows(static_cast<std::size_t>(n));
  for (int t = 0; t < n; t += stride) windows[static_cast<std::size_t>(t)] = WindowAround(film, t, reach / film.fps);
  double sum = 0;
  long count = 0;
  for (std::size_t j = 0; j < seen.size(); ++j) {
    if (static_cast<int>(seen[j].size()) <= reach / 2) continue;
    // Images in frames that do not see the point are used as well: the matrices do not depend on where a track ends.
    const auto at = [&](int t) -> Eigen::Vector2d {
      const Eigen::Vector3d q = P[static_cast<std::size_t>(t)] * film.X[j];
      return q.z() > 1e-9 ? Eigen::Vector2d(q.head<2>() / q.z()) : Eigen::Vector2d::Constant(std::nan(""));
    };
    for (const int t : seen[j]) {
      const ParabolaWindow& window = windows[static_cast<std::size_t>(t)];
      if (window.weight.empty()) continue;
      Eigen::Vector2d fitted = Eigen::Vector2d::Zero();
      for (std::size_t k = 0; k < window.weight.size(); ++k)
        fitted += window.weight[k] * at(window.first + static_cast<int>(k));
      const Eigen::Vector2d off = at(t) - fitted;
      if (!off.allFinite() || off.norm() > 1) continue;  // near the principal plane: no image
      sum += off.squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) * film.px_per_unit() : 0;
}

}  // namespace lumi
