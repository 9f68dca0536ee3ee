// Angles between rays where nothing is metric (thesis sec. 6.2.1): in the virtual view with projection P, the ray of
// another camera has a vanishing point v ~ P X, X where it meets the plane at infinity pi, and with a nominal
// calibration K0 the angle between the rays K0^-1 v and K0^-1 x. The thesis takes the distance of v and x in pixels,
// whose scale varies over the image and which is blind to orientation; the angle does not, and is 90 degrees or more by
// itself where v lies behind the view.
//
// The angle is a Euclidean one: of the world in which the view is K0 [I | 0] and pi the plane at infinity,
//   x = K0^-1 P X / (pi . X),
// which is affine to every other one with that pi. Cameras, points and planes are transformed to this world, where
// everything made for metric scenes holds; quantities of images alone (fields of view, homographies and their
// Jacobians) are the same in any world. The result does not depend on the scene's world or on the scales of P and pi: a
// projective transformation of the scene and its pi leads to the same world, up to rounding times its condition.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {

// pixels from camera rays: principal point in the middle of the picture.
Eigen::Matrix3d NominalCalibration(const Eigen::Vector2i& size_px, double focal_px);
// Default: 45 degrees across the longer side.
double NominalFocalPx(const Eigen::Vector2i& size_px);

class VanishingPointFrame {
 public:
  // at_infinity: signed so that points in front of the view are on its positive side. unit_kappa: pi . X / w of what is
  // to be at depth 1 (generalised inverse depth, view_triangulation.h), > 0. nullopt where the view's centre lies on
  // at_infinity, to rounding, or P has no rank 3: its rays are then all parallel.
  static std::optional<VanishingPointFrame> Make(const Matrix34d& P, const Plane& at_infinity,
                                                 const Eigen::Matrix3d& K0, double unit_kappa);

  // The view itself, K0 [I | 0].
  Matrix34d P() const;
  // Another camera. nullopt where its centre lies at or beyond the plane at infinity, as seen from this view.
  struct Moved {
    Matrix34d P;
    Eigen::Vector3d centre;  // exactly 0 within 1e-7 of the view's own: that is rounding, and no angle
  };
  std::optional<Moved> MoveCamera(const Matrix34d& P) const;
  Eigen::Vector4d MovePoint(const Eigen::Vector4d& X_in_world) const { return frame_from_world_ * X_in_world; }
  // What is seen at a pixel at an inverse depth, kappa > 0.
  Eigen::Vector3d At(const Eigen::Vector2d& x_px, double kappa) const;

 private:
  VanishingPointFrame() = default;
  Eigen::Matrix3d K0_, K0_inverse_;
  double unit_kappa_ = 1;
  Eigen::Matrix4d frame_from_world_, world_from_frame_;
};

}  // namespace lumi
