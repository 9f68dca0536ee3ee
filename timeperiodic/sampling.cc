#include "timeperiodic/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "scene/geometry/dense_solvers.h"
#include "scene/plot/plot.h"

namespace lumi {
namespace {

using Eigen::Vector3d;

constexpr double kViewsACell = 3;
constexpr int kMostCells = 24;      // along each axis
constexpr double kAllInHalf = 0.9;  // of the views: practically all in one half
constexpr double kUneven = 0.6;     // of the cells that as many views at random would fill
constexpr int kLargestRatio = 5;    // p, q of a ratio that leaves gaps
constexpr std::size_t kGapsNamed = 5;

double PhaseOf(double time, double period) {
  const double turns = time / period, phase = turns - std::floor(turns);
  return phase < 1 ? phase : 0;
}

// The camera's strongest oscillation: the highest peak of its spectrum above one cycle and a half over the video.
double CameraPeriod(const std::vector<SampledView>& views, const std::vector<double>& place) {
  double begin = views[0].time, end = begin;
  for (const SampledView& v : views) begin = std::min(begin, v.time), end = std::max(end, v.time);
  const double span = end - begin;
  if (!(span > 0)) return 0;
  double energy = 0;
  for (const double x : place) energy += x * x;
  double best = 0, best_f = 0;
  const double step = 0.1 / span, highest = 0.25 * static_cast<double>(views.size()) / span;
  const int count = std::min(20000, static_cast<int>(highest / step));
  for (int k = 15; k < count; ++k) {
    const double w = 6.283185307179586 * k * step;
    double c = 0, s = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      c += place[i] * std::cos(w * (views[i].time - begin));
      s += place[i] * std::sin(w * (views[i].time - begin));
    }
    if (const double power = c * c + s * s; power > best) best = power, best_f = k * step;
  }
  // A sinusoid alone has half of energy x views.
  return best > 0.1 * energy * static_cast<double>(views.size()) ? 1 / best_f : 0;
}

std::string Percent(double share) { return fmt::format("{:.0f}", 100 * share); }

// Windows of one unit, at every view's phase: sorted phases on a circle, two pointers.
void CountWindows(std::vector<double> phase, SamplingReport& r) {
  std::ranges::sort(phase);
  const auto in_window = [&](double centre, double half) {
    const auto count = [&](double from, double to) {
      return std::ranges::upper_bound(phase, to) - std::ranges::lower_bound(phase, from);
    };
    if (half >= 0.5) return static_cast<double>(phase.size());
    auto inside = count(centre - half, centre + half);
    if (centre < half) inside += count(centre - half + 1, 2);
    if (centre + half > 1) inside += count(-1, centre + half - 1);
    return static_cast<double>(inside);
  };
  const double half_window = 0.5 / r.period, n = static_cast<double>(phase.size());
  r.window_least = 1e300;
  constexpr int kPhases = 720;
  for (int i = 0; i < kPhases; ++i) {
    const double inside = in_window((i + 0.5) / kPhases, half_window);
    r.window_least = std::min(r.window_least, inside);
    r.window_most = std::max(r.window_most, inside);
    r.half_share = std::max(r.half_share, in_window((i + 0.5) / kPhases, 0.25) / n);
  }
}

// Cells of place and phase, row by row, and the views in each.
struct SamplingCells {
  int rows = 1, columns = 1;
  std::vector<int> held;
};

SamplingCells FillCells(const std::vector<double>& phase, bool moves, SamplingReport& r) {
  const auto n = static_cast<double>(phase.size());
  SamplingCells cells;
  const int side = std::clamp(static_cast<int>(std::sqrt(n / kViewsACell)), 2, kMostCells);
  cells.rows = moves ? side : 1;
  cells.columns = moves ? side : std::clamp(static_cast<int>(n / kViewsACell), 2, kMostCells * kMostCells);
  cells.held.assign(static_cast<std::size_t>(cells.rows * cells.columns), 0);
  const auto [low, high] = std::ranges::minmax_element(r.place);
  for (std::size_t i = 0; i < phase.size(); ++i) {
    const double share = moves ? (r.place[i] - *low) / (*high - *low) : 0;
    const int x = std::min(cells.columns - 1, static_cast<int>(phase[i] * cells.columns)),
              y = std::min(cells.rows - 1, static_cast<int>(share * cells.rows));
    ++cells.held[static_cast<std::size_t>(y * cells.columns + x)];
  }
  const auto filled = static_cast<double>(std::ranges::count_if(cells.held, [](int k) { return k > 0; }));
  r.covered = filled / static_cast<double>(cells.held.size());
  r.uniformity = r.covered / (1 - std::exp(-n / static_cast<double>(cells.held.size())));
  return cells;
}

// Runs of empty cells along the phase, in each row of places; the longest are named.
void NameGaps(const SamplingCells& cells, SamplingReport& r) {
  const int rows = cells.rows, columns = cells.columns;
  struct Run {
    int row, from, length;
  };
  std::vector<Run> runs;
  for (int y = 0; y < rows; ++y) {
    const auto empty = [&](int x) {
      return cells.held[static_cast<std::size_t>(y * columns + (x % columns + columns) % columns)] == 0;
    };
    int filled_at = 0;
    while (filled_at < columns && empty(filled_at)) ++filled_at;
    if (filled_at == columns) {
      runs.push_back({y, 0, columns});
      continue;
    }
    int length = 0;
    for (int k = 1; k <= columns; ++k) {
      if (empty(filled_at + k)) {
        ++length;
      } else {
        if (length > 0) runs.push_back({y, (filled_at + k - length) % columns, length});
        length = 0;
      }
    }
  }
  std::ranges::stable_sort(runs, [](const Run& a, const Run& b) { return a.length > b.length; });
  for (const Run& run : runs) {
    if (run.length < 2 && columns > 4) continue;  // one empty cell is chance
    if (r.gaps.size() == kGapsNamed) break;
    SamplingGap gap;
    gap.phase_from = static_cast<double>(run.from) / columns;
    gap.phase_to = static_cast<double>((run.from + run.length) % columns) / columns;
    if (gap.phase_to == 0) gap.phase_to = 1;
    gap.place_from = static_cast<double>(run.row) / rows;
    gap.place_to = static_cast<double>(run.row + 1) / rows;
    const std::string where = rows == 1 ? "from anywhere"
                                        : fmt::format("with the camera {} to {} % of its way", Percent(gap.place_from),
                                                      Percent(gap.place_to));
    gap.what_to_film = fmt::format("film phases {:.2f} to {:.2f} {}", gap.phase_from, gap.phase_to, where);
    r.gaps.push_back(gap);
  }
}

// p camera periods in q of the scene's: the pattern repeats after these. It leaves gaps where it repeats within the
// video, to within less than the phase that cells are wide.
void FindCommonPeriod(const std::vector<SampledView>& views, SamplingReport& r) {
  const double ratio = r.camera_period / r.period;
  double begin = views[0].time, end = begin;
  for (const SampledView& v : views) begin = std::min(begin, v.time), end = std::max(end, v.time);
  const double cycles = (end - begin) / r.period;
  for (int sum = 2; sum <= 2 * kLargestRatio; ++sum)
    for (int q = 1; q < sum; ++q) {
      const int p = sum - q;
      if (p > kLargestRatio || q > kLargestRatio) continue;
      // The drift of the phase over the whole video, where every p camera periods move it by the same small amount.
      const double slip = std::abs(p * ratio - q) * cycles / std::max(1.0, p * ratio);
      if (!(slip < 0.5 / std::max(p, q))) continue;
      r.commensurate = static_cast<double>(q) / p;
      r.commensurate_p = p;
      r.commensurate_q = q;
      return;
    }
}

void WarnOfSampling(bool moves, SamplingReport& r) {
  if (r.half_share > kAllInHalf)
    r.warnings.push_back(
        fmt::format("{} % of the views lie in one half of the period: the other half will be blurred from views far in "
                    "time; film on until every "
                    "phase was seen",
                    Percent(r.half_share)));
  if (!moves) r.warnings.push_back("the camera does not move: the scene can be rendered from one place only");
  if (r.commensurate > 0)
    r.warnings.push_back(
        fmt::format("the camera was waved in step with the scene: {} of its swings take {} of the scene's periods, so "
                    "that each phase is seen "
                    "from the same few places; wave it faster or slower, unevenly",
                    r.commensurate_p, r.commensurate_q));
  if (r.uniformity < kUneven && r.commensurate == 0)
    r.warnings.push_back(
        fmt::format("space and time are covered unevenly: {} % of their cells hold a view", Percent(r.covered)));
  if (r.window_least < 1) r.warnings.push_back("some phases were not filmed at all");
}

}  // namespace

SamplingReport ReportSampling(const std::vector<SampledView>& views, double period) {
  if (views.size() < 2) throw std::invalid_argument("a sampling report needs two views");
  if (!(period > 0)) throw std::invalid_argument("a sampling report needs a period");
  SamplingReport r;
  r.period = period;
  r.views = static_cast<int>(views.size());
  const auto n = static_cast<double>(views.size());
  r.samples_per_window = n / period;

  Vector3d mean = Vector3d::Zero();
  for (const SampledView& v : views) mean += v.centre / n;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(3, 3);
  for (const SampledView& v : views) scatter += (v.centre - mean) * (v.centre - mean).transpose();
  r.direction = EigenOfSymmetric(scatter).vectors.col(2);
  Eigen::Index axis = 0;
  r.direction.cwiseAbs().maxCoeff(&axis);
  if (r.direction[axis] < 0) r.direction = -r.direction;
  std::vector<double> phase;
  for (const SampledView& v : views) {
    r.place.push_back(r.direction.dot(v.centre - mean));
    phase.push_back(PhaseOf(v.time, period));
  }
  const auto [low, high] = std::ranges::minmax_element(r.place);
  const bool moves = *high - *low > 1e-9 * (1 + mean.cwiseAbs().maxCoeff());
  CountWindows(phase, r);
  NameGaps(FillCells(phase, moves, r), r);
  if (moves) r.camera_period = CameraPeriod(views, r.place);
  if (r.camera_period > 0) FindCommonPeriod(views, r);
  WarnOfSampling(moves, r);
  return r;
}

std::string SamplingPlot(const SamplingReport& r, const std::vector<SampledView>& views) {
  Plot over{"Camera over time",
            "thesis, Fig. 7-3, top",
            {"time, frames"},
            {"position along its main direction, world units"},
            {},
            {}};
  Plot folded{"Folded into one period",
              fmt::format("thesis, Fig. 7-3, bottom; {:.3g} views a frame, uniformity {:.2f}", r.samples_per_window,
                          r.uniformity),
              {"time in the period, frames"},
              {"position along its main direction, world units"},
              {},
              {}};
  PlotSeries path{"", "#1f6feb", Marker::kNone, true, false, false, {}},
      all{"views", "#1f6feb", Marker::kCross, false, false, false, {}};
  PlotSeries inside{"in the window", "#d1242f", Marker::kCircle, false, false, false, {}};
  // The window about the middle of the period (Fig. 7-4), drawn five times as wide as it is.
  const double middle = 0.5 * r.period;
  int in_window = 0;
  PlotSeries near{"other views", "#1f6feb", Marker::kCross, false, false, false, {}};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double t = PhaseOf(views[i].time, r.period) * r.period;
    const std::string tip = fmt::format("frame {}: {:.2f}", views[i].frame, t);
    path.points.push_back({views[i].time, r.place[i], "", ""});
    all.points.push_back({t, r.place[i], "", tip});
    if (std::abs(t - middle) <= 0.5) {
      inside.points.push_back({t, r.place[i], "", tip});
      ++in_window;
    } else if (std::abs(t - middle) <= 2.5) {
      near.points.push_back({t, r.place[i], "", tip});
    }
  }
  over.series = {path};
  folded.series = {all};
  Plot window{"A window of one frame",
              fmt::format("thesis, Fig. 7-4; {} views in it", in_window),
              {"time in the period, frames"},
              {"position along its main direction, world units"},
              {},
              {}};
  window.series = {near, inside};
  window.marks = {{middle - 0.5, ""}, {middle + 0.5, ""}};
  return SvgOf({over, folded, window});
}

}  // namespace lumi
