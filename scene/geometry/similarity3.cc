#include "scene/geometry/similarity3.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

Eigen::Vector3d Mean(const std::vector<Eigen::Vector3d>& x) {
  Eigen::Vector3d m = Eigen::Vector3d::Zero();
  for (const auto& p : x) m += p;
  return m / static_cast<double>(x.size());
}

struct Moments {
  Eigen::Vector3d mean_source, mean_target;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // target source^T
  double source_variance = 0, target_variance = 0;
};

Moments ComputeMoments(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  Moments m;
  m.mean_source = Mean(source);
  m.mean_target = Mean(target);
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d s = source[i] - m.mean_source, t = target[i] - m.mean_target;
    m.covariance += t * s.transpose();
    m.source_variance += s.squaredNorm();
    m.target_variance += t.squaredNorm();
  }
  return m;
}

Similarity3 FromRotation(const Moments& m, const Eigen::Matrix3d& R) {
  Similarity3 s;
  s.scale = m.source_variance > 0 ? (R.transpose() * m.covariance).trace() / m.source_variance : 0.0;
  s.rotation = Eigen::Quaterniond(R);
  s.translation = m.mean_target - s.scale * (R * m.mean_source);
  return s;
}

}  // namespace

Rigid3 TransformPose(const Rigid3& cam_from_source, const Similarity3& target_from_source) {
  const Eigen::Vector3d centre = target_from_source * cam_from_source.OriginInSource();
  Rigid3 pose;
  pose.rotation = (cam_from_source.rotation * target_from_source.rotation.conjugate()).normalized();
  pose.translation = -(pose.rotation * centre);
  return pose;
}

Similarity3 AlignPoints(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  if (source.size() != target.size()) throw std::invalid_argument("AlignPoints: sizes differ");
  Similarity3 failed;
  failed.scale = 0;
  if (source.size() < 3) return failed;
  const Moments m = ComputeMoments(source, target);
  const Eigen::VectorXd singular = SingularValues(m.covariance);
  // The second singular value is zero for collinear points: the turn about their line is then free.
  if (!(singular[1] > 1e-12 * singular[0])) return failed;
  return FromRotation(m, NearestRotation(m.covariance));
}

Similarity3 AlignPoses(const std::vector<Rigid3>& cam_from_source, const std::vector<Rigid3>& cam_from_target) {
  if (cam_from_source.size() != cam_from_target.size()) throw std::invalid_argument("AlignPoses: sizes differ");
  Similarity3 failed;
  failed.scale = 0;
  if (cam_from_source.empty()) return failed;
  std::vector<Eigen::Vector3d> source, target;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < cam_from_source.size(); ++i) {
    source.push_back(cam_from_source[i].OriginInSource());
    target.push_back(cam_from_target[i].OriginInSource());
    turn += cam_from_target[i].R().transpose() * cam_from_source[i].R();  // target_from_source of each photo
  }
  const Moments m = ComputeMoments(source, target);
  if (!(m.source_variance > 0)) return failed;
  const Eigen::VectorXd singular = SingularValues(m.covariance);
  // Centres along a path thinner than a thirtieth of its length determine the turn about the path poorly: its error is
  // their noise over that width. The photos' rotations determine it well, and then count as much as the centres.
  constexpr double kThinPath = 1e-3;  // of variances
  if (singular[1] > kThinPath * singular[0]) return FromRotation(m, NearestRotation(m.covariance));
  const double centres =
      1 / std::sqrt(m.source_variance * std::max(m.target_variance, std::numeric_limits<double>::min()));
  return FromRotation(m, NearestRotation(centres * m.covariance + turn / static_cast<double>(source.size())));
}

PoseErrors ComparePoses(const std::vector<Rigid3>& cam_from_estimate, const std::vector<Rigid3>& cam_from_truth) {
  const Similarity3 truth_from_estimate = AlignPoses(cam_from_estimate, cam_from_truth);
  if (truth_from_estimate.scale == 0)
    throw std::invalid_argument("ComparePoses: the centres coincide, nothing to align");
  Eigen::AlignedBox3d box;
  for (const auto& pose : cam_from_truth) box.extend(pose.OriginInSource());
  const double extent = box.diagonal().norm();
  PoseErrors e;
  double centre_sum = 0, rotation_sum = 0;
  for (std::size_t i = 0; i < cam_from_truth.size(); ++i) {
    const Rigid3 aligned = TransformPose(cam_from_estimate[i], truth_from_estimate);
    const double centre = 100 * (aligned.OriginInSource() - cam_from_truth[i].OriginInSource()).norm() / extent;
    const Eigen::Quaterniond d = aligned.rotation * cam_from_truth[i].rotation.conjugate();
    const double rotation = 2 * std::atan2(d.vec().norm(), std::abs(d.w())) * kDegPerRad;
    centre_sum += centre * centre;
    rotation_sum += rotation * rotation;
    e.centre_max_percent = std::max(e.centre_max_percent, centre);
    e.rotation_max_deg = std::max(e.rotation_max_deg, rotation);
  }
  const double n = static_cast<double>(cam_from_truth.size());
  e.centre_rms_percent = std::sqrt(centre_sum / n);
  e.rotation_rms_deg = std::sqrt(rotation_sum / n);
  return e;
}

}  // namespace lumi
