#include "stabilize/motion_models.h"

#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {
namespace {

using RowMajor34d = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix42d = Eigen::Matrix<double, 4, 2>;

constexpr double kNominalFocal = 2.4;  // units: 1.2 times the longer side. Only a start
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kObjectWeight = 30;   // of an object's point that is to stay, against a sight

// P0, then what the model adds.
constexpr int kP0 = 0, kE = 12, kPi = 15, kTau = 19;          // linear, vertigo
constexpr int kU = 12, kV = 20, kOmega = 28;                  // circular
int ParameterCount(MotionModel model) { return model == MotionModel::kLinear ? 19 : model == MotionModel::kVertigo ? 20 : 29; }

// B of the family: a rotation's generator in some projective frame, U J V^T with V^T U = I.
Eigen::Matrix4d Generator(const double* p) {
  const Eigen::Map<const Matrix42d> U(p + kU), V(p + kV);
  const Eigen::Matrix2d inverse = (V.transpose() * U).inverse();
  Eigen::Matrix2d J;
  J << 0, -1, 1, 0;
  return U * J * inverse * V.transpose();
}

Matrix34d MatrixAt(MotionModel model, const double* p, double s) {
  const Eigen::Map<const RowMajor34d> P0(p + kP0);
  if (model == MotionModel::kCircular) {
    const Eigen::Matrix4d B = Generator(p);
    const double angle = p[kOmega] * s;
    return P0 * (Eigen::Matrix4d::Identity() + std::sin(angle) * B + (1 - std::cos(angle)) * B * B);
  }
  const Eigen::Map<const Eigen::Vector3d> e(p + kE);
  const Eigen::Map<const Eigen::Vector4d> pi(p + kPi);
  Matrix34d P = P0 + s * e * pi.transpose();
  if (model == MotionModel::kVertigo) {
    const double z = 1 + p[kTau] * s;
    const Eigen::Vector2d c = e.head<2>() / e.z();
    P.topRows<2>() = (z * P.topRows<2>() + (1 - z) * c * P.row(2)).eval();
  }
  return P;
}

struct WeighedSight {
  Eigen::Vector4d X;
  Eigen::Vector2d x;
  double root_weight = 1;
};

// A frame's residuals as a function of all parameters.
struct FrameResiduals {
  MotionModel model;
  double s;
  const std::vector<WeighedSight>* sights;
  bool operator()(double const* const* parameters, double* residuals) const {
    const Matrix34d P = MatrixAt(model, parameters[0], s);
    for (std::size_t i = 0; i < sights->size(); ++i) {
      const WeighedSight& sight = (*sights)[i];
      const Eigen::Vector3d q = P * sight.X;
      if (!(q.z() > 1e-9)) return false;
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * i) = sight.root_weight * (q.head<2>() / q.z() - sight.x);
    }
    return true;
  }
};

// An object's points stay where they are at s = 0.
struct ObjectResiduals {
  double s, weight;
  const std::vector<Eigen::Vector4d>* points;
  bool operator()(double const* const* parameters, double* residuals) const {
    const Matrix34d then = MatrixAt(MotionModel::kVertigo, parameters[0], s), middle = MatrixAt(MotionModel::kVertigo, parameters[0], 0);
    for (std::size_t i = 0; i < points->size(); ++i) {
      const Eigen::Vector3d a = then * (*points)[i], b = middle * (*points)[i];
      if (!(a.z() > 1e-9) || !(b.z() > 1e-9)) return false;
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * i) = weight * (a.head<2>() / a.z() - b.head<2>() / b.z());
    }
    return true;
  }
};

// The frame of the world that a fit starts in: the plane at infinity at (0,0,0,1), the middle camera's rays at their angles under the
// nominal lens, the cameras' extent of the order of one.
struct StartFrame {
  Eigen::Matrix4d start_from_balanced = Eigen::Matrix4d::Identity();
  std::vector<Matrix34d> P;            // in it; left 3x3 with |det| 1
  std::vector<Eigen::Vector3d> centre;
  double extent = 0;                   // of the centres before they were scaled, over the median distance of the points
};

StartFrame MakeStartFrame(const FilmedScene& film) {
  StartFrame start;
  // The plane as the last row; the others orthogonal to it.
  const Eigen::Vector4d pi = film.plane_at_infinity.normalized();
  Eigen::Vector4d v = pi + (pi.w() >= 0 ? 1 : -1) * Eigen::Vector4d::UnitW();
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity() - 2 * v * v.transpose() / v.squaredNorm();  // pi <-> -+e4
  T.row(3) = pi.transpose();
  const std::size_t middle = film.frames.size() / 2;
  const Matrix34d P_mid = film.frames[middle].P * T.inverse();
  const Eigen::Matrix3d M = P_mid.leftCols<3>();
  if (!(std::abs(M.determinant()) > 1e-15)) throw DataError("the middle camera's centre lies on the plane at infinity", "reconstruct the scene again, or use --model smooth");
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K.topLeftCorner<2, 2>() *= kNominalFocal;
  Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
  A.topLeftCorner<3, 3>() = K.inverse() * M;
  A.topRightCorner<3, 1>() = K.inverse() * P_mid.col(3);
  Eigen::Matrix4d W = A * T;
  std::vector<double> depths;
  for (const SightOfPoint& s : film.frames[middle].sights) {
    const Eigen::Vector4d X = W * film.X[static_cast<std::size_t>(s.point)];
    depths.push_back(X.z() / X.w());
  }
  const double depth = film.one_centre ? 0 : std::abs(Median(depths));
  Eigen::Matrix4d scale = Eigen::Matrix4d::Identity();
  if (depth > 0) scale.topLeftCorner<3, 3>() /= depth;
  W = scale * W;
  start.start_from_balanced = W;
  const Eigen::Matrix4d inverse = W.inverse();
  for (const FilmedFrame& frame : film.frames) {
    Matrix34d P = frame.P * inverse;
    const double size = std::cbrt(std::abs(P.leftCols<3>().determinant()));
    if (!(size > 0)) throw DataError("a camera's centre lies on the plane at infinity: " + frame.name, "use --model smooth");
    P /= size;
    start.P.push_back(P);
    start.centre.push_back(-P.leftCols<3>().inverse() * P.col(3));
  }
  Eigen::Vector3d low = start.centre.front(), high = low;
  for (const auto& c : start.centre) low = low.cwiseMin(c), high = high.cwiseMax(c);
  start.extent = (high - low).norm();
  return start;
}

// c ~ c0 + s v, by the median of slopes' reweighted mean.
void FitLine(const std::vector<Eigen::Vector3d>& c, const std::vector<double>& s, Eigen::Vector3d& c0, Eigen::Vector3d& v) {
  std::vector<double> weight(c.size(), 1);
  for (int round = 0; round < 6; ++round) {
    double w = 0, ws = 0, wss = 0;
    Eigen::Vector3d wc = Eigen::Vector3d::Zero(), wcs = wc;
    for (std::size_t i = 0; i < c.size(); ++i) {
      w += weight[i];
      ws += weight[i] * s[i];
      wss += weight[i] * s[i] * s[i];
      wc += weight[i] * c[i];
      wcs += weight[i] * s[i] * c[i];
    }
    const double det = w * wss - ws * ws;
    c0 = (wss * wc - ws * wcs) / det;
    v = (w * wcs - ws * wc) / det;
    std::vector<double> off;
    for (std::size_t i = 0; i < c.size(); ++i) off.push_back((c[i] - c0 - s[i] * v).norm());
    const double usual = std::max(Median(off), 1e-12);
    for (std::size_t i = 0; i < c.size(); ++i) weight[i] = 1 / std::max(1.0, off[i] / usual);
  }
}

std::vector<double> StartLinear(const FilmedScene& film, const StartFrame& start, const std::vector<double>& s, MotionModel model,
                                const std::vector<Eigen::Vector4d>& object) {
  std::vector<double> p(static_cast<std::size_t>(ParameterCount(model)), 0.0);
  Eigen::Vector3d c0, v;
  FitLine(start.centre, s, c0, v);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Matrix34d& P : start.P) M += P.leftCols<3>() / static_cast<double>(start.P.size());
  // A lens that zooms changes M along the way: the middle's is the one at s = 0.
  if (model == MotionModel::kVertigo) M = start.P[start.P.size() / 2].leftCols<3>();
  RowMajor34d P0;
  P0 << M, -M * c0;
  const double size = P0.norm();
  Eigen::Map<RowMajor34d>(p.data() + kP0) = P0 / size;
  Eigen::Map<Eigen::Vector3d>(p.data() + kE) = -M * v / size;
  Eigen::Map<Eigen::Vector4d>(p.data() + kPi) = Eigen::Vector4d::UnitW();
  if (model == MotionModel::kVertigo) {
    const double towards = std::abs(M.row(2) * v), across = (M.topRows<2>() * v).norm();
    if (film.one_centre || !(towards > 0.05 * across) || !(start.extent > 1e-3))
      throw DataError("vertigo: the camera does not move towards or away from anything", "use --model linear or smooth");
    std::vector<double> tau;
    for (const Eigen::Vector4d& X : object)
      if (const double w = P0.row(2).dot(X) / size; std::abs(w) > 1e-12) tau.push_back(p[kE + 2] * X.w() / w);
    p[kTau] = std::clamp(Median(tau), -0.9, 0.9);
  }
  return p;
}

std::vector<double> StartCircular(const FilmedScene& film, const StartFrame& start, const std::vector<double>& s) {
  constexpr double kLeastTurn = 1e-3;
  if (film.one_centre || !(start.extent > 1e-3)) throw DataError("circular: the camera does not go around anything: it stays where it is", "use --model linear or smooth");
  const auto n = static_cast<double>(start.centre.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& c : start.centre) mean += c / n;
  Eigen::MatrixXd moment = Eigen::MatrixXd::Zero(3, 3);
  for (const auto& c : start.centre) moment += (c - mean) * (c - mean).transpose();
  const Eigen::Matrix3d axes = EigenOfSymmetric(moment).vectors;  // ascending
  const Eigen::Vector3d u1 = axes.col(2), u2 = axes.col(1);
  // Circle in the plane of the two: |x|^2 = 2 a x + 2 b y + c (Kasa), with what a straight line would have as its limit.
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& c : start.centre) {
    const Eigen::Vector3d row(2 * u1.dot(c - mean), 2 * u2.dot(c - mean), 1);
    N += row * row.transpose();
    right += row * 0.25 * (row.x() * row.x() + row.y() * row.y());
  }
  if (!(std::abs(N.determinant()) > 0)) throw DataError("circular: the camera moves along a line", "use --model linear or smooth");
  const Eigen::Vector3d circle = N.inverse() * right;
  const Eigen::Vector3d centre = mean + circle.x() * u1 + circle.y() * u2;
  double angle = 0, ssa = 0, sss = 0;
  for (std::size_t i = 0; i < start.centre.size(); ++i) {
    const Eigen::Vector3d r = start.centre[i] - centre;
    double a = std::atan2(u2.dot(r), u1.dot(r));
    if (i > 0) a += kTurn * std::round((angle - a) / kTurn);
    angle = a;
    ssa += s[i] * a;
    sss += s[i] * s[i];
  }
  const double omega = ssa / sss;
  if (!(std::abs(omega) > kLeastTurn)) throw DataError("circular: the camera moves along a line", "use --model linear or smooth");
  std::vector<double> p(static_cast<std::size_t>(ParameterCount(MotionModel::kCircular)), 0.0);
  // P(s) = P0 T(-omega s): the scene turns against the camera.
  Eigen::Map<Matrix42d> U(p.data() + kU), V(p.data() + kV);
  U << u1, u2, 0, 0;
  V << u1, u2, -u1.dot(centre), -u2.dot(centre);
  p[kOmega] = -omega;
  // P0: the mean of what each frame says of it.
  const Eigen::Matrix4d B = Generator(p.data());
  Matrix34d P0 = Matrix34d::Zero();
  for (std::size_t i = 0; i < start.P.size(); ++i) {
    const double back = omega * s[i];
    P0 += start.P[i] * (Eigen::Matrix4d::Identity() + std::sin(back) * B + (1 - std::cos(back)) * B * B);
  }
  Eigen::Map<RowMajor34d>(p.data() + kP0) = P0 / P0.norm();
  return p;
}

}  // namespace

std::string_view Name(MotionModel model) {
  switch (model) {
    case MotionModel::kSmooth: return "smooth";
    case MotionModel::kLinear: return "linear";
    case MotionModel::kVertigo: return "vertigo";
    case MotionModel::kCircular: return "circular";
  }
  return "";
}

ModelFit FitModel(const FilmedScene& film, MotionModel model, const ModelFitOptions& options) {
  const std::size_t n = film.frames.size();
  if (n < 3) throw DataError("a motion is fitted to three frames or more", "a longer video");
  const StartFrame start = MakeStartFrame(film);
  std::vector<double> s;
  for (const FilmedFrame& frame : film.frames)
    s.push_back(2 * (frame.time_s - film.frames.front().time_s) / std::max(film.frames.back().time_s - film.frames.front().time_s, 1e-12) - 1);
  std::vector<Eigen::Vector4d> object;
  for (const std::int32_t i : options.object) object.push_back((start.start_from_balanced * film.X[static_cast<std::size_t>(i)]).normalized());
  if (model == MotionModel::kVertigo && object.empty()) throw DataError("vertigo: no point lies on the object that is to stay", "a larger --object box, or another --object-frame");

  std::vector<double> p = model == MotionModel::kCircular ? StartCircular(film, start, s) : StartLinear(film, start, s, model, object);

  // Sights evenly over each frame's list: tracks begin anywhere in the picture.
  std::vector<std::vector<WeighedSight>> sights(n);
  for (std::size_t t = 0; t < n; ++t) {
    const auto& all = film.frames[t].sights;
    const std::size_t wanted = std::min(all.size(), static_cast<std::size_t>(std::max(1, options.sights_per_frame)));
    const Matrix34d P = MatrixAt(model, p.data(), s[t]);
    for (std::size_t k = 0; k < wanted; ++k) {
      const SightOfPoint& sight = all[k * all.size() / wanted];
      const Eigen::Vector4d X = (start.start_from_balanced * film.X[static_cast<std::size_t>(sight.point)]).normalized();
      if (P.row(2).dot(X) > 1e-6) sights[t].push_back({X, sight.x});
    }
  }
  ModelFit fit;
  const auto error = [&](std::size_t t, const WeighedSight& sight) {
    const Eigen::Vector3d q = MatrixAt(model, p.data(), s[t]) * sight.X;
    return q.z() > 1e-9 ? (q.head<2>() / q.z() - sight.x).norm() : 1e3;
  };
  for (int round = 0; round < options.rounds; ++round) {
    CheckInterrupted();
    std::vector<double> errors;
    for (std::size_t t = 0; t < n; ++t)
      for (const WeighedSight& sight : sights[t]) errors.push_back(error(t, sight));
    if (errors.empty()) throw DataError("no frame has a point that the model can be fitted to", "use --model smooth");
    const double usual = 3 * std::max(Median(errors), 1e-6);
    ceres::Problem problem;
    problem.AddParameterBlock(p.data(), static_cast<int>(p.size()));
    std::size_t count = 0;
    for (std::size_t t = 0; t < n; ++t) {
      if (sights[t].empty()) continue;
      for (WeighedSight& sight : sights[t]) sight.root_weight = std::sqrt(std::min(1.0, usual / std::max(error(t, sight), 1e-12)));
      auto* cost = new ceres::DynamicNumericDiffCostFunction<FrameResiduals, ceres::CENTRAL>(new FrameResiduals{model, s[t], &sights[t]});
      cost->AddParameterBlock(static_cast<int>(p.size()));
      cost->SetNumResiduals(static_cast<int>(2 * sights[t].size()));
      problem.AddResidualBlock(cost, nullptr, p.data());
      count += sights[t].size();
    }
    if (model == MotionModel::kVertigo)
      for (const double at : {-1.0, -0.5, 0.5, 1.0}) {
        // As much as all sights together, shared among its points: the object's place is what the model is for.
        const double weight = kObjectWeight * std::sqrt(static_cast<double>(count) / static_cast<double>(4 * object.size())) * 0.1;
        auto* cost = new ceres::DynamicNumericDiffCostFunction<ObjectResiduals, ceres::CENTRAL>(new ObjectResiduals{at, weight, &object});
        cost->AddParameterBlock(static_cast<int>(p.size()));
        cost->SetNumResiduals(static_cast<int>(2 * object.size()));
        problem.AddResidualBlock(cost, nullptr, p.data());
      }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_QR;
    solver.max_num_iterations = options.max_iterations;
    solver.function_tolerance = 1e-10;
    solver.gradient_tolerance = 1e-16;
    solver.parameter_tolerance = 1e-12;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    const std::vector<double> before = p;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    fit.iterations += static_cast<int>(summary.iterations.size());
    if (!summary.IsSolutionUsable() || !std::all_of(p.begin(), p.end(), [](double x) { return std::isfinite(x); })) {
      p = before;
      break;
    }
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t t = 0; t < n; ++t) {
    for (const WeighedSight& sight : sights[t]) {
      const double e = error(t, sight);
      sum += e * e;
      ++count;
    }
    Matrix34d P = MatrixAt(model, p.data(), s[t]) * start.start_from_balanced;
    fit.P.push_back(P / P.norm());
  }
  fit.rms = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
  if (model == MotionModel::kCircular)
    fit.turn_rad = 2 * p[kOmega];
  else
    fit.focus_of_expansion = Eigen::Map<const Eigen::Vector3d>(p.data() + kE).normalized();
  return fit;
}

}  // namespace lumi
