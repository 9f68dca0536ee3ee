// The period finder on videos that it was not tuned on: painted ones of random periods, motions, noise and cameras.
//
//   period_bench [VIDEOS]     rows by kind of video, VIDEOS of each (default: 40)
//
// "Right": within 1 % of the true period, or of a third of a frame where fewer than two and a half periods were filmed.
// "Multiple": so near to a half, third, double or triple of it. Errors in sigmas are of right ones: their mean square
// is 1, and 95 % lie within two, where the finder knows its own error.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "tests/timeperiodic/painted_video.h"
#include "timeperiodic/align.h"
#include "timeperiodic/period.h"
#include "timeperiodic/signals.h"

namespace {

using namespace lumi;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kRight = 0.01;        // of the period
constexpr double kRightFrames = 0.33;  // where few periods are seen, at least

enum class Motion { kTurns, kSwings, kWavers };  // a wheel, a pendulum, a wheel that slows down and speeds up each turn

struct Kind {
  const char* name;
  Motion motion;
  double least_cycles, most_cycles;
  bool waved = false;
  double uneven_frames = 0;  // standard deviation of the times at which frames were taken, unknown to the finder
};

// Seeds of tests are small. Videos 90,000 ... showed where the finder fell short, and it was mended by them.
constexpr unsigned kSeed = 200'000;

struct Found {
  double truth = 0, period = 0, sigma = 0;
  int frames = 0, harmonics = 0;
  double drift_percent = 0;
  bool warned = false;
};

Found Try(const Kind& kind, unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  PaintedVideo video;
  video.seed = seed;
  // Periods are as likely to be twice as long as half as long.
  video.period = std::exp(between(std::log(7.0), std::log(60.0)));
  video.frames = static_cast<int>(std::ceil(video.period * between(kind.least_cycles, kind.most_cycles))) + 1;
  if (kind.most_cycles < 3) {
    video.period = between(14, 60);
    video.frames = static_cast<int>(std::ceil(video.period * between(kind.least_cycles, kind.most_cycles))) + 1;
  }
  video.noise = between(1, 8);
  video.other_blade = kind.motion == Motion::kTurns ? between(0, 0.8) : 0;
  if (kind.waved) {
    video.width = 128, video.height = 96;
    const double slow = between(15, 40), fast = between(5, 11), wide = between(3, 6);
    video.camera = [=](double t) -> Eigen::Vector2d {
      return {wide * std::sin(t / fast) + 1.2 * std::sin(t / slow + 1), 0.3 * wide * std::sin(1.4 * t / fast)};
    };
  }
  std::normal_distribution<double> uneven(0, kind.uneven_frames > 0 ? kind.uneven_frames : 1);
  std::vector<double> late(static_cast<std::size_t>(video.frames), 0.0);
  if (kind.uneven_frames > 0)
    for (double& l : late) l = uneven(random);
  const double period = video.period, start = between(0, 1), swing = between(0.06, 0.2), waver = between(0.03, 0.1);
  video.turns = [=](double frame) {
    const double turns = start + (frame + late[static_cast<std::size_t>(frame)]) / period;
    if (kind.motion == Motion::kSwings) return swing * std::sin(kTurn * turns);
    return kind.motion == Motion::kWavers ? turns + waver * std::sin(kTurn * turns) : turns;
  };
  Found found{video.period, 0, 0};
  try {
    const FrameStack stack = video.Stack();
    PeriodEstimate e;
    if (kind.waved) {
      const Alignment alignment = AlignFrames(stack, {}, SilentProgress());
      e = EstimatePeriod(MovingSignals(stack, alignment, {}), alignment.camera, {});
    } else {
      e = EstimatePeriod(FixedSignals(stack, {}), {}, {});
    }
    found.period = e.period_frames, found.sigma = e.sigma_frames;
    found.frames = video.frames, found.harmonics = e.harmonics, found.drift_percent = e.drifts ? e.drift_percent : 0;
    found.warned = !e.warnings.empty();
  } catch (const DataError&) {  // refused
  }
  return found;
}

double Quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(part * static_cast<double>(values.size())))];
}

void Row(const Kind& kind, int videos) {
  std::vector<Found> all(static_cast<std::size_t>(videos));
  ParallelEach(all.size(), 1, [&](std::size_t i) { all[i] = Try(kind, kSeed + static_cast<unsigned>(i)); });
  int refused = 0, right = 0, multiple = 0, warned_right = 0, warned_else = 0;
  std::vector<double> percent, sigmas;
  double square = 0;
  for (const Found& f : all) {
    refused += f.period == 0;
    if (f.period == 0) continue;
    const auto near = [&](double truth) {
      return std::abs(f.period - truth) <= std::max(kRight * truth, kind.most_cycles < 3 ? kRightFrames : 0);
    };
    (near(f.truth) ? warned_right : warned_else) += f.warned;
    if (!near(f.truth)) {
      multiple += std::ranges::any_of(std::vector{0.5, 1 / 3.0, 2.0, 3.0}, [&](double m) { return near(m * f.truth); });
      continue;
    }
    ++right;
    percent.push_back(100 * std::abs(f.period / f.truth - 1));
    sigmas.push_back(std::abs(f.period - f.truth) / f.sigma);
    square += sigmas.back() * sigmas.back();
    constexpr double kFar = 4;
    if (sigmas.back() > kFar)
      fmt::print(stderr, "{}, video {}: {:.5f} for {:.5f}, sigma {:.5f}; {} frames, {} harmonics, drift {:.2f} %\n",
                 kind.name, &f - all.data(), f.period, f.truth, f.sigma, f.frames, f.harmonics, f.drift_percent);
  }
  const auto within = std::ranges::count_if(sigmas, [](double s) { return s <= 2; });
  fmt::print("| {} | {} | {} | {} | {} | {} | {} of {} | {} of {} | {:.4f} | {:.2f} | {} % |\n", kind.name, videos,
             right, multiple, videos - right - multiple - refused, refused, warned_right, right, warned_else,
             videos - right - refused, Quantile(percent, 0.5), right ? std::sqrt(square / right) : 0,
             right ? 100 * within / right : 0);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int videos = argc > 1 ? std::max(1, std::atoi(argv[1])) : 40;
  std::printf(
      "| video | videos | right | a multiple | another | refused | with a warning: right ones | others | error %%, "
      "median | error in sigmas, rms | within two |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Kind& kind : {Kind{"a wheel, 3 to 20 turns", Motion::kTurns, 3, 20},
                           Kind{"a wheel that wavers, 3 to 20 turns", Motion::kWavers, 3, 20},
                           Kind{"a pendulum, 3 to 20 swings", Motion::kSwings, 3, 20},
                           Kind{"a wheel, camera waved, 8 to 20 turns", Motion::kTurns, 8, 20, true},
                           Kind{"a pendulum, camera waved, 8 to 20 swings", Motion::kSwings, 8, 20, true},
                           Kind{"a wheel, 1.5 to 2.5 turns", Motion::kTurns, 1.5, 2.5},
                           Kind{"a pendulum, 1.5 to 2.5 swings", Motion::kSwings, 1.5, 2.5},
                           Kind{"the same, frames uneven by 0.5", Motion::kSwings, 1.5, 2.5, false, 0.5}})
    Row(kind, videos);
}
