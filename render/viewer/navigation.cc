#include "render/viewer/navigation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "scene/model/orientation.h"

namespace lumi {
namespace {

constexpr double kLevelTime = 0.12;                    // seconds in which the roll falls to 1/e
constexpr double kLevelDone = 1e-4;                    // radians
constexpr double kMinExtent = 0.02, kMaxExtent = 6.0;  // tangents: 1 to 143 degrees

Eigen::Vector3d Forward(const ViewState& s) { return s.cam_from_world.R().row(2).transpose(); }

// Slow at both ends.
double Smooth(double x) { return x * x * x * (x * (6 * x - 15) + 10); }

}  // namespace

ViewState StateOfView(const Scene& scene, ViewId id) {
  const View& view = scene.views.at(static_cast<std::size_t>(id.value));
  const auto [camera, cam_from_world] = UprightCamera(scene.CameraOf(view), view.cam_from_world, view.orientation);
  const Eigen::Vector2d f = camera.FocalPx(), c = camera.PrincipalPointPx();
  ViewState state;
  state.cam_from_world = cam_from_world;
  state.lens.aspect = f.y() / f.x();
  state.lens.extent = {camera.width_px / f.x(), camera.height_px / f.x()};
  state.lens.shift = {(c.x() - 0.5 * camera.width_px) / f.x(), (c.y() - 0.5 * camera.height_px) / f.x()};
  return state;
}

double WindowFocalPx(const Lens& lens, int width_px, int height_px) {
  return std::min(width_px / lens.extent.x(), height_px / lens.extent.y());
}

RenderView MakeWindowView(const ViewState& state, int width_px, int height_px) {
  const double f = WindowFocalPx(state.lens, width_px, height_px);
  return MakeRenderView(
      Camera::Pinhole(width_px, height_px, f, f * state.lens.aspect, 0.5 * width_px + f * state.lens.shift.x(),
                      0.5 * height_px + f * state.lens.shift.y()),
      state.cam_from_world);
}

Navigator::Navigator(const ViewState& start, const Eigen::Vector3d& up, double size)
    : state_(start), up_(up.normalized()), size_(size) {}

void Navigator::Set(const ViewState& state) {
  state_ = state;
  flight_.reset();
  levelling_ = false;
}

void Navigator::FlyTo(const ViewState& state, double seconds) {
  levelling_ = false;
  if (seconds <= 0) return Set(state);
  flight_ = Flight{state_, state, seconds, 0};
}

Eigen::Vector3d Navigator::Right() const {
  const Eigen::Vector3d right = Forward(state_).cross(up_);
  // Looking straight up or down the camera's own x axis says what is right.
  if (right.norm() < 1e-3) {
    const Eigen::Vector3d x = state_.cam_from_world.R().row(0).transpose();
    return (x - x.dot(up_) * up_).normalized();
  }
  return right.normalized();
}

double Navigator::Elevation() const { return std::asin(std::clamp(Forward(state_).dot(up_), -1.0, 1.0)); }

double Navigator::Roll() const {
  const Eigen::Vector3d x = state_.cam_from_world.R().row(0).transpose(),
                        down = state_.cam_from_world.R().row(1).transpose();
  const Eigen::Vector3d right = Right();
  return std::atan2(right.dot(down), right.dot(x));
}

void Navigator::SetRoll(double roll) {
  const Eigen::Vector3d centre = state_.cam_from_world.OriginInSource();
  // Rolls add up in the image plane: about the optical axis.
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(roll - Roll(), Eigen::Vector3d::UnitZ()));
  state_.cam_from_world.rotation = (turn * state_.cam_from_world.rotation).normalized();
  state_.cam_from_world.translation = -(state_.cam_from_world.rotation * centre);
}

void Navigator::Rotate(const Eigen::Vector3d& pivot, double turn, double rise) {
  flight_.reset();
  levelling_ = true;
  // The camera rises over the scene: it looks down by as much. Past the limit only the way back is open.
  const double elevation = Elevation();
  const double lowest = std::min(-kMaxElevation, elevation), highest = std::max(kMaxElevation, elevation);
  const double pitch = std::clamp(elevation - rise, lowest, highest) - elevation;
  const Eigen::Quaterniond world_turn =
      Eigen::Quaterniond(Eigen::AngleAxisd(turn, up_)) * Eigen::Quaterniond(Eigen::AngleAxisd(pitch, Right()));
  const Eigen::Vector3d centre = pivot + world_turn * (state_.cam_from_world.OriginInSource() - pivot);
  state_.cam_from_world.rotation = (state_.cam_from_world.rotation * world_turn.conjugate()).normalized();
  state_.cam_from_world.translation = -(state_.cam_from_world.rotation * centre);
}

void Navigator::Orbit(const Eigen::Vector3d& pivot, double turn, double rise) { Rotate(pivot, turn, rise); }

void Navigator::Look(double right, double up) { Rotate(state_.cam_from_world.OriginInSource(), -right, -up); }

void Navigator::Fly(double right, double up, double forward) {
  flight_.reset();
  const Eigen::Vector3d step = right * Right() + up * up_ + forward * Forward(state_);
  state_.cam_from_world.translation -= state_.cam_from_world.rotation * step;
}

void Navigator::Dolly(const Eigen::Vector3d& pivot, double factor) {
  flight_.reset();
  const Eigen::Vector3d centre = state_.cam_from_world.OriginInSource();
  // Never into the point itself: a thousandth of the scene before it the camera stops.
  const double distance = (centre - pivot).norm();
  if (distance * factor < 1e-3 * size_ && factor < 1) return;
  state_.cam_from_world.translation = -(state_.cam_from_world.rotation * (pivot + factor * (centre - pivot)));
}

void Navigator::Zoom(double factor) {
  flight_.reset();
  const double limited =
      std::clamp(state_.lens.extent.maxCoeff() * factor, kMinExtent, kMaxExtent) / state_.lens.extent.maxCoeff();
  state_.lens.extent *= limited;
  state_.lens.shift *= limited;
}

void Navigator::Pan(const Eigen::Vector3d& at, double right, double up) {
  flight_.reset();
  const double depth = std::max((state_.cam_from_world * at).z(), 1e-3 * size_);
  const Eigen::Vector3d step(right * depth * state_.lens.extent.x(), -up * depth * state_.lens.extent.y(), 0);
  state_.cam_from_world.translation -= step;
}

void Navigator::LevelAtOnce() {
  SetRoll(0);
  levelling_ = false;
}

bool Navigator::Tick(double dt) {
  if (flight_) {
    flight_->done_s += dt;
    if (flight_->done_s >= flight_->seconds) {
      state_ = flight_->to;
      flight_.reset();
      return true;
    }
    const double a = Smooth(flight_->done_s / flight_->seconds);
    const ViewState &from = flight_->from, &to = flight_->to;
    const Eigen::Vector3d centre =
        (1 - a) * from.cam_from_world.OriginInSource() + a * to.cam_from_world.OriginInSource();
    state_.cam_from_world.rotation = from.cam_from_world.rotation.slerp(a, to.cam_from_world.rotation).normalized();
    state_.cam_from_world.translation = -(state_.cam_from_world.rotation * centre);
    state_.lens.extent = (1 - a) * from.lens.extent + a * to.lens.extent;
    state_.lens.shift = (1 - a) * from.lens.shift + a * to.lens.shift;
    state_.lens.aspect = (1 - a) * from.lens.aspect + a * to.lens.aspect;
    return true;
  }
  if (levelling_) {
    const double roll = Roll();
    if (std::abs(roll) < kLevelDone) {
      levelling_ = false;
      return false;
    }
    SetRoll(roll * std::exp(-dt / kLevelTime));
    return true;
  }
  return false;
}

double CameraDistance(const Scene& scene, const Rigid3& a, const Rigid3& b) {
  // Looking the other way weighs as much as being a scene's size away.
  constexpr double kDirectionWeight = 0.5;
  return (a.OriginInSource() - b.OriginInSource()).norm() * scene.normalized_from_world.scale +
         kDirectionWeight * (1 - a.R().row(2).dot(b.R().row(2)));
}

int NearestView(const Scene& scene, const Rigid3& cam_from_world, const std::vector<bool>& among) {
  int best = -1;
  double best_distance = 0;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (!among.empty() && !among[i]) continue;
    const double distance = CameraDistance(scene, scene.views[i].cam_from_world, cam_from_world);
    if (best < 0 || distance < best_distance) {
      best = static_cast<int>(i);
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace lumi
