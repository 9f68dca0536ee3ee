// x_in_target = scale * R * x_in_source + t. Used to move a scene to its centre before float arithmetic (and back), and
// to compare two reconstructions of the same capture.
#pragma once

#include <vector>

#include "scene/geometry/rigid3.h"

namespace lumi {

struct Similarity3 {
  double scale = 1.0;  // target units per source unit, > 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Similarity3 Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {1.0 / scale, inverse, -(inverse * translation) / scale};
  }
};

inline Eigen::Vector3d operator*(const Similarity3& s, const Eigen::Vector3d& x) {
  return s.scale * (s.rotation * x) + s.translation;
}

inline Similarity3 operator*(const Similarity3& c_from_b, const Similarity3& b_from_a) {
  return {c_from_b.scale * b_from_a.scale, (c_from_b.rotation * b_from_a.rotation).normalized(),
          c_from_b * b_from_a.translation};
}

// The pose of the same camera when the world is moved by target_from_source: the photo does not change.
Rigid3 TransformPose(const Rigid3& cam_from_source, const Similarity3& target_from_source);

// Least-squares target_from_source over corresponding points (Umeyama 1991). Needs three points that are not collinear:
// std::nullopt-like failure is signalled by scale == 0.
Similarity3 AlignPoints(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

// Aligns two sets of camera poses of the same photos: AlignPoints over the centres, made well-posed for collinear
// centres, and sound for those of a nearly straight path, by the rotations, which then count beside them.
Similarity3 AlignPoses(const std::vector<Rigid3>& cam_from_source, const std::vector<Rigid3>& cam_from_target);

// How far two sets of poses of the same photos are apart after AlignPoses. "Poses" in the sense of how quality is
// measured everywhere here: centres in percent of the truth's extent, rotations in degrees.
struct PoseErrors {
  double centre_rms_percent = 0;  // of the extent of the true centres (diagonal of their bounding box)
  double centre_max_percent = 0;
  double rotation_rms_deg = 0;
  double rotation_max_deg = 0;
};
PoseErrors ComparePoses(const std::vector<Rigid3>& cam_from_estimate, const std::vector<Rigid3>& cam_from_truth);

}  // namespace lumi
