#include "stabilize/jitter.h"

#include <algorithm>
#include <cmath>

namespace lumi {

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
  std::vector<double> window(static_cast<std::size_t>(reach));
  double moment[3] = {0, 0, 0};
  for (int d = -reach + 1; d < reach; ++d) {
    const double w = 0.5 + 0.5 * std::cos(3.14159265358979 * d / reach), dd = static_cast<double>(d) * d;
    window[static_cast<std::size_t>(std::abs(d))] = w;
    moment[0] += w, moment[1] += w * dd, moment[2] += w * dd * dd;
  }
  const double det = moment[0] * moment[2] - moment[1] * moment[1];
  for (int d = 0; d < reach; ++d)
    if (det > 0) window[static_cast<std::size_t>(d)] *= (moment[2] - moment[1] * d * d) / det * moment[0];
  double sum = 0;
  long count = 0;
  for (std::size_t j = 0; j < seen.size(); ++j) {
    if (static_cast<int>(seen[j].size()) <= reach / 2) continue;
    // Images beyond the frames that see a point are as good: the matrices know no ends of tracks.
    const auto at = [&](int t) -> Eigen::Vector2d {
      const Eigen::Vector3d q = P[static_cast<std::size_t>(t)] * film.X[j];
      return q.z() > 1e-9 ? Eigen::Vector2d(q.head<2>() / q.z()) : Eigen::Vector2d::Constant(std::nan(""));
    };
    for (const int t : seen[j]) {
      if (t < reach || t + reach >= n || t % stride != 0) continue;
      const double window_s = film.frames[static_cast<std::size_t>(t + reach)].time_s -
                              film.frames[static_cast<std::size_t>(t - reach)].time_s;
      if (window_s * film.fps > 2 * reach + 0.5) continue;  // frames are missing
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      double weights = 0;
      for (int d = -reach + 1; d < reach; ++d) {
        const double w = window[static_cast<std::size_t>(std::abs(d))];
        mean += w * at(t + d);
        weights += w;
      }
      const Eigen::Vector2d off = at(t) - mean / weights;
      if (!off.allFinite() || off.norm() > 1) continue;  // near the principal plane: no image
      sum += off.squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) * film.px_per_unit() : 0;
}

}  // namespace lumi
