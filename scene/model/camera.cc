#include "scene/model/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/model/distortion.h"

namespace lumi {
namespace {

// Read once for each point: the terms of a polynomial lens, at their place or 0.
struct PolynomialLens {
  double skew_px = 0;
  Distortion distortion;
};

PolynomialLens PolynomialOf(const Camera& c) {
  PolynomialLens lens;
  const CameraModelInfo& info = InfoOf(c.model);
  for (std::size_t i = static_cast<std::size_t>(info.FocalCount()) + 2; i < static_cast<std::size_t>(info.Count()); ++i)
    switch (info.terms[i]) {
      case CameraTerm::kSkew: lens.skew_px = c.params[i]; break;
      case CameraTerm::kK1: lens.distortion.k1 = c.params[i]; break;
      case CameraTerm::kK2: lens.distortion.k2 = c.params[i]; break;
      case CameraTerm::kP1: lens.distortion.p1 = c.params[i]; break;
      case CameraTerm::kP2: lens.distortion.p2 = c.params[i]; break;
      case CameraTerm::kK3: lens.distortion.k3 = c.params[i]; break;
      case CameraTerm::kNone:
      case CameraTerm::kF:
      case CameraTerm::kFx:
      case CameraTerm::kFy:
      case CameraTerm::kCx:
      case CameraTerm::kCy:
      case CameraTerm::kTheta1:
      case CameraTerm::kTheta2:
      case CameraTerm::kTheta3:
      case CameraTerm::kTheta4: break;
    }
  return lens;
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

constexpr double kResidual = 1e-12;  // radians: 1e-9 px for any real focal length
constexpr int kMostNewtonSteps = 60;

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
      if (!(theta >= 0 && theta < std::numbers::pi / 2)) return std::nullopt;
      return Eigen::Vector2d(target * (std::tan(theta) / theta_d));
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<CameraModel> CameraModelFromName(std::string_view name) {
  for (const CameraModelInfo& info : kCameraModels)
    if (info.name == name) return CameraModelFromId(static_cast<int>(info.model));
  return std::nullopt;
}

std::optional<CameraModel> CameraModelFromId(int id) {
  if (id < 0 || id >= static_cast<int>(kCameraModels.size()) - 1) return std::nullopt;
  return static_cast<CameraModel>(id);
}

Camera Camera::Pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px) {
  return {CameraModel::kPinhole, width_px, height_px, {fx_px, fy_px, cx_px, cy_px}};
}

double Camera::Get(CameraTerm term) const {
  const auto& terms = InfoOf(model).terms;
  const auto i = static_cast<std::size_t>(std::find(terms.begin(), terms.end(), term) - terms.begin());
  return i < params.size() ? params[i] : 0;
}

Eigen::Vector2d Camera::FocalPx() const {
  return InfoOf(model).FocalCount() == 1 ? Eigen::Vector2d(params[0], params[0])
                                         : Eigen::Vector2d(params[0], params[1]);
}

Eigen::Vector2d Camera::PrincipalPointPx() const {
  const auto i = static_cast<std::size_t>(InfoOf(model).FocalCount());
  return {params[i], params[i + 1]};
}

Eigen::Matrix3d Camera::K() const {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  const Eigen::Vector2d f = FocalPx(), c = PrincipalPointPx();
  K(0, 0) = f.x();
  K(1, 1) = f.y();
  K(0, 1) = Get(CameraTerm::kSkew);
  K(0, 2) = c.x();
  K(1, 2) = c.y();
  return K;
}

Camera Camera::WithPinhole(const Eigen::Vector2d& focal_px, const Eigen::Vector2d& principal_point_px) const {
  Camera other = *this;
  const auto focals = static_cast<std::size_t>(InfoOf(model).FocalCount());
  for (std::size_t i = 0; i < focals; ++i) other.params[i] = focal_px[static_cast<Eigen::Index>(i)];
  for (std::size_t i = 0; i < 2; ++i) other.params[focals + i] = principal_point_px[static_cast<Eigen::Index>(i)];
  return other;
}

bool Camera::IsPinhole() const {
  if (model == CameraModel::kOpenCVFisheye) return false;
  for (std::size_t i = static_cast<std::size_t>(InfoOf(model).FocalCount()) + 2; i < params.size(); ++i)
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
  const PolynomialLens lens = PolynomialOf(*this);
  const Eigen::Vector2d d = Distort(lens.distortion, Eigen::Vector2d(x_in_cam.hnormalized()));
  return Eigen::Vector2d(f.x() * d.x() + lens.skew_px * d.y() + c.x(), f.y() * d.y() + c.y());
}

std::optional<Eigen::Vector2d> Camera::Normalized(const Eigen::Vector2d& x_px) const {
  Eigen::Vector2d u = (x_px - PrincipalPointPx()).cwiseQuotient(FocalPx());
  if (model == CameraModel::kOpenCVFisheye) return UndistortFisheye(params, u);
  if (IsPinhole()) return u;
  const PolynomialLens lens = PolynomialOf(*this);
  u.x() -= lens.skew_px * u.y() / FocalPx().x();
  return Undistort(lens.distortion, u);
}

Camera Camera::Scaled(int new_width_px, int new_height_px) const {
  const double sx = static_cast<double>(new_width_px) / width_px, sy = static_cast<double>(new_height_px) / height_px;
  Camera scaled = *this;
  scaled.width_px = new_width_px;
  scaled.height_px = new_height_px;
  // A rounded height (751 for 750.4) is within a pixel; then one focal length still describes both axes.
  const bool same_aspect =
      std::abs(sx * height_px - new_height_px) < 1.5 || std::abs(sy * width_px - new_width_px) < 1.5;
  if (InfoOf(model).FocalCount() == 1 && !same_aspect) {
    scaled.model = CameraModel::kOpenCV;
    scaled.params = {params[0] * sx,
                     params[0] * sy,
                     params[1] * sx,
                     params[2] * sy,
                     Get(CameraTerm::kK1),
                     Get(CameraTerm::kK2),
                     0,
                     0};
    return scaled;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(ParameterCount(model)); ++i) {
    const CameraTerm term = InfoOf(model).terms[i];
    if (term == CameraTerm::kF) scaled.params[i] *= std::sqrt(sx * sy);
    if (term == CameraTerm::kFx || term == CameraTerm::kCx || term == CameraTerm::kSkew) scaled.params[i] *= sx;
    if (term == CameraTerm::kFy || term == CameraTerm::kCy) scaled.params[i] *= sy;
  }
  return scaled;
}

std::optional<std::string> Validate(const Camera& camera) {
  if (static_cast<int>(camera.params.size()) != ParameterCount(camera.model))
    return std::string(Name(camera.model)) + " takes " + std::to_string(ParameterCount(camera.model)) +
           " parameters, not " + std::to_string(camera.params.size());
  if (camera.width_px <= 0 || camera.height_px <= 0) return std::string("image size is not positive");
  for (const double p : camera.params)
    if (!std::isfinite(p)) return std::string("a parameter is not a finite number");
  if (!(camera.FocalPx().minCoeff() > 0)) return std::string("focal length is not positive");
  return std::nullopt;
}

}  // namespace lumi
