#include "scene/model/camera.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "scene/model/plumb_bob.h"

namespace lumi {
namespace {

struct ModelInfo {
  std::string_view name;
  int parameters;
  int focals;  // 1 or 2
};
constexpr std::array<ModelInfo, 6> kModels{{{"SIMPLE_PINHOLE", 3, 1},
                                            {"PINHOLE", 4, 2},
                                            {"SIMPLE_RADIAL", 4, 1},
                                            {"RADIAL", 5, 1},
                                            {"OPENCV", 8, 2},
                                            {"OPENCV_FISHEYE", 8, 2}}};

const ModelInfo& Info(CameraModel model) { return kModels[static_cast<std::size_t>(model)]; }

// Distortion of a point on z = 1, the way every model but the fisheye writes it: polynomial in r^2 and tangential terms.
struct Distortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};

Distortion DistortionOf(const Camera& c) {
  const auto& p = c.params;
  switch (c.model) {
    case CameraModel::kSimpleRadial: return {p[3], 0, 0, 0};
    case CameraModel::kRadial: return {p[3], p[4], 0, 0};
    case CameraModel::kOpenCV: return {p[4], p[5], p[6], p[7]};
    default: return {};
  }
}

Eigen::Vector2d ApplyDistortion(const Distortion& d, const Eigen::Vector2d& u) {
  const double r2 = u.squaredNorm();
  const double radial = 1 + r2 * (d.k1 + r2 * d.k2);
  return {u.x() * radial + 2 * d.p1 * u.x() * u.y() + d.p2 * (r2 + 2 * u.x() * u.x()),
          u.y() * radial + 2 * d.p2 * u.x() * u.y() + d.p1 * (r2 + 2 * u.y() * u.y())};
}

Eigen::Matrix2d DistortionJacobian(const Distortion& d, const Eigen::Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  const double radial = 1 + r2 * (d.k1 + r2 * d.k2);
  const double slope = 2 * (d.k1 + 2 * d.k2 * r2);  // d radial / d x = slope * x
  Eigen::Matrix2d J;
  J(0, 0) = radial + x * slope * x + 2 * d.p1 * y + 6 * d.p2 * x;
  J(0, 1) = x * slope * y + 2 * d.p1 * x + 2 * d.p2 * y;
  J(1, 0) = y * slope * x + 2 * d.p2 * y + 2 * d.p1 * x;
  J(1, 1) = radial + y * slope * y + 2 * d.p2 * x + 6 * d.p1 * y;
  return J;
}

// theta_d = theta (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8)
double FisheyeDistort(const std::vector<double>& p, double theta) {
  const double t2 = theta * theta;
  return theta * (1 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7]))));
}
double FisheyeSlope(const std::vector<double>& p, double theta) {
  const double t2 = theta * theta;
  return 1 + t2 * (3 * p[4] + t2 * (5 * p[5] + t2 * (7 * p[6] + t2 * 9 * p[7])));
}

constexpr double kResidual = 1e-12;  // on z = 1: 1e-9 px for any real focal length
constexpr int kMostNewtonSteps = 60;

std::optional<Eigen::Vector2d> Undistort(const Distortion& d, const Eigen::Vector2d& target) {
  // Newton from the distorted point. The Jacobian's determinant is positive from the centre out to the fold of the
  // polynomial; beyond it there is no inverse.
  Eigen::Vector2d u = target;
  for (int i = 0; i < kMostNewtonSteps; ++i) {
    const Eigen::Vector2d residual = ApplyDistortion(d, u) - target;
    const Eigen::Matrix2d J = DistortionJacobian(d, u);
    if (!(J.determinant() > 0)) {
      u *= 0.5;  // stepped over the fold: come back towards the centre
      continue;
    }
    const Eigen::Vector2d step = J.inverse() * residual;
    u -= step;
    if (step.norm() <= kResidual * (1 + u.norm())) {
      const bool valid = (ApplyDistortion(d, u) - target).norm() < 1e-9 * (1 + target.norm()) && DistortionJacobian(d, u).determinant() > 0 &&
                         IsInsideFold(d.k1, d.k2, 0, u.squaredNorm());
      return valid ? std::optional(u) : std::nullopt;
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> UndistortFisheye(const std::vector<double>& p, const Eigen::Vector2d& target) {
  const double theta_d = target.norm();
  if (theta_d == 0) return target;
  double theta = theta_d;
  for (int i = 0; i < kMostNewtonSteps; ++i) {
    const double slope = FisheyeSlope(p, theta);
    if (!(slope > 0)) {
      theta *= 0.5;
      continue;
    }
    const double step = (FisheyeDistort(p, theta) - theta_d) / slope;
    theta -= step;
    if (std::abs(step) <= kResidual) {
      if (std::abs(FisheyeDistort(p, theta) - theta_d) > 1e-9 || !(FisheyeSlope(p, theta) > 0)) return std::nullopt;
      constexpr double kHalfPi = 1.57079632679489662;
      if (!(theta >= 0 && theta < kHalfPi)) return std::nullopt;
      return Eigen::Vector2d(target * (std::tan(theta) / theta_d));
    }
  }
  return std::nullopt;
}

}  // namespace

std::string_view Name(CameraModel model) { return Info(model).name; }

std::optional<CameraModel> CameraModelFromName(std::string_view name) {
  for (std::size_t i = 0; i < kModels.size(); ++i)
    if (kModels[i].name == name) return static_cast<CameraModel>(i);
  return std::nullopt;
}

std::optional<CameraModel> CameraModelFromId(int id) {
  if (id < 0 || id >= static_cast<int>(kModels.size())) return std::nullopt;
  return static_cast<CameraModel>(id);
}

int ParameterCount(CameraModel model) { return Info(model).parameters; }

Camera Camera::Pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px) {
  return {CameraModel::kPinhole, width_px, height_px, {fx_px, fy_px, cx_px, cy_px}};
}

Eigen::Vector2d Camera::FocalPx() const {
  return Info(model).focals == 1 ? Eigen::Vector2d(params[0], params[0]) : Eigen::Vector2d(params[0], params[1]);
}

Eigen::Vector2d Camera::PrincipalPointPx() const {
  const auto i = static_cast<std::size_t>(Info(model).focals);
  return {params[i], params[i + 1]};
}

Eigen::Matrix3d Camera::K() const {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  const Eigen::Vector2d f = FocalPx(), c = PrincipalPointPx();
  K(0, 0) = f.x();
  K(1, 1) = f.y();
  K(0, 2) = c.x();
  K(1, 2) = c.y();
  return K;
}

Camera Camera::WithPinhole(const Eigen::Vector2d& focal_px, const Eigen::Vector2d& principal_point_px) const {
  Camera other = *this;
  const auto focals = static_cast<std::size_t>(Info(model).focals);
  for (std::size_t i = 0; i < focals; ++i) other.params[i] = focal_px[static_cast<Eigen::Index>(i)];
  for (std::size_t i = 0; i < 2; ++i) other.params[focals + i] = principal_point_px[static_cast<Eigen::Index>(i)];
  return other;
}

bool Camera::IsPinhole() const {
  if (model == CameraModel::kOpenCVFisheye) return false;
  for (std::size_t i = static_cast<std::size_t>(Info(model).focals) + 2; i < params.size(); ++i)
    if (params[i] != 0) return false;
  return true;
}

std::optional<Eigen::Vector2d> Camera::Project(const Eigen::Vector3d& x_in_cam) const {
  const Eigen::Vector2d f = FocalPx(), c = PrincipalPointPx();
  if (model == CameraModel::kOpenCVFisheye) {
    const double r = x_in_cam.head<2>().norm();
    if (r == 0 && !(x_in_cam.z() > 0)) return std::nullopt;
    const double theta = std::atan2(r, x_in_cam.z());
    const double scale = r > 0 ? FisheyeDistort(params, theta) / r : 1.0 / x_in_cam.z();
    return Eigen::Vector2d(f.cwiseProduct(scale * x_in_cam.head<2>()) + c);
  }
  if (!(x_in_cam.z() > 0)) return std::nullopt;
  return Eigen::Vector2d(f.cwiseProduct(ApplyDistortion(DistortionOf(*this), x_in_cam.hnormalized())) + c);
}

std::optional<Eigen::Vector2d> Camera::Normalized(const Eigen::Vector2d& x_px) const {
  const Eigen::Vector2d u = (x_px - PrincipalPointPx()).cwiseQuotient(FocalPx());
  if (model == CameraModel::kOpenCVFisheye) return UndistortFisheye(params, u);
  if (IsPinhole()) return u;
  return Undistort(DistortionOf(*this), u);
}

Camera Camera::Scaled(int new_width_px, int new_height_px) const {
  const double sx = static_cast<double>(new_width_px) / width_px, sy = static_cast<double>(new_height_px) / height_px;
  Camera scaled = *this;
  scaled.width_px = new_width_px;
  scaled.height_px = new_height_px;
  // A rounded height (751 for 750.4) is within a pixel; then one focal length still describes both axes.
  const bool same_aspect = std::abs(sx * height_px - new_height_px) < 1.5 || std::abs(sy * width_px - new_width_px) < 1.5;
  if (Info(model).focals == 1 && !same_aspect) {
    const Distortion d = DistortionOf(*this);
    scaled.model = CameraModel::kOpenCV;
    scaled.params = {params[0] * sx, params[0] * sy, params[1] * sx, params[2] * sy, d.k1, d.k2, 0, 0};
    return scaled;
  }
  std::size_t i = 0;
  if (Info(model).focals == 1) {
    scaled.params[i++] *= std::sqrt(sx * sy);
  } else {
    scaled.params[i++] *= sx;
    scaled.params[i++] *= sy;
  }
  scaled.params[i] *= sx;
  scaled.params[i + 1] *= sy;
  return scaled;
}

std::optional<std::string> Validate(const Camera& camera) {
  if (static_cast<int>(camera.params.size()) != ParameterCount(camera.model))
    return std::string(Name(camera.model)) + " takes " + std::to_string(ParameterCount(camera.model)) + " parameters, not " +
           std::to_string(camera.params.size());
  if (camera.width_px <= 0 || camera.height_px <= 0) return std::string("image size is not positive");
  for (const double p : camera.params)
    if (!std::isfinite(p)) return std::string("a parameter is not a finite number");
  if (!(camera.FocalPx().minCoeff() > 0)) return std::string("focal length is not positive");
  return std::nullopt;
}

}  // namespace lumi
