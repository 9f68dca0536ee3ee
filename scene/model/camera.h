// Intrinsics: COLMAP's models, and one of what a calibration knows. Camera frame: x right, y down, z forward. Pixels:
// centre of the upper-left pixel at (0.5, 0.5), as COLMAP and OpenGL have it (files/opencv_pixels.h converts OpenCV's
// integers).
//
// To add a camera model:
//   1. its number below, COLMAP's where COLMAP has it, and its line in kCameraModels: its name, and what its parameters
//   are, in their order. A
//      static_assert holds the table to one line a model, focal lengths and principal point first.
//   2. a camera of it in tests/scene/camera_test.cc, `Cameras()`: the tests there project, invert, scale and validate
//   each of them.
// Readers, writers, scaling and validation follow from the table. A parameter of a new kind is a CameraTerm and its
// place in camera.cc's DistortionOf, which -Wswitch asks for; a lens that is no polynomial is a function pair as the
// fisheye's there.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lumi {

enum class CameraModel : int {
  kPlumbBob = -1,  // not COLMAP's: skew and k3 too, as camera.yaml and calibrations have them; no scene is kept in it
  kSimplePinhole = 0,
  kPinhole = 1,
  kSimpleRadial = 2,
  kRadial = 3,
  kOpenCV = 4,
  kOpenCVFisheye = 5,
};

// What a parameter is: in pixels up to the skew (thesis Sec. 2.2.2), then OpenCV's distortion; theta's are of the angle
// to the axis.
enum class CameraTerm {
  kNone,
  kF,
  kFx,
  kFy,
  kCx,
  kCy,
  kSkew,
  kK1,
  kK2,
  kP1,
  kP2,
  kK3,
  kTheta1,
  kTheta2,
  kTheta3,
  kTheta4
};

struct CameraModelInfo {
  CameraModel model;
  std::string_view name;  // COLMAP's
  std::array<CameraTerm, 10> terms;

  constexpr int Count() const {
    int n = 0;
    while (n < static_cast<int>(terms.size()) && terms[static_cast<std::size_t>(n)] != CameraTerm::kNone) ++n;
    return n;
  }
  constexpr int FocalCount() const { return terms[0] == CameraTerm::kF ? 1 : 2; }
};

inline constexpr auto kCameraModels = [] {
  using enum CameraTerm;
  using enum CameraModel;
  return std::array{
      CameraModelInfo{kPlumbBob, "PLUMB_BOB", {kFx, kFy, kCx, kCy, kSkew, kK1, kK2, kP1, kP2, kK3}},
      CameraModelInfo{kSimplePinhole, "SIMPLE_PINHOLE", {kF, kCx, kCy}},
      CameraModelInfo{kPinhole, "PINHOLE", {kFx, kFy, kCx, kCy}},
      CameraModelInfo{kSimpleRadial, "SIMPLE_RADIAL", {kF, kCx, kCy, kK1}},
      CameraModelInfo{kRadial, "RADIAL", {kF, kCx, kCy, kK1, kK2}},
      CameraModelInfo{kOpenCV, "OPENCV", {kFx, kFy, kCx, kCy, kK1, kK2, kP1, kP2}},
      CameraModelInfo{kOpenCVFisheye, "OPENCV_FISHEYE", {kFx, kFy, kCx, kCy, kTheta1, kTheta2, kTheta3, kTheta4}},
  };
}();
static_assert([] {
  for (std::size_t i = 0; i < kCameraModels.size(); ++i) {
    const CameraModelInfo& info = kCameraModels[i];
    const auto f = static_cast<std::size_t>(info.FocalCount());
    if (info.model != static_cast<CameraModel>(static_cast<int>(i) - 1)) return false;  // InfoOf() looks there
    if (f == 2 && (info.terms[0] != CameraTerm::kFx || info.terms[1] != CameraTerm::kFy)) return false;
    if (info.terms[f] != CameraTerm::kCx || info.terms[f + 1] != CameraTerm::kCy) return false;
  }
  return true;
}());

constexpr const CameraModelInfo& InfoOf(CameraModel model) {
  return kCameraModels[static_cast<std::size_t>(static_cast<int>(model) + 1)];
}
constexpr std::string_view Name(CameraModel model) { return InfoOf(model).name; }  // "PINHOLE", ...
constexpr int ParameterCount(CameraModel model) { return InfoOf(model).Count(); }
// COLMAP's own, which files name.
std::optional<CameraModel> CameraModelFromName(std::string_view name);
std::optional<CameraModel> CameraModelFromId(int id);

struct Camera {
  CameraModel model = CameraModel::kPinhole;
  int width_px = 0;
  int height_px = 0;
  std::vector<double> params;  // in the order of kCameraModels

  static Camera Pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px);

  double Get(CameraTerm term) const;  // 0 where the model has no such term
  Eigen::Vector2d FocalPx() const;
  Eigen::Vector2d PrincipalPointPx() const;
  Eigen::Matrix3d K() const;  // without distortion
  bool IsPinhole() const;     // no skew and no distortion term, or all of them zero

  // Pixel of a point in the camera frame; nullopt at or behind the camera (fisheye: nullopt only at the centre).
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& x_in_cam) const;
  // Point on the plane z = 1 (fisheye beyond 90 degrees: nullopt) seen at a pixel; nullopt where the distortion has no
  // inverse there (the pixel lies beyond the fold of the polynomial).
  std::optional<Eigen::Vector2d> Normalized(const Eigen::Vector2d& x_px) const;

  // The same camera for photos scaled to another size; the aspect may change by rounding only (else the focal lengths
  // and principal point are scaled per axis, and a single-focal model becomes its two-focal equivalent where needed).
  Camera Scaled(int new_width_px, int new_height_px) const;
  // The same lens with another focal length (of a model with one, its x counts) and principal point.
  Camera WithPinhole(const Eigen::Vector2d& focal_px, const Eigen::Vector2d& principal_point_px) const;
};

// What is wrong with a camera (counts, sizes, NaN, focal lengths <= 0), or nullopt.
std::optional<std::string> Validate(const Camera& camera);

}  // namespace lumi
