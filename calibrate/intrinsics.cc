#include "calibrate/intrinsics.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

constexpr int kMaxNewtonSteps = 60;
constexpr double kStepEnd = 1e-12;  // on z = 1

// What the distortion does to a point on z = 1, and its Jacobian.
Eigen::Vector2d Distort(const Intrinsics& k, const Eigen::Vector2d& x) {
  Intrinsics unit = k;
  unit[kFx] = unit[kAspect] = 1;
  unit[kCx] = unit[kCy] = unit[kSkew] = 0;
  return ProjectNormalized(unit, x);
}
Eigen::Matrix2d DistortJacobian(const Intrinsics& k, const Eigen::Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  const double radial = 1 + r2 * (k[kK1] + r2 * (k[kK2] + r2 * k[kK3]));
  const double slope = 2 * (k[kK1] + r2 * (2 * k[kK2] + 3 * r2 * k[kK3]));
  Eigen::Matrix2d J;
  J << radial + x * slope * x + 2 * k[kP1] * y + 6 * k[kP2] * x, x * slope * y + 2 * k[kP1] * x + 2 * k[kP2] * y,
      x * slope * y + 2 * k[kP2] * y + 2 * k[kP1] * x, radial + y * slope * y + 2 * k[kP2] * x + 6 * k[kP1] * y;
  return J;
}

}  // namespace

Eigen::Vector2d ProjectNormalized(const Intrinsics& k, const Eigen::Vector2d& x) {
  Eigen::Vector2d pixel;
  ProjectNormalized(k.data(), x.x(), x.y(), pixel.data());
  return pixel;
}

std::optional<Eigen::Vector2d> Unproject(const Intrinsics& k, const Eigen::Vector2d& pixel) {
  const double yd = (pixel.y() - k[kCy]) / (k[kFx] * k[kAspect]);
  const Eigen::Vector2d target((pixel.x() - k[kCx] - k[kSkew] * yd) / k[kFx], yd);
  // Outwards from the centre, in steps that do not leap over the fold: the Jacobian's determinant is positive up to it.
  Eigen::Vector2d u = target;
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    const Eigen::Matrix2d J = DistortJacobian(k, u);
    if (!(J.determinant() > 0)) {
      u *= 0.5;
      continue;
    }
    const Eigen::Vector2d step = J.inverse() * (Distort(k, u) - target);
    u -= step;
    if (step.norm() <= kStepEnd * (1 + u.norm())) {
      const bool valid = (Distort(k, u) - target).norm() < 1e-9 * (1 + target.norm()) && DistortJacobian(k, u).determinant() > 0;
      return valid ? std::optional(u) : std::nullopt;
    }
  }
  return std::nullopt;
}

int LensModel::FreeCount() const { return static_cast<int>(std::count(free.begin(), free.end(), true)); }

std::vector<LensModel> LensModels(bool fixed_aspect) {
  struct Part {
    const char* name;
    std::vector<int> terms;
  };
  static const std::vector<Part> pixels = {{"square", {}}, {"rect", {kAspect}}, {"skew", {kAspect, kSkew}}};
  static const std::vector<Part> distortions = {{"none", {}},
                                                {"k1", {kK1}},
                                                {"k1k2", {kK1, kK2}},
                                                {"k1k2p", {kK1, kK2, kP1, kP2}},
                                                {"k1k2k3", {kK1, kK2, kK3}},
                                                {"k1k2pk3", {kK1, kK2, kP1, kP2, kK3}}};
  std::vector<LensModel> models;
  for (const Part& p : pixels) {
    if (fixed_aspect && p.name != std::string("square")) continue;
    for (const Part& d : distortions) {
      LensModel model{std::string(p.name) + "-" + d.name, {}};
      for (const int term : {static_cast<int>(kFx), static_cast<int>(kCx), static_cast<int>(kCy)}) model.free[static_cast<std::size_t>(term)] = true;
      for (const int term : p.terms) model.free[static_cast<std::size_t>(term)] = true;
      for (const int term : d.terms) model.free[static_cast<std::size_t>(term)] = true;
      models.push_back(model);
    }
  }
  std::stable_sort(models.begin(), models.end(), [](const LensModel& a, const LensModel& b) { return a.FreeCount() < b.FreeCount(); });
  return models;
}

std::optional<LensModel> LensModelFromName(const std::string& name) {
  const std::string wanted = name == "thesis" ? "skew-k1k2" : name;
  for (const LensModel& model : LensModels())
    if (model.name == wanted) return model;
  return std::nullopt;
}

LensModel FullestModel(bool fixed_aspect) { return LensModels(fixed_aspect).back(); }

}  // namespace lumi
