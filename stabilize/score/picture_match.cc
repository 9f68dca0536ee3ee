#include "stabilize/score/picture_match.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "scene/files/opencv_pixels.h"

namespace lumi::score {
namespace {

constexpr int kFeatures = 1200;
constexpr int kFastThreshold = 10;  // of ORB's corners: shaky frames are blurred
constexpr int kPatchPx = 31;        // of ORB; smaller pictures have no features
constexpr double kRatio = 0.8;      // of the best to the second best match
constexpr int kEnough = 20;     // inliers; with fewer, corners are also followed from where a mere scaling puts them
constexpr int kRefining = 300;  // corners whose residual movement refines
constexpr double kResidualPx = 0.5;  // there and back

cv::Mat View(const Image8& grey) {
  return {grey.height, grey.width, CV_8UC1, const_cast<std::uint8_t*>(grey.data.data())};
}
Eigen::Vector2d Ours(const cv::Point2f& x) { return FromOpenCvPixel({x.x, x.y}); }

}  // namespace

struct PictureFeatures::Impl {
  cv::Mat grey;
  std::vector<cv::KeyPoint> keys;
  cv::Mat descriptors;
  Eigen::Vector2i size() const { return {grey.cols, grey.rows}; }
};

PictureFeatures::PictureFeatures(const Image8& grey) : impl_(std::make_unique<Impl>()) {
  impl_->grey = View(grey);
  if (std::min(grey.width, grey.height) > kPatchPx)
    cv::ORB::create(kFeatures, 1.2f, 8, kPatchPx, 0, 2, cv::ORB::HARRIS_SCORE, kPatchPx, kFastThreshold)
        ->detectAndCompute(impl_->grey, cv::noArray(), impl_->keys, impl_->descriptors);
}
PictureFeatures::~PictureFeatures() = default;
PictureFeatures::PictureFeatures(PictureFeatures&&) noexcept = default;
PictureFeatures& PictureFeatures::operator=(PictureFeatures&&) noexcept = default;

namespace {

std::vector<PointPair> MatchedFeatures(const PictureFeatures::Impl& input, const PictureFeatures::Impl& output) {
  std::vector<PointPair> pairs;
  if (input.keys.size() < 2 || output.keys.size() < 2) return pairs;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(output.descriptors, input.descriptors, matches, 2);
  for (const auto& m : matches)
    if (m.size() == 2 && m[0].distance < kRatio * m[1].distance)
      pairs.push_back({Ours(input.keys[static_cast<std::size_t>(m[0].trainIdx)].pt),
                       Ours(output.keys[static_cast<std::size_t>(m[0].queryIdx)].pt)});
  return pairs;
}

// Corners of the output against the input warped by a first homography.
std::optional<FittedHomography> Refined(const PictureFeatures::Impl& input, const PictureFeatures::Impl& output,
                                        const Eigen::Matrix3d& first) {
  // OpenCV's pixels: x_cv = x - 1/2.
  Eigen::Matrix3d half = Eigen::Matrix3d::Identity(), back = Eigen::Matrix3d::Identity();
  half.topRightCorner<2, 1>().setConstant(0.5);
  back.topRightCorner<2, 1>().setConstant(-0.5);
  const Eigen::Matrix3d in_cv = back * first * half;
  cv::Mat H(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) H.at<double>(r, c) = in_cv(r, c);
  cv::Mat warped;
  cv::warpPerspective(input.grey, warped, H, output.grey.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  std::vector<cv::Point2f> corners, there, here;
  cv::goodFeaturesToTrack(output.grey, corners, kRefining, 0.001,
                          std::max(4.0, 0.5 * std::sqrt(output.grey.total() / static_cast<double>(kRefining))),
                          cv::noArray(), 5);
  if (corners.empty()) return std::nullopt;
  std::vector<unsigned char> found, again;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(output.grey, warped, corners, there, found, error, cv::Size(21, 21), 2);
  cv::calcOpticalFlowPyrLK(warped, output.grey, there, here, again, error, cv::Size(21, 21), 2);
  const cv::Matx33d inverse = cv::Matx33d(H).inv();
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!found[i] || !again[i] || std::hypot(here[i].x - corners[i].x, here[i].y - corners[i].y) > kResidualPx)
      continue;
    const cv::Vec3d x = inverse * cv::Vec3d(there[i].x, there[i].y, 1);
    const Eigen::Vector2d from = FromOpenCvPixel({x[0] / x[2], x[1] / x[2]});
    if (!(from.x() > 1) || !(from.y() > 1) || !(from.x() < input.grey.cols - 1) || !(from.y() < input.grey.rows - 1))
      continue;
    pairs.push_back({from, Ours(corners[i])});
  }
  return FitHomography(pairs, InlierThresholdPx(output.size()));
}

}  // namespace

std::optional<FittedHomography> MatchPictures(const PictureFeatures& a, const PictureFeatures& b) {
  const PictureFeatures::Impl &input = a.impl(), &output = b.impl();
  std::optional<FittedHomography> best =
      FitHomography(MatchedFeatures(input, output), InlierThresholdPx(output.size()));
  const auto refine = [&](const Eigen::Matrix3d& first) {
    const auto refined = Refined(input, output, first);
    if (refined && (!best || refined->inliers >= std::min(best->inliers, kEnough))) best = refined;
  };
  if (best) refine(best->to_from);
  if (!best || best->inliers < kEnough) {
    Eigen::Matrix3d scaled = Eigen::Matrix3d::Identity();
    scaled(0, 0) = static_cast<double>(output.grey.cols) / input.grey.cols;
    scaled(1, 1) = static_cast<double>(output.grey.rows) / input.grey.rows;
    refine(scaled);
  }
  return best;
}

}  // namespace lumi::score
