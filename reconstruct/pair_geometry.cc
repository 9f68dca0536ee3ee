#include "reconstruct/pair_geometry.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

// COLMAP 3.8's: of the fundamental matrix's inliers, those that the essential matrix must have so that the focal
// lengths are believed; of an epipolar geometry's inliers, those of a homography from which on it is one; the border,
// of the diagonal, and the share of inliers that stand there and are shifted alike: a watermark.
constexpr double kMinEssentialShare = 0.95;
constexpr double kMaxHomographyShare = 0.8;
constexpr double kWatermarkBorder = 0.1;
constexpr double kWatermarkShare = 0.7;

struct Model {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  std::vector<char> inlier;
  int count = 0;
};

// A model of USAC's, its inliers counted anew by `squared_error` of each match: what is in the mask then does not
// depend on how OpenCV scored it.
template <typename SquaredError>
Model Checked(const cv::Mat& found, const PairGeometryOptions& o, std::size_t n, const SquaredError& squared_error) {
  Model model;
  if (found.rows != 3 || found.cols != 3) return model;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) model.matrix(i, j) = found.at<double>(i, j);
  const double norm = model.matrix.norm();
  if (!std::isfinite(norm) || !(norm > 0)) return {};
  model.matrix /= norm;
  model.inlier.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    model.count += model.inlier[i] = squared_error(model.matrix, i) <= o.max_error_px * o.max_error_px;
  if (model.count < o.min_inliers) return {};
  return model;
}

struct Points {
  std::vector<cv::Point2d> a, b;
};

double SquaredSampson(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d line_b = F * a.homogeneous(), line_a = F.transpose() * b.homogeneous();
  const double product = b.homogeneous().dot(line_b);
  return product * product / (line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm());
}

// Infinity, or not a number, where H maps it to infinity: no inlier.
double SquaredTransfer(const Eigen::Matrix3d& H, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return ((H * a.homogeneous()).hnormalized() - b).squaredNorm();
}

Eigen::Vector2d At(const std::vector<cv::Point2d>& points, std::size_t i) { return {points[i].x, points[i].y}; }

cv::UsacParams Params(const PairGeometryOptions& o, double threshold) {
  cv::UsacParams params;
  params.confidence = o.confidence;
  params.isParallel = false;
  params.maxIterations = o.max_trials;
  params.randomGeneratorState = static_cast<int>(o.seed % 1000003);
  params.threshold = threshold;
  return params;
}

// OpenCV throws where matches are degenerate in a way that it did not foresee.
template <typename Estimate>
cv::Mat Guarded(const Estimate& estimate) {
  try {
    return estimate();
  } catch (const cv::Exception&) {
    return {};
  }
}

Model Fundamental(const Points& x, const PairGeometryOptions& o) {
  cv::Mat mask;
  const cv::Mat F = Guarded([&] { return cv::findFundamentalMat(x.a, x.b, mask, Params(o, o.max_error_px)); });
  return Checked(F, o, x.a.size(),
                 [&](const Eigen::Matrix3d& m, std::size_t i) { return SquaredSampson(m, At(x.a, i), At(x.b, i)); });
}

Model Homography(const Points& x, const PairGeometryOptions& o) {
  cv::Mat mask;
  const cv::Mat H = Guarded([&] { return cv::findHomography(x.a, x.b, mask, Params(o, o.max_error_px)); });
  return Checked(H, o, x.a.size(),
                 [&](const Eigen::Matrix3d& m, std::size_t i) { return SquaredTransfer(m, At(x.a, i), At(x.b, i)); });
}

// Points on the plane z = 1; matches where a lens has no inverse are far off everything.
std::vector<cv::Point2d> Normalised(const std::vector<cv::Point2d>& x_px, const Camera& camera) {
  constexpr double kNowhere = 1e6;
  std::vector<cv::Point2d> x;
  for (std::size_t i = 0; i < x_px.size(); ++i) {
    const auto n = camera.Normalized(At(x_px, i));
    x.emplace_back(n ? n->x() : kNowhere, n ? n->y() : kNowhere);
  }
  return x;
}

Model Essential(const Points& x, const Camera& camera_a, const Camera& camera_b, const PairGeometryOptions& o) {
  // The error in pixels is that of the cameras' mean focal length, as COLMAP takes it.
  const double px = 2 / (1 / camera_a.FocalPx().mean() + 1 / camera_b.FocalPx().mean());
  const Points n{Normalised(x.a, camera_a), Normalised(x.b, camera_b)};
  const cv::Matx33d one = cv::Matx33d::eye();
  cv::Mat mask;
  const cv::Mat E = Guarded([&] {
    return cv::findEssentialMat(n.a, n.b, one, one, cv::noArray(), cv::noArray(), mask, Params(o, o.max_error_px / px));
  });
  return Checked(E, o, x.a.size(), [&](const Eigen::Matrix3d& m, std::size_t i) {
    return px * px * SquaredSampson(m, At(n.a, i), At(n.b, i));
  });
}

// Most inliers near the photos' borders, and most of these moved by one vector.
bool IsWatermark(const Points& x, const Camera& camera_a, const Camera& camera_b, const std::vector<char>& inlier,
                 const PairGeometryOptions& o) {
  const auto inside = [](const cv::Point2d& p, const Camera& camera) {
    const double border = kWatermarkBorder * std::hypot(camera.width_px, camera.height_px);
    return p.x >= border && p.y >= border && p.x <= camera.width_px - border && p.y <= camera.height_px - border;
  };
  std::vector<Eigen::Vector2d> shifts;
  int at_border = 0;
  for (std::size_t i = 0; i < inlier.size(); ++i) {
    if (!inlier[i]) continue;
    shifts.push_back(At(x.b, i) - At(x.a, i));
    at_border += !inside(x.a[i], camera_a) && !inside(x.b[i], camera_b);
  }
  const double enough = kWatermarkShare * static_cast<double>(shifts.size());
  if (shifts.empty() || at_border < enough) return false;
  // Where more than half agree on a shift, the median of each coordinate is that shift, to the error.
  std::vector<double> dx, dy;
  for (const Eigen::Vector2d& s : shifts) {
    dx.push_back(s.x());
    dy.push_back(s.y());
  }
  const Eigen::Vector2d shift(Median(std::move(dx)), Median(std::move(dy)));
  const auto alike =
      std::ranges::count_if(shifts, [&](const Eigen::Vector2d& s) { return (s - shift).norm() <= o.max_error_px; });
  return static_cast<double>(alike) >= enough;
}

// Whether a camera that only turned explains what the homography does: the rotation nearest to it, of the points.
bool IsRotation(const Model& H, const Points& x, const Camera& camera_a, const Camera& camera_b,
                const PairGeometryOptions& o) {
  Eigen::Matrix3d M = camera_b.K().inverse() * H.matrix * camera_a.K();
  if (M.determinant() < 0) M = -M;
  const Eigen::Matrix3d turn = camera_b.K() * NearestRotation(M) * camera_a.K().inverse();
  int agree = 0;
  for (std::size_t i = 0; i < x.a.size(); ++i)
    agree += H.inlier[i] && SquaredTransfer(turn, At(x.a, i), At(x.b, i)) <= o.max_error_px * o.max_error_px;
  return agree >= kMinEssentialShare * H.count;
}

}  // namespace

std::string Name(PairLabel label) {
  switch (label) {
    case PairLabel::kUndefined: return "undefined";
    case PairLabel::kDegenerate: return "degenerate";
    case PairLabel::kCalibrated: return "calibrated";
    case PairLabel::kUncalibrated: return "uncalibrated";
    case PairLabel::kPlanar: return "planar";
    case PairLabel::kPanoramic: return "panoramic";
    case PairLabel::kPlanarOrPanoramic: return "planar or panoramic";
    case PairLabel::kWatermark: return "watermark";
  }
  return {};
}

PairGeometry EstimatePairGeometry(const PairPhoto& a, const PairPhoto& b,
                                  const std::vector<std::pair<int, int>>& matches, const PairGeometryOptions& o) {
  PairGeometry geometry;
  geometry.label = PairLabel::kDegenerate;
  if (static_cast<int>(matches.size()) < o.min_inliers) return geometry;
  Points x;
  for (const auto& [i, j] : matches) {
    const Eigen::Vector2d &p = a.keypoints_px[static_cast<std::size_t>(i)],
                          &q = b.keypoints_px[static_cast<std::size_t>(j)];
    x.a.emplace_back(p.x(), p.y());
    x.b.emplace_back(q.x(), q.y());
  }
  const bool calibrated = a.focal_is_known && b.focal_is_known;
  const Model F = Fundamental(x, o), H = Homography(x, o);
  const Model E = calibrated ? Essential(x, a.camera, b.camera, o) : Model();
  const Model* best = nullptr;
  if (E.count > 0 && E.count > kMinEssentialShare * F.count) {
    geometry.label = PairLabel::kCalibrated;
    best = E.count >= F.count ? &E : &F;
    if (H.count > kMaxHomographyShare * E.count) geometry.label = PairLabel::kPlanarOrPanoramic;
  } else if (F.count > 0) {
    geometry.label = PairLabel::kUncalibrated;
    best = &F;
    if (H.count > kMaxHomographyShare * F.count) geometry.label = PairLabel::kPlanarOrPanoramic;
  } else if (H.count > 0) {
    geometry.label = PairLabel::kPlanarOrPanoramic;
    best = &H;
  } else {
    return geometry;
  }
  if (geometry.label == PairLabel::kPlanarOrPanoramic) {
    if (H.count > best->count) best = &H;
    if (calibrated)
      geometry.label = IsRotation(H, x, a.camera, b.camera, o) ? PairLabel::kPanoramic : PairLabel::kPlanar;
  }
  if (IsWatermark(x, a.camera, b.camera, best->inlier, o)) geometry.label = PairLabel::kWatermark;
  geometry.F = F.matrix;
  geometry.E = E.matrix;
  geometry.H = H.matrix;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (best->inlier[i]) geometry.inliers.push_back(matches[i]);
  return geometry;
}

}  // namespace lumi
