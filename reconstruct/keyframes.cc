#include "reconstruct/keyframes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "scene/files/video.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr int kAnalysisWidth = 480;
constexpr int kCorners = 300;
constexpr double kCornerQuality = 0.01;
constexpr double kCornerDistancePx = 8;
// Fewer corners followed than this fraction: the frames show different things.
constexpr double kCutFraction = 0.2;

cv::Mat SmallGrey(const Image8& rgb) {
  const cv::Mat view(rgb.height, rgb.width, CV_8UC3, const_cast<std::uint8_t*>(rgb.data.data()));
  cv::Mat small, grey;
  const double scale = std::min(1.0, static_cast<double>(kAnalysisWidth) / rgb.width);
  cv::resize(view, small, cv::Size(), scale, scale, cv::INTER_AREA);
  cv::cvtColor(small, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

double Sharpness(const cv::Mat& grey) {
  cv::Mat laplacian;
  cv::Laplacian(grey, laplacian, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

}  // namespace

VideoStatistics AnalyseVideo(const std::filesystem::path& video, ProgressSink& sink) {
  VideoReader reader(video);
  VideoStatistics statistics;
  statistics.width_px = reader.width();
  statistics.height_px = reader.height();
  statistics.fps = reader.fps();
  Progress progress(sink, "reading the video", reader.frame_count_hint());
  cv::Mat previous;
  while (auto frame = reader.Next()) {
    cv::Mat grey = SmallGrey(frame->rgb);
    FrameStatistics s;
    s.time_s = frame->time_s;
    s.sharpness = Sharpness(grey);
    if (!previous.empty()) {
      std::vector<cv::Point2f> corners, moved;
      cv::goodFeaturesToTrack(previous, corners, kCorners, kCornerQuality, kCornerDistancePx);
      std::vector<float> steps;
      if (!corners.empty()) {
        std::vector<unsigned char> found;
        std::vector<float> error;
        cv::calcOpticalFlowPyrLK(previous, grey, corners, moved, found, error);
        for (std::size_t i = 0; i < corners.size(); ++i)
          if (found[i]) steps.push_back(static_cast<float>(cv::norm(moved[i] - corners[i])));
      }
      s.cut =
          !corners.empty() && static_cast<double>(steps.size()) < kCutFraction * static_cast<double>(corners.size());
      s.step = Median(std::move(steps)) / grey.cols;
    }
    statistics.frames.push_back(s);
    previous = grey;
    progress.Step();
  }
  statistics.truncated = reader.truncated();
  for (const std::string& remark : reader.remarks()) sink.Message(remark);
  if (statistics.frames.empty()) throw InputError(video, "no frame can be read", "re-encode it: ffmpeg -i IN OUT.mp4");
  return statistics;
}

std::vector<int> SelectKeyframes(const std::vector<FrameStatistics>& frames, const KeyframeOptions& options) {
  // How far the image has moved in all when frame i was taken. Steps below the tracker's own noise are no movement.
  constexpr double kTrackerNoise = 2e-4;
  std::vector<double> path(frames.size(), 0);
  for (std::size_t i = 1; i < frames.size(); ++i)
    path[i] =
        path[i - 1] + (frames[i].step > kTrackerNoise ? frames[i].step : 0) + (frames[i].cut ? options.spacing : 0);
  const double total = path.empty() ? 0 : path.back();

  std::vector<int> keyframes;
  double spacing = options.spacing;
  if (options.count > 1)
    spacing = total / (options.count - 1);
  else if (total / spacing > options.usual_count - 1)
    spacing =
        std::max(std::min(total / (options.usual_count - 1), options.max_spacing), total / (options.max_count - 1));
  if (!(total > 0) || total < 0.5 * options.spacing) {
    if (!frames.empty()) keyframes.push_back(0);
    return keyframes;
  }
  const int places = static_cast<int>(std::floor(total / spacing + 0.5)) + 1;
  for (int k = 0; k < places; ++k) {
    const double place = std::min(total, k * spacing);
    const double from = place - options.window * spacing, to = place + options.window * spacing;
    int best = -1;
    for (auto i = static_cast<std::size_t>(std::ranges::lower_bound(path, from) - path.begin());
         i < path.size() && path[i] <= to; ++i) {
      if (!keyframes.empty() && static_cast<int>(i) <= keyframes.back()) continue;
      if (best < 0 || frames[i].sharpness > frames[static_cast<std::size_t>(best)].sharpness)
        best = static_cast<int>(i);
    }
    if (best < 0) {  // the camera jumped over the window: the first frame beyond
      const auto i = static_cast<std::size_t>(std::ranges::lower_bound(path, place) - path.begin());
      if (i < path.size() && (keyframes.empty() || static_cast<int>(i) > keyframes.back())) best = static_cast<int>(i);
    }
    if (best >= 0) keyframes.push_back(best);
  }
  return keyframes;
}

}  // namespace lumi
