#include "reconstruct/synchronise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "scene/files/video.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr int kWidth = 160;
constexpr double kCoding = 8;               // grey values: changes of a pixel that coding and noise make
constexpr double kLeastChange = 0.02;       // grey values, mean over the picture: a still one
constexpr double kLeastCorrelation = 0.35;  // unrelated signals of a hundred frames stay below 0.3
constexpr double kAsGood = 0.95;
constexpr int kNeighbourhood = 2;  // lags around a peak that belong to it
constexpr int kLeastOverlap = 8;
constexpr double kStill = 1e-12;  // variance of a signal that says nothing: rounding

// Of a and b shifted, over the frames that both have; the first frame has no change.
double Correlation(const std::vector<double>& a, const std::vector<double>& b, int lag, int least) {
  const int first = std::max(1, 1 + lag), last = std::min(static_cast<int>(a.size()), static_cast<int>(b.size()) + lag);
  const int n = last - first;
  if (n < least) return 0;
  double ma = 0, mb = 0;
  for (int i = first; i < last; ++i)
    ma += a[static_cast<std::size_t>(i)] / n, mb += b[static_cast<std::size_t>(i - lag)] / n;
  double ab = 0, aa = 0, bb = 0;
  for (int i = first; i < last; ++i) {
    const double x = a[static_cast<std::size_t>(i)] - ma, y = b[static_cast<std::size_t>(i - lag)] - mb;
    ab += x * y;
    aa += x * x;
    bb += y * y;
  }
  return aa > kStill * n && bb > kStill * n ? ab / std::sqrt(aa * bb) : 0;
}

}  // namespace

double CommonFrame(const VideoClock& clock, double time_s, double fps) {
  constexpr double kWhole = 1e-6;
  const double frame = clock.TimeOf(time_s) * fps;
  return std::abs(frame - std::round(frame)) < kWhole ? std::round(frame) : frame;
}

std::vector<double> OnCommonClock(const std::vector<double>& frames, const std::vector<double>& values) {
  std::vector<double> at;
  std::size_t i = 1;
  for (long k = 0; !frames.empty() && static_cast<double>(k) <= std::round(frames.back()); ++k) {
    const auto wanted = static_cast<double>(k);
    if (k == 0 || frames.size() == 1) {
      at.push_back(values[0]);
      continue;
    }
    while (i + 1 < frames.size() && frames[i] < wanted) ++i;
    const double share = i == 1 ? 1 : std::clamp((wanted - frames[i - 1]) / (frames[i] - frames[i - 1]), 0.0, 1.0);
    at.push_back(share == 1 ? values[i] : (1 - share) * values[i - 1] + share * values[i]);
  }
  return at;
}

MotionSignal MeasureMotion(const std::filesystem::path& video, const VideoClock& clock, double fps,
                           ProgressSink& sink) {
  VideoReader reader(video);
  MotionSignal signal;
  signal.fps = fps;
  std::vector<double> frames;
  Progress progress(sink, "looking for what moves in " + video.filename().string(), reader.frame_count_hint());
  cv::Mat before;
  while (auto frame = reader.Next()) {
    const cv::Mat rgb(frame->rgb.height, frame->rgb.width, CV_8UC3, frame->rgb.data.data());
    cv::Mat grey, small;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    const double scale = std::min(1.0, static_cast<double>(kWidth) / grey.cols);
    cv::resize(grey, small, cv::Size(), scale, scale, cv::INTER_AREA);
    small.convertTo(small, CV_32F);
    double change = 0;
    frames.push_back(CommonFrame(clock, frame->time_s, fps));
    if (!before.empty()) {
      const double lasted = frames.back() - frames[frames.size() - 2];
      // Coding makes whole pictures flicker in step with its groups of frames, alike in all videos: only what moves
      // counts.
      cv::Mat moved;
      cv::threshold(cv::abs(small - before) - kCoding, moved, 0, 0, cv::THRESH_TOZERO);
      change = std::log(kLeastChange + cv::mean(moved)[0] / lasted);
    }
    signal.change.push_back(change);
    before = small;
    progress.Step();
  }
  if (signal.change.empty()) throw InputError(video, "no frame can be read", "re-encode it: ffmpeg -i IN OUT.mp4");
  signal.change = OnCommonClock(frames, signal.change);
  return signal;
}

Lag FindLag(const MotionSignal& a, const MotionSignal& b) {
  const int n_a = static_cast<int>(a.change.size()), n_b = static_cast<int>(b.change.size());
  const int least = std::max(kLeastOverlap, std::min(n_a, n_b) / 2);
  std::vector<std::pair<int, double>> all;
  for (int lag = -n_b + 1; lag < n_a; ++lag) all.emplace_back(lag, Correlation(a.change, b.change, lag, least));
  Lag best;
  if (all.empty()) return best;
  const double top =
      std::ranges::max_element(all, [](const auto& x, const auto& y) { return x.second < y.second; })->second;
  if (!(top > 0)) return best;
  // Peaks that are nearly as high.
  std::vector<std::pair<int, double>> peaks;
  for (const auto& [lag, value] : all) {
    if (value < kAsGood * top) continue;
    if (!peaks.empty() && lag - peaks.back().first <= kNeighbourhood) {
      if (value > peaks.back().second) peaks.back() = {lag, value};
    } else {
      peaks.emplace_back(lag, value);
    }
  }
  std::ranges::sort(peaks, [](const auto& x, const auto& y) { return std::abs(x.first) < std::abs(y.first); });
  best.frames = peaks.front().first;
  best.correlation = peaks.front().second;
  best.rival = peaks.size() > 1 ? peaks[1].first : best.frames;
  return best;
}

Synchronisation Synchronise(const std::vector<MotionSignal>& signals,
                            const std::vector<std::filesystem::path>& videos) {
  const std::size_t n = signals.size();
  Synchronisation result;
  result.offsets.assign(n, 0);
  std::vector<bool> tied(n, false);
  if (n > 0) tied[0] = true;
  for (std::size_t step = 1; step < n; ++step) {
    Lag best;
    std::size_t from = 0, to = 0;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; tied[a] && b < n; ++b) {
        if (tied[b]) continue;
        const Lag lag = FindLag(signals[a], signals[b]);
        if (to == 0 || lag.correlation > best.correlation) best = lag, from = a, to = b;
      }
    if (best.correlation < kLeastCorrelation)
      throw DataError(fmt::format("what moves in {} does not go with any other video (correlation {:.2f})",
                                  videos[to].filename().string(), best.correlation),
                      "say how the videos start: --offsets-frames, one number a video in the order of their names",
                      videos[to]);
    tied[to] = true;
    result.offsets[to] = result.offsets[from] + best.frames;
    result.least_correlation = std::min(result.least_correlation, best.correlation);
    result.repeats = result.repeats || best.rival != best.frames;
  }
  const int least = n > 0 ? *std::ranges::min_element(result.offsets) : 0;
  for (int& offset : result.offsets) offset -= least;
  return result;
}

}  // namespace lumi
