#include "reconstruct/place_camera.h"

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace lumi {
namespace {

constexpr int kRansacRounds = 1000;
constexpr double kRansacConfidence = 0.9999;

// Points and pixels as OpenCV's solvers take them: the lens taken away, coordinates relative to the points' middle.
struct Correspondences {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  cv::Matx33d K;
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;  // K's principal point and these share one origin, so no conversion is due
  std::vector<std::size_t> source;  // position in what was seen
};

Correspondences Prepare(const std::vector<Sighting>& seen, const std::vector<Point>& points, const Camera& camera) {
  Correspondences c;
  const Eigen::Matrix3d K = camera.K();
  c.K = cv::Matx33d(K(0, 0), K(0, 1), K(0, 2), K(1, 0), K(1, 1), K(1, 2), K(2, 0), K(2, 1), K(2, 2));
  for (const auto& [point, x] : seen)
    c.middle += points[static_cast<std::size_t>(point)].x_in_world / static_cast<double>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto n = camera.Normalized(seen[i].second);
    if (!n) continue;
    const Eigen::Vector3d X = points[static_cast<std::size_t>(seen[i].first)].x_in_world - c.middle;
    const Eigen::Vector2d x = (K * n->homogeneous()).head<2>();
    c.world.emplace_back(X.x(), X.y(), X.z());
    c.pixels.emplace_back(x.x(), x.y());
    c.source.push_back(i);
  }
  return c;
}

// Which correspondences a pose agrees with.
std::vector<int> Agreeing(const Correspondences& c, const cv::Vec3d& rotation, const cv::Vec3d& translation) {
  cv::Matx33d R;
  cv::Rodrigues(rotation, R);
  std::vector<int> agreeing;
  for (std::size_t i = 0; i < c.world.size(); ++i) {
    const cv::Vec3d X = R * cv::Vec3d(c.world[i].x, c.world[i].y, c.world[i].z) + translation;
    if (!(X[2] > 0)) continue;
    const cv::Vec3d x = c.K * X;
    if (std::hypot(x[0] / x[2] - c.pixels[i].x, x[1] / x[2] - c.pixels[i].y) <= kMaxPoseErrorPx)
      agreeing.push_back(static_cast<int>(i));
  }
  return agreeing;
}

// Levenberg-Marquardt over the points that agree, twice: the second round takes in those that the first brought near.
PlacedCamera PolishPose(const std::vector<Sighting>& seen, const Correspondences& c, cv::Vec3d rotation,
                        cv::Vec3d translation) {
  constexpr int kRounds = 2;
  PlacedCamera placed;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<int> agreeing = Agreeing(c, rotation, translation);
    placed.inliers = static_cast<int>(agreeing.size());
    if (placed.inliers < kMinPointsOfPose) return placed;
    std::vector<cv::Point3d> world;
    std::vector<cv::Point2d> pixels;
    for (const int i : agreeing) {
      world.push_back(c.world[static_cast<std::size_t>(i)]);
      pixels.push_back(c.pixels[static_cast<std::size_t>(i)]);
    }
    cv::solvePnPRefineLM(world, pixels, c.K, cv::noArray(), rotation, translation);
  }
  const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]), t(translation[0], translation[1], translation[2]);
  if (!r.allFinite() || !t.allFinite()) return placed;
  const std::vector<int> agreeing = Agreeing(c, rotation, translation);
  placed.inliers = static_cast<int>(agreeing.size());
  if (placed.inliers < kMinPointsOfPose) return placed;
  const double angle = r.norm();
  placed.cam_from_world.rotation =
      angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, r / angle)) : Eigen::Quaterniond::Identity();
  placed.cam_from_world.translation = t - placed.cam_from_world.rotation * c.middle;
  for (const int i : agreeing) placed.observations.push_back(seen[c.source[static_cast<std::size_t>(i)]]);
  placed.ok = true;
  return placed;
}

}  // namespace

PlacedCamera PlaceCamera(const std::vector<Sighting>& seen, const std::vector<Point>& points, const Camera& camera) {
  const Correspondences c = Prepare(seen, points, camera);
  PlacedCamera placed;
  placed.inliers = static_cast<int>(c.world.size());
  if (placed.inliers < kMinPointsOfPose) return placed;
  cv::Vec3d rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(c.world, c.pixels, c.K, cv::noArray(), rotation, translation, false, kRansacRounds,
                          static_cast<float>(kMaxPoseErrorPx), kRansacConfidence, inliers, cv::SOLVEPNP_P3P)) {
    placed.inliers = 0;
    return placed;
  }
  return PolishPose(seen, c, rotation, translation);
}

PlacedCamera PlaceCameraNear(const std::vector<Sighting>& seen, const std::vector<Point>& points, const Camera& camera,
                             const Rigid3& start) {
  const Correspondences c = Prepare(seen, points, camera);
  const Eigen::AngleAxisd turn(start.rotation);
  const Eigen::Vector3d r = turn.angle() * turn.axis(), t = start * c.middle;
  return PolishPose(seen, c, cv::Vec3d(r.x(), r.y(), r.z()), cv::Vec3d(t.x(), t.y(), t.z()));
}

}  // namespace lumi
