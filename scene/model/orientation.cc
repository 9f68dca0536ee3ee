#include "scene/model/orientation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lumi {
namespace {

// Turns clockwise of the picture are turns of its camera's axes: x right, y down, z forward.
Eigen::Quaterniond AxesTurn(int quarter_turns) {
  const double half = quarter_turns * (M_PI / 4);
  return {std::cos(half), 0, 0, std::sin(half)};
}

Rigid3 Turned(const Rigid3& pose, int quarter_turns) {
  if (quarter_turns == 0) return pose;
  return Rigid3{AxesTurn(quarter_turns), Eigen::Vector3d::Zero()} * pose;
}

Image8 Turned(const Image8& picture, int quarter_turns) {
  if (quarter_turns == 0) return picture;
  const int w = picture.width, h = picture.height, channels = picture.channels;
  const bool swaps = quarter_turns % 2 == 1;
  Image8 turned(swaps ? h : w, swaps ? w : h, channels);
  for (int y = 0; y < turned.height; ++y) {
    std::uint8_t* to = turned.Row(y);
    for (int x = 0; x < turned.width; ++x, to += channels) {
      const int from_x = quarter_turns == 1 ? y : quarter_turns == 2 ? w - 1 - x : w - 1 - y;
      const int from_y = quarter_turns == 1 ? h - 1 - x : quarter_turns == 2 ? h - 1 - y : x;
      const std::uint8_t* from = picture.Row(from_y) + from_x * channels;
      std::copy(from, from + channels, to);
    }
  }
  return turned;
}

}  // namespace

int QuarterTurns(int orientation) {
  // EXIF names the sides of the scene that row 0 and column 0 show; what is on top decides.
  constexpr std::array kTurns{0, 0, 0, 2, 2, 1, 1, 3, 3};
  return IsOrientation(orientation) ? kTurns[static_cast<std::size_t>(orientation)] : 0;
}

Eigen::Vector3d UpInCamera(int orientation) {
  switch (QuarterTurns(orientation)) {
    case 1: return {-1, 0, 0};
    case 2: return {0, 1, 0};
    case 3: return {1, 0, 0};
    default: return {0, -1, 0};
  }
}

Rigid3 UprightPose(const Rigid3& cam_from_world, int orientation) {
  return Turned(cam_from_world, QuarterTurns(orientation));
}

Rigid3 StoredPose(const Rigid3& upright_from_world, int orientation) {
  return Turned(upright_from_world, (4 - QuarterTurns(orientation)) % 4);
}

std::pair<Camera, Rigid3> UprightCamera(const Camera& stored, const Rigid3& cam_from_world, int orientation) {
  const int turns = QuarterTurns(orientation);
  if (turns == 0) return {stored, cam_from_world};
  const Eigen::Vector2d f = stored.FocalPx(), c = stored.PrincipalPointPx();
  const int w = stored.width_px, h = stored.height_px;
  Camera camera = turns == 2   ? Camera::Pinhole(w, h, f.x(), f.y(), w - c.x(), h - c.y())
                  : turns == 1 ? Camera::Pinhole(h, w, f.y(), f.x(), h - c.y(), c.x())
                               : Camera::Pinhole(h, w, f.y(), f.x(), c.y(), w - c.x());
  return {std::move(camera), Turned(cam_from_world, turns)};
}

Image8 UprightPicture(const Image8& stored, int orientation) { return Turned(stored, QuarterTurns(orientation)); }

Image8 StoredPicture(const Image8& upright, int orientation) {
  return Turned(upright, (4 - QuarterTurns(orientation)) % 4);
}

}  // namespace lumi
