#include "reconstruct/pair_geometry.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "scene/geometry/constants.h"
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
// Of least squares over the inliers, which are counted anew each time: since OpenCV 4.7 the best sample is all that
// USAC gives.
constexpr int kPolishingRounds = 3;
constexpr int kWeightingRounds = 4;
constexpr double kCauchyScalePerSigma = 2.4;  // 95 % as efficient as least squares on Gaussian noise
constexpr double kNearSigmas = 2.5;           // as far as right matches lie, but for one in a hundred

struct Model {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  std::vector<char> inlier;
  int count = 0;
  double typical_square = 0;  // the inliers' median squared error, px^2
};

struct Points {
  std::vector<cv::Point2d> a, b;
};

Eigen::Vector2d At(const std::vector<cv::Point2d>& points, std::size_t i) { return {points[i].x, points[i].y}; }

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
  std::vector<double> squares;
  const double most = o.max_error_px * o.max_error_px;
  for (std::size_t i = 0; i < n; ++i) {
    const double square = squared_error(model.matrix, i);
    model.inlier[i] = square <= most;
    if (model.inlier[i]) squares.push_back(square);
  }
  model.count = static_cast<int>(squares.size());
  if (model.count < o.min_inliers) return {};
  model.typical_square = Median(std::move(squares));
  return model;
}

double SquaredSampson(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d line_b = F * a.homogeneous(), line_a = F.transpose() * b.homogeneous();
  const double product = b.homogeneous().dot(line_b);
  return product * product / (line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm());
}

// Infinity, or not a number, where H maps it to infinity: no inlier.
double SquaredTransfer(const Eigen::Matrix3d& H, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return ((H * a.homogeneous()).hnormalized() - b).squaredNorm();
}

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

// `fit`: a matrix by least squares over points. It is given only the points that lie as near as right matches do, and
// the result is judged by the same points: wrong ones among the inliers lie anywhere within the largest error, and
// would bend it.
template <typename Fit, typename SquaredError>
Model Polished(const cv::Mat& found, const Points& x, const PairGeometryOptions& o, const Fit& fit,
               const SquaredError& squared_error) {
  Model model = Checked(found, o, x.a.size(), squared_error);
  const double most = std::pow(kNearSigmas * kSigmaPerMad, 2) * model.typical_square;
  const auto cost_of = [&](const Model& m) {
    double cost = 0;
    for (std::size_t i = 0; i < x.a.size(); ++i) {
      const double square = squared_error(m.matrix, i);
      cost += square <= most ? square : most;
    }
    return cost;
  };
  double cost = model.count > 0 ? cost_of(model) : 0;
  for (int round = 0; round < kPolishingRounds && model.count > 0; ++round) {
    Points near;
    for (std::size_t i = 0; i < x.a.size(); ++i)
      if (squared_error(model.matrix, i) <= most) near.a.push_back(x.a[i]), near.b.push_back(x.b[i]);
    Model better = Checked(Guarded([&] { return fit(near, model); }), o, x.a.size(), squared_error);
    if (better.count == 0 || cost_of(better) >= cost) break;
    cost = cost_of(better);
    model = std::move(better);
  }
  return model;
}

// To mean 0 and a mean distance of sqrt(2) (Hartley 1997).
Eigen::Matrix3d Normalisation(const std::vector<cv::Point2d>& points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) middle += At(points, i) / static_cast<double>(points.size());
  double distance = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    distance += (At(points, i) - middle).norm() / static_cast<double>(points.size());
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1;
  Eigen::Matrix3d T;
  T << scale, 0, -scale * middle.x(), 0, scale, -scale * middle.y(), 0, 0, 1;
  return T;
}

// The eight-point algorithm, each match weighted so that Sampson's error is what is minimised, and less the farther it
// lies (Cauchy's weights). px: a unit of the points, in pixels. values: what becomes of the singular values, largest
// first.
template <typename Values>
cv::Mat WeightedEightPoints(const Points& x, const Model& start, double px, const Values& values) {
  const Eigen::Matrix3d Ta = Normalisation(x.a), Tb = Normalisation(x.b);
  const double cauchy = std::pow(kCauchyScalePerSigma * kSigmaPerMad, 2) * start.typical_square / (px * px);
  Eigen::Matrix3d F = start.matrix;
  for (int round = 0; round < kWeightingRounds; ++round) {
    Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Zero();
    for (std::size_t i = 0; i < x.a.size(); ++i) {
      const Eigen::Vector3d a = At(x.a, i).homogeneous(), b = At(x.b, i).homogeneous();
      const double gradient = (F * a).head<2>().squaredNorm() + (F.transpose() * b).head<2>().squaredNorm();
      const double square = std::pow(b.dot(F * a), 2) / gradient;
      Eigen::Matrix<double, 9, 1> row;
      const Eigen::Vector3d na = Ta * a, nb = Tb * b;
      row << nb.x() * na, nb.y() * na, nb.z() * na;
      const double weight = 1 / (gradient * (1 + square / cauchy));
      if (std::isfinite(weight)) A.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(A);
    if (solver.info() != Eigen::Success) return {};
    const Eigen::Matrix<double, 9, 1> f = solver.eigenvectors().col(0);
    Eigen::Matrix3d N;
    N << f.segment<3>(0).transpose(), f.segment<3>(3).transpose(), f.segment<3>(6).transpose();
    const Eigen::Matrix3d any = Tb.transpose() * N * Ta;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(any, Eigen::ComputeFullU | Eigen::ComputeFullV);
    F = svd.matrixU() * values(svd.singularValues()).asDiagonal() * svd.matrixV().transpose();
    F /= F.norm();
  }
  cv::Mat found(3, 3, CV_64F);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) found.at<double>(i, j) = F(i, j);
  return found;
}

Model Fundamental(const Points& x, const PairGeometryOptions& o) {
  cv::Mat mask;
  const cv::Mat F = Guarded([&] { return cv::findFundamentalMat(x.a, x.b, mask, Params(o, o.max_error_px)); });
  const auto fit = [](const Points& near, const Model& model) {
    return WeightedEightPoints(near, model, 1, [](const Eigen::Vector3d& s) { return Eigen::Vector3d(s[0], s[1], 0); });
  };
  return Polished(F, x, o, fit,
                  [&](const Eigen::Matrix3d& m, std::size_t i) { return SquaredSampson(m, At(x.a, i), At(x.b, i)); });
}

Model Homography(const Points& x, const PairGeometryOptions& o) {
  cv::Mat mask;
  const cv::Mat H = Guarded([&] { return cv::findHomography(x.a, x.b, mask, Params(o, o.max_error_px)); });
  return Polished(
      H, x, o, [](const Points& near, const Model&) { return cv::findHomography(near.a, near.b); },
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
  const auto fit = [&](const Points& near, const Model& model) {
    return WeightedEightPoints(near, model, px, [](const Eigen::Vector3d&) { return Eigen::Vector3d(1, 1, 0); });
  };
  return Polished(E, n, o, fit, [&](const Eigen::Matrix3d& m, std::size_t i) {
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
    // If a homography has nearly as many inliers, an epipolar geometry's additional ones are wrong matches: two of its
    // parameters are then undetermined, and are spent on those.
    if (H.count > kMinEssentialShare * best->count) best = &H;
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
