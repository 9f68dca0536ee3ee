#include "stabilize/score/corner_follower.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "scene/files/opencv_pixels.h"

namespace lumi::score {
namespace {

constexpr std::size_t kCorners = 300;  // aimed at in a frame
constexpr double kRefillBelow = 0.8;   // of kCorners
constexpr double kSpacing = 0.6;       // of sqrt(pixels / kCorners)
constexpr double kQuality = 0.001;     // of the strongest corner's strength
constexpr double kWeakestCorner =
    6e-5;  // OpenCV's units: a mean squared gradient of 1 (grey level / px)^2; 2 levels of noise give 0.6
constexpr int kWindowPx = 21, kLevels = 4;
constexpr double kForwardBackwardPx = 0.5;
constexpr double kCutShare = 0.15;  // fewer followed than this: a cut
constexpr std::size_t kCornersForCut = 20;
constexpr double kMarginPx = 3;

cv::Mat ViewOf(const Image8& grey) {
  return {grey.height, grey.width, CV_8UC1, const_cast<std::uint8_t*>(grey.data.data())};
}

}  // namespace

struct CornerFollower::Impl {
  std::vector<cv::Mat> previous;  // pyramid
  std::vector<FollowedCorner> alive;
  long next_track = 0;

  void Follow(const std::vector<cv::Mat>& pyramid, const cv::Size& size, FollowedFrame& result) {
    if (alive.empty()) return;
    std::vector<cv::Point2f> from, to, back;
    for (const FollowedCorner& c : alive) {
      const Eigen::Vector2d x = ToOpenCvPixel(c.x_px);
      from.emplace_back(static_cast<float>(x.x()), static_cast<float>(x.y()));
    }
    std::vector<unsigned char> there, here;
    std::vector<float> error;
    const cv::Size window(kWindowPx, kWindowPx);
    const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01);
    cv::calcOpticalFlowPyrLK(previous, pyramid, from, to, there, error, window, kLevels, criteria);
    cv::calcOpticalFlowPyrLK(pyramid, previous, to, back, here, error, window, kLevels, criteria);
    std::vector<FollowedCorner> still;
    for (std::size_t i = 0; i < alive.size(); ++i) {
      const bool inside = to[i].x > kMarginPx && to[i].y > kMarginPx &&
                          to[i].x < static_cast<float>(size.width - 1 - kMarginPx) &&
                          to[i].y < static_cast<float>(size.height - 1 - kMarginPx);
      if (!there[i] || !here[i] || !inside ||
          std::hypot(back[i].x - from[i].x, back[i].y - from[i].y) > kForwardBackwardPx)
        continue;
      const Eigen::Vector2d x_px = FromOpenCvPixel({to[i].x, to[i].y});
      result.steps.push_back({alive[i].x_px, x_px});
      still.push_back({alive[i].track, x_px});
    }
    if (alive.size() >= kCornersForCut &&
        static_cast<double>(still.size()) < kCutShare * static_cast<double>(alive.size())) {
      result.cut = true;
      result.steps.clear();
      still.clear();
    }
    alive = std::move(still);
  }

  void Refill(const cv::Mat& grey) {
    if (static_cast<double>(alive.size()) > kRefillBelow * kCorners) return;
    const double spacing_px =
        std::max(4.0, kSpacing * std::sqrt(static_cast<double>(grey.cols) * grey.rows / kCorners));
    cv::Mat free(grey.size(), CV_8UC1, cv::Scalar(255));
    for (const FollowedCorner& c : alive)
      cv::circle(free, cv::Point(static_cast<int>(c.x_px.x()), static_cast<int>(c.x_px.y())),
                 static_cast<int>(spacing_px), cv::Scalar(0), -1);
    std::vector<cv::Point2f> found;
    std::vector<float> strength;
    cv::goodFeaturesToTrack(grey, found, static_cast<int>(kCorners - alive.size()), kQuality, spacing_px, free,
                            strength, 5, 3, false, 0.04);
    for (std::size_t i = 0; i < found.size(); ++i)
      if (strength[i] > kWeakestCorner) alive.push_back({next_track++, FromOpenCvPixel({found[i].x, found[i].y})});
  }
};

CornerFollower::CornerFollower() : impl_(std::make_unique<Impl>()) {}
CornerFollower::~CornerFollower() = default;

FollowedFrame CornerFollower::Add(const Image8& image) {
  const cv::Mat grey = ViewOf(image);
  std::vector<cv::Mat> pyramid;
  FollowedFrame result;
  if (std::min(grey.cols, grey.rows) > kWindowPx) {
    cv::buildOpticalFlowPyramid(grey, pyramid, cv::Size(kWindowPx, kWindowPx), kLevels);
    if (!impl_->previous.empty()) impl_->Follow(pyramid, grey.size(), result);
    impl_->Refill(grey);
    if (impl_->alive.size() < kCornersForCut) result.cut = false;  // too few corners: a blank picture begins no shot
  }
  impl_->previous = std::move(pyramid);
  result.corners = impl_->alive;
  return result;
}

}  // namespace lumi::score
