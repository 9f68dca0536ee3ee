#include "scene/files/video_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kRounding_s = 1.1e-3;   // containers count milliseconds, some cut them off
constexpr double kRoundingShare = 0.25;  // of a step, at most
constexpr double kSame_s = 1e-6;         // times that are one
constexpr double kMostMadeUp = 0.02;     // of the frames ...
constexpr int kFewMadeUp = 2;            // ... and never fewer: the last frames of many files have none
constexpr double kMostSteps = 20;        // usual steps from the first frame to the last, for each frame ...
constexpr double kAnyway_s = 60;         // ... or a pause of so long: somebody who films in parts

double RoundingOf(double step_s) { return std::min(kRounding_s, kRoundingShare * step_s); }

// Whole steps from the first frame to each: each step rounded by itself, so that a rate that is slightly off adds up to
// nothing.
std::vector<double> StepsOf(const std::vector<double>& times_s, double step_s) {
  std::vector<double> steps{0};
  for (std::size_t i = 1; i < times_s.size(); ++i)
    steps.push_back(steps.back() + std::max(1.0, std::round((times_s[i] - times_s[i - 1]) / step_s)));
  return steps;
}

bool StandOn(const std::vector<double>& times_s, const std::vector<double>& steps, double step_s) {
  for (std::size_t i = 0; i < times_s.size(); ++i)
    if (std::abs(times_s[i] - times_s[0] - steps[i] * step_s) > RoundingOf(step_s)) return false;
  return true;
}

// The step of the straight line through all times: the rounding of hundreds of them averages out.
double FittedStep(const std::vector<double>& times_s, const std::vector<double>& steps) {
  const auto n = static_cast<double>(times_s.size());
  double mean_t = 0, mean_k = 0, tk = 0, kk = 0;
  for (std::size_t i = 0; i < times_s.size(); ++i) mean_t += times_s[i] / n, mean_k += steps[i] / n;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    tk += (times_s[i] - mean_t) * (steps[i] - mean_k);
    kk += (steps[i] - mean_k) * (steps[i] - mean_k);
  }
  return kk > 0 ? tk / kk : 0;
}

}  // namespace

double UsualStep(const std::vector<double>& times_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times_s.size(); ++i) steps.push_back(times_s[i] - times_s[i - 1]);
  return Median(std::move(steps));
}

VideoClock::VideoClock(const VideoTimes& times) {
  const std::vector<double>& t = times.time_s;
  const double usual = UsualStep(t);
  if (!(usual > 0)) {
    fps_ = times.fps > 0 ? times.fps : times.average_fps > 0 ? times.average_fps : fps_;
    return;
  }
  const std::vector<double> steps = StepsOf(t, usual);
  on_grid_ = false;
  // The rate that the file states, where its times agree: it is exact. (The average over them has their rounding.)
  for (const double fps : {times.fps, 1 / FittedStep(t, steps)})
    if (!on_grid_ && std::isfinite(fps) && fps > 0 && StandOn(t, steps, 1 / fps)) {
      on_grid_ = true;
      fps_ = fps;
    }
  if (!on_grid_) fps_ = 1 / usual;
  gaps_ = steps.back() + 0.5 > static_cast<double>(t.size());
}

double VideoClock::TimeOf(double time_s) const {
  if (!on_grid_) return time_s;
  const double step = std::round(time_s * fps_);
  return std::abs(time_s - step / fps_) <= RoundingOf(1 / fps_) ? step / fps_ : time_s;
}

void RequireUsable(const VideoTimes& times, const std::filesystem::path& video) {
  const auto n = static_cast<int>(times.time_s.size());
  const double rate = times.fps > 0 ? times.fps : 30;
  const std::string way_out = fmt::format(
      "where the frames are evenly spaced: ffmpeg -i IN -vf setpts=N/{0:.6g}/TB -r {0:.6g} OUT.mp4 gives them times",
      rate);
  if (times.times_made_up > std::max<double>(kFewMadeUp, kMostMadeUp * n) && times.times_made_up + 1 < n)
    throw DataError(
        fmt::format("the times of {} of {} frames are missing or do not increase: when they were taken is not known",
                    times.times_made_up, n),
        way_out, video);
  if (n < 2) return;
  const double span = times.time_s.back() - times.time_s.front(), usual = UsualStep(times.time_s);
  if (span > kMostSteps * usual * n + kAnyway_s)
    throw DataError(fmt::format("the times of its {} frames reach over {:.0f} s, with {:.0f} s between two of them", n,
                                span, times.largest_gap_s),
                    "cut the video there; " + way_out, video);
}

VideoTimes ReadUsableTimes(const std::filesystem::path& video) {
  VideoTimes times = ReadVideoTimes(video);
  RequireUsable(times, video);
  return times;
}

double FilmLength_s(const std::vector<double>& times_s, double fps) {
  if (times_s.empty()) return 0;
  return times_s.back() - times_s.front() + (times_s.size() > 1 ? UsualStep(times_s) : 1 / fps);
}

std::vector<int> ShownAtRate(const std::vector<double>& times_s, double length_s, double fps) {
  std::vector<int> shown(times_s.size(), 0);
  const long count = std::max(1L, std::lround(length_s * fps));
  std::size_t at = 0;
  for (long k = 0; !times_s.empty() && k < count; ++k) {
    const double t = times_s.front() + static_cast<double>(k) / fps;
    while (at + 1 < times_s.size() && times_s[at + 1] - t < t - times_s[at] - kSame_s) ++at;
    ++shown[at];
  }
  return shown;
}

bool AreEven(const std::vector<double>& times_s, double fps) {
  for (std::size_t i = 0; i < times_s.size(); ++i)
    if (std::abs(times_s[i] - times_s[0] - static_cast<double>(i) / fps) > kSame_s) return false;
  return true;
}

}  // namespace lumi
