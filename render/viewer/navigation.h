// Where the viewer's camera is and how it moves: orbit about a point, fly, jump to a photo's camera. The scene's up
// axis stays up: a roll that a photo had is levelled out as soon as the user turns the camera. No window, no GL.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

// The part of the image plane z = 1 that a window of any shape shows at least, in tangents.
struct Lens {
  Eigen::Vector2d extent = {1.0, 0.75};             // width and height; height in units of fx, as the width
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  // of the principal point from the middle
  double aspect = 1.0;                              // fy / fx
};

struct ViewState {
  Rigid3 cam_from_world;
  Lens lens;
};

// The photo's own camera, held upright as its orientation says: in a window of the upright photo's size it is the photo
// pixel for pixel.
ViewState StateOfView(const Scene& scene, ViewId view);
// The window's camera.
RenderView MakeWindowView(const ViewState& state, int width_px, int height_px);
// Focal length along x that MakeWindowView uses.
double WindowFocalPx(const Lens& lens, int width_px, int height_px);

class Navigator {
 public:
  // up: unit, in world; size: what one world-filling step is (the scene's size), world units.
  Navigator(const ViewState& start, const Eigen::Vector3d& up, double size);

  const ViewState& state() const { return state_; }
  void Set(const ViewState& state);                    // at once
  void FlyTo(const ViewState& state, double seconds);  // smoothly; any move by the user ends it
  bool flying() const { return flight_.has_value(); }

  // Angles in radians: about the up axis (positive: the camera moves to its right), and over the scene (positive: it
  // rises). The camera's elevation stays within kMaxElevation.
  void Orbit(const Eigen::Vector3d& pivot_in_world, double turn_rad, double rise_rad);
  // Turns on the spot; positive: to the right, upwards.
  void Look(double right_rad, double up_rad);
  // Moves without turning; world units along the camera's right, the scene's up and the camera's forward.
  void Fly(double right, double up, double forward);
  // Towards (factor < 1) or away from a point.
  void Dolly(const Eigen::Vector3d& pivot_in_world, double factor);
  // factor < 1 narrows the field of view.
  void Zoom(double factor);
  // Right and up in the image, as fractions of what the window shows, at the depth of a point.
  void Pan(const Eigen::Vector3d& at_in_world, double right, double up);

  // Flights and levelling go on by dt. Returns whether the state changed.
  bool Tick(double dt_s);
  void LevelAtOnce();

  // Angle of the camera's own horizon against the scene's, radians (0: level).
  double Roll() const;
  // Elevation of the viewing direction, radians.
  double Elevation() const;

  static constexpr double kMaxElevation = 1.5;  // radians; 86 degrees

 private:
  struct Flight {
    ViewState from, to;
    double seconds = 0, done_s = 0;
  };
  void Rotate(const Eigen::Vector3d& pivot_in_world, double turn_rad, double rise_rad);
  void SetRoll(double roll_rad);
  Eigen::Vector3d Right() const;  // horizontal, to the camera's right

  ViewState state_;
  Eigen::Vector3d up_;
  double size_;
  bool levelling_ = false;
  std::optional<Flight> flight_;
};

// How far apart two cameras are, in scene sizes: the distance of their centres, and the direction of their views.
double CameraDistance(const Scene& scene, const Rigid3& a_from_world, const Rigid3& b_from_world);
// Index of the photo whose camera is nearest to this one, of `among` (empty: all); -1: there is none.
int NearestView(const Scene& scene, const Rigid3& cam_from_world, const std::vector<bool>& among = {});

}  // namespace lumi
