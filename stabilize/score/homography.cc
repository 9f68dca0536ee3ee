#include "stabilize/score/homography.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"

namespace lumi::score {
namespace {

constexpr int kMinInliers = 8;
constexpr double kMinInlierShare = 0.2;
constexpr double kMostScale = 20;          // of a frame against another; beyond it the fit is an accident
constexpr double kThresholdShare = 0.002;  // of the diagonal: 1.5 px at 640 x 360
constexpr double kLeastThresholdPx = 1;
// Corners at the edge of something that moves are drawn along a little: those beyond so many medians are left out, and
// again.
constexpr double kSpread = 2.5, kLeastSpreadPx = 0.1;
constexpr int kRounds = 4;
constexpr int kIterations = 2000;
constexpr double kConfidence = 0.999;

// From pixels about the middles of both pictures.
Eigen::Matrix3d AboutMiddles(const Eigen::Matrix3d& H, const Eigen::Vector2i& from_px, const Eigen::Vector2i& to_px) {
  Eigen::Matrix3d shift = Eigen::Matrix3d::Identity(), back = Eigen::Matrix3d::Identity();
  shift.topRightCorner<2, 1>() = 0.5 * from_px.cast<double>();
  back.topRightCorner<2, 1>() = -0.5 * to_px.cast<double>();
  const Eigen::Matrix3d centred = back * H * shift;
  return centred / centred(2, 2);
}

// The area of a convex polygon's part with 0 < x < width, 0 < y < height (Sutherland, Hodgman 1974).
double AreaWithin(std::vector<Eigen::Vector2d> polygon, const Eigen::Vector2d& size) {
  for (int side = 0; side < 4; ++side) {
    const int axis = side / 2;
    const auto inside = [&](const Eigen::Vector2d& x) {
      return side % 2 == 0 ? x[axis] : size[axis] - x[axis];
    };  // >= 0 within
    std::vector<Eigen::Vector2d> clipped;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double at_a = inside(a), at_b = inside(b);
      if (at_a >= 0) clipped.push_back(a);
      if ((at_a >= 0) != (at_b >= 0)) clipped.push_back(a + at_a / (at_a - at_b) * (b - a));
    }
    polygon = std::move(clipped);
  }
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * std::abs(twice);
}

struct CvPairs {
  std::vector<cv::Point2d> from, to;
  explicit CvPairs(const std::vector<PointPair>& pairs) {
    for (const PointPair& p : pairs) {
      from.emplace_back(p.from_px.x(), p.from_px.y());
      to.emplace_back(p.to_px.x(), p.to_px.y());
    }
  }
};

std::optional<FittedHomography> Checked(const cv::Mat& found, const std::vector<unsigned char>& inlier) {
  if (found.empty()) return std::nullopt;
  FittedHomography fit;
  for (const unsigned char i : inlier) fit.inliers += i != 0;
  if (fit.inliers < std::max(kMinInliers, static_cast<int>(kMinInlierShare * static_cast<double>(inlier.size()))))
    return std::nullopt;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) fit.to_from(r, c) = found.at<double>(r, c);
  if (!fit.to_from.allFinite() || fit.to_from(2, 2) == 0) return std::nullopt;
  fit.to_from /= fit.to_from(2, 2);
  const double area = fit.to_from(0, 0) * fit.to_from(1, 1) - fit.to_from(0, 1) * fit.to_from(1, 0);
  if (!(area > 1 / (kMostScale * kMostScale)) || !(area < kMostScale * kMostScale)) return std::nullopt;
  return fit;
}

}  // namespace

double InlierThresholdPx(const Eigen::Vector2i& size_px) {
  return std::max(kLeastThresholdPx, kThresholdShare * size_px.cast<double>().norm());
}

std::optional<FittedHomography> FitHomography(const std::vector<PointPair>& pairs, double threshold_px) {
  if (pairs.size() < static_cast<std::size_t>(kMinInliers)) return std::nullopt;
  const CvPairs cv_pairs(pairs);
  std::vector<unsigned char> inlier;
  return Checked(
      cv::findHomography(cv_pairs.from, cv_pairs.to, cv::RANSAC, threshold_px, inlier, kIterations, kConfidence),
      inlier);
}

std::optional<FittedHomography> FitStep(const std::vector<PointPair>& pairs, double threshold_px) {
  if (pairs.size() < static_cast<std::size_t>(kMinInliers)) return std::nullopt;
  const CvPairs cv_pairs(pairs);
  std::vector<unsigned char> inlier;
  const cv::Mat similarity = cv::estimateAffinePartial2D(cv_pairs.from, cv_pairs.to, inlier, cv::RANSAC, threshold_px,
                                                         kIterations, kConfidence);
  if (similarity.empty()) return std::nullopt;
  std::vector<PointPair> agreeing;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (inlier[i]) agreeing.push_back(pairs[i]);
  std::optional<FittedHomography> fit;
  for (int round = 0; round < kRounds; ++round) {
    if (agreeing.size() < static_cast<std::size_t>(kMinInliers)) return fit;
    const CvPairs agreed(agreeing);
    const auto next = Checked(cv::findHomography(agreed.from, agreed.to), inlier);
    if (!next) return fit;
    fit = next;
    std::vector<double> residuals;
    for (const PointPair& p : agreeing)
      residuals.push_back(((fit->to_from * p.from_px.homogeneous()).hnormalized() - p.to_px).norm());
    const double limit_px = std::max(kLeastSpreadPx, kSpread * Median(residuals));
    std::size_t i = 0;
    if (std::erase_if(agreeing, [&](const PointPair&) { return residuals[i++] > limit_px; }) == 0) break;
  }
  return fit;
}

std::optional<PictureChange> ChangeOf(const Eigen::Matrix3d& output_from_input, const Eigen::Vector2i& input_px,
                                      const Eigen::Vector2i& output_px) {
  const auto input_from_output = InverseOf(output_from_input);
  if (!input_from_output) return std::nullopt;
  const Eigen::Matrix2d affine = AboutMiddles(output_from_input, input_px, output_px).topLeftCorner<2, 2>();
  const double area = affine(0, 0) * affine(1, 1) - affine(0, 1) * affine(1, 0);
  const Eigen::VectorXd singular = SingularValues(affine);
  if (!(area > 0) || !(singular[1] > 0)) return std::nullopt;
  PictureChange change;
  const double input_area = static_cast<double>(input_px.x()) * input_px.y(),
               output_area = static_cast<double>(output_px.x()) * output_px.y();
  change.cropping = std::sqrt(output_area / input_area / area);
  change.distortion = singular[1] / singular[0];
  std::vector<Eigen::Vector2d> seen;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d x = *input_from_output * Eigen::Vector3d(corner == 1 || corner == 2 ? output_px.x() : 0,
                                                                   corner >= 2 ? output_px.y() : 0, 1);
    // The middle's w is 1 up to the scale of the inverse; other signs are relative to it.
    const double w =
        x.z() * (input_from_output->row(2) * Eigen::Vector3d(0.5 * output_px.x(), 0.5 * output_px.y(), 1)).value();
    if (!(w > 0)) return std::nullopt;
    seen.push_back(x.hnormalized());
  }
  change.kept_area = AreaWithin(std::move(seen), input_px.cast<double>()) / input_area;
  return change;
}

Movement MovementOf(const Eigen::Matrix3d& next_from_this, const Eigen::Vector2i& size_px) {
  const Eigen::Matrix3d H = AboutMiddles(next_from_this, size_px, size_px);
  // (A x + t) / (1 + v x) at x = 0: its value is t, its Jacobian A - t v^T.
  const Eigen::Vector2d t = H.topRightCorner<2, 1>();
  const Eigen::Matrix2d J = H.topLeftCorner<2, 2>() - t * H.bottomLeftCorner<1, 2>();
  return {t, std::atan2(J(1, 0) - J(0, 1), J(0, 0) + J(1, 1))};
}

}  // namespace lumi::score
