// How well a moving camera's video covers space and time (thesis, section 7.2.1, Figs. 7-3 and 7-4): positions against
// time, folded into one period, and what is missing.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace lumi {

struct SampledView {
  double time = 0;                                   // frames, or any unit that the period is in
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of the camera, world
  int frame = 0;
};

struct SamplingGap {
  double phase_from = 0, phase_to = 0;  // shares of the period; from > to runs over the wrap
  double place_from = 0, place_to = 0;  // along the main direction, share of the way that the camera went (0 to 1)
  std::string what_to_film;
};

struct SamplingReport {
  double period = 0;
  int views = 0;
  double samples_per_window = 0;             // views / period (the thesis's #samples)
  double window_least = 0, window_most = 0;  // views in windows of one unit of time, over all phases
  // Of the plane of phase and place, in cells that hold kViewsACell views on average: the share of cells with at least
  // one, over what as many views at random would reach (1 - 1/e^kViewsACell). 1 and more: uniform.
  double uniformity = 0;
  double covered = 0;       // share of these cells with at least one view
  double half_share = 0;    // most views that any half of the period holds, share: 0.5 is even, 1 all in one half
  double commensurate = 0;  // q / p: p camera periods last about q of the scene, for small p and q; else 0
  int commensurate_p = 0, commensurate_q = 0;
  double camera_period = 0;       // of its strongest oscillation, in the period's unit; 0: it does not oscillate
  std::vector<SamplingGap> gaps;  // largest first
  std::vector<std::string> warnings;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // that the camera moved in most, unit, world
  std::vector<double> place;                             // of each view along it, world units about the mean
};

// Needs two views and more, a period > 0. Throws std::invalid_argument.
SamplingReport ReportSampling(const std::vector<SampledView>& views, double period);

// Figs. 7-3 (top, bottom) and 7-4 as one SVG. unit: "frames".
std::string SamplingPlot(const SamplingReport& report, const std::vector<SampledView>& views);

}  // namespace lumi
