// A rigid transform between two frames. Named target_from_source, so that chains check themselves by eye:
//   x_in_cam = cam_from_world * x_in_world
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace lumi {

struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         // in target units

  Eigen::Matrix3d R() const { return rotation.toRotationMatrix(); }
  Eigen::Matrix<double, 3, 4> Matrix() const {
    Eigen::Matrix<double, 3, 4> m;
    m << R(), translation;
    return m;
  }
  // The source frame's point that maps to the target's origin: for cam_from_world, the centre of projection in world.
  Eigen::Vector3d OriginInSource() const { return -(rotation.conjugate() * translation); }

  Rigid3 Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, -(inverse * translation)};
  }
};

inline Eigen::Vector3d operator*(const Rigid3& t, const Eigen::Vector3d& x) { return t.rotation * x + t.translation; }

// c_from_a = c_from_b * b_from_a
inline Rigid3 operator*(const Rigid3& c_from_b, const Rigid3& b_from_a) {
  return {(c_from_b.rotation * b_from_a.rotation).normalized(),
          c_from_b.translation + c_from_b.rotation * b_from_a.translation};
}

// cam_from_world for a camera at `eye` that looks at `target`; `up` is the direction that shall point upwards in the
// image (camera frame: x right, y down, z forward). Well defined also when `up` is parallel to the view (then any
// perpendicular stands in).
inline Rigid3 LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = (target - eye).normalized();
  Eigen::Vector3d x = z.cross(up);
  if (x.norm() < 1e-12 * up.norm()) x = z.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d R;
  R << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(R);
  return {q, -(q * eye)};
}

}  // namespace lumi
