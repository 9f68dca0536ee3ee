#include "stabilize/motion_models.h"

#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <fmt/format.h>

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
constexpr double kObjectWeight = 30;  // of an object's point that is to stay, against a sight
constexpr double kLeastRatio =
    3;  // of an F test: the 1 % level at usual numbers of samples. Lines gave 0.2 and less, 20 degrees 2.5 and more
constexpr double kLeastNoise = 1e-5;  // units: where nothing shakes, rounding and the tracker still do
constexpr int kMostSights = 8000,
              kFewestSights = 12;  // of all frames, of a frame: a shake moves a frame's sights together

// P0, then what the model adds.
constexpr int kP0 = 0, kE = 12, kPi = 15, kTau = 19;  // linear, vertigo
constexpr int kU = 12, kV = 20, kOmega = 28;          // circular
int ParameterCount(MotionModel model) {
  return model == MotionModel::kLinear ? 19 : model == MotionModel::kVertigo ? 20 : 29;
}

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
    const Matrix34d then = MatrixAt(MotionModel::kVertigo, parameters[0], s),
                    middle = MatrixAt(MotionModel::kVertigo, parameters[0], 0);
    for (std::size_t i = 0; i < points->size(); ++i) {
      const Eigen::Vector3d a = then * (*points)[i], b = middle * (*points)[i];
      if (!(a.z() > 1e-9) || !(b.z() > 1e-9)) return false;
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * i) = weight * (a.head<2>() / a.z() - b.head<2>() / b.z());
    }
    return true;
  }
};

// The frame of the world that a fit starts in: the plane at infinity at (0,0,0,1), the middle camera's rays at their
// angles under the nominal lens, the cameras' extent of the order of one.
struct StartFrame {
  Eigen::Matrix4d start_from_balanced = Eigen::Matrix4d::Identity();
  std::vector<Matrix34d> P;  // in it; left 3x3 with |det| 1
  std::vector<Eigen::Vector3d> centre;
  double extent = 0;  // of the centres before they were scaled, over the median distance of the points
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
  if (!(std::abs(M.determinant()) > 1e-15))
    throw DataError("the middle camera's centre lies on the plane at infinity",
                    "reconstruct the scene again, or use --model smooth");
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K.topLeftCorner<2, 2>() *= kNominalFocal;
  Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
  A.topLeftCorner<3, 3>() = K.inverse() * M;
  A.topRightCorner<3, 1>() = K.inverse() * P_mid.col(3);
  Eigen::Matrix4d W = A * T;
  std::vector<double> depths;
  std::size_t sighted = middle;  // the frame nearest to the middle that has points
  for (std::size_t d = 0; d < film.frames.size() && film.frames[sighted].sights.empty(); ++d)
    if (d <= middle && !film.frames[middle - d].sights.empty())
      sighted = middle - d;
    else if (middle + d < film.frames.size())
      sighted = middle + d;
  for (const SightOfPoint& s : film.frames[sighted].sights) {
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
    if (!(size > 0))
      throw DataError("a camera's centre lies on the plane at infinity: " + frame.name, "use --model smooth");
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
void FitLine(const std::vector<Eigen::Vector3d>& c, const std::vector<double>& s, Eigen::Vector3d& c0,
             Eigen::Vector3d& v) {
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

std::vector<double> StartLinear(const FilmedScene& film, const StartFrame& start, const std::vector<double>& s,
                                MotionModel model, const std::vector<Eigen::Vector4d>& object) {
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
  // At one centre there are homographies only: those of a plane that the camera moves along, at first parallel to the
  // picture.
  if (film.one_centre)
    Eigen::Map<Eigen::Vector4d>(p.data() + kPi) << M.row(2).transpose().normalized(), 0;
  else
    Eigen::Map<Eigen::Vector4d>(p.data() + kPi) = Eigen::Vector4d::UnitW();
  if (model == MotionModel::kVertigo) {
    const double towards = std::abs(M.row(2) * v), across = (M.topRows<2>() * v).norm();
    if (film.one_centre || !(towards > 0.05 * across) || !(start.extent > 1e-3))
      throw DataError("vertigo: the camera does not move towards or away from anything",
                      "use --model linear or smooth");
    std::vector<double> tau;
    for (const Eigen::Vector4d& X : object)
      if (const double w = P0.row(2).dot(X) / size; std::abs(w) > 1e-12) tau.push_back(p[kE + 2] * X.w() / w);
    p[kTau] = std::clamp(Median(tau), -0.9, 0.9);
  }
  return p;
}

// Starts of a circular fit. The start frame is not metric, so that a circle need not be one in it, and an arc of a few
// degrees lies within the shake: no single fit to the centres is to be trusted. For each of a few angles the matrices'
// own least-squares A + cos(omega s) C + sin(omega s) S is linear, and B follows from it: S = P0 B, C = -P0 B^2, P0 = A
// + C.
std::vector<std::vector<double>> StartsCircular(const FilmedScene& film, const StartFrame& start,
                                                const std::vector<double>& s) {
  if (film.one_centre || !(start.extent > 1e-3))
    throw DataError("circular: the camera does not go around anything: it stays where it is",
                    "use --model linear or smooth");
  std::vector<std::vector<double>> starts;
  for (const double turn_deg : {10.0, 25.0, 60.0, 110.0, 180.0, 250.0, 320.0}) {
    const double omega = 0.5 * turn_deg * kTurn / 360;
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, 12> right = Eigen::Matrix<double, 3, 12>::Zero();
    for (std::size_t t = 0; t < s.size(); ++t) {
      const Eigen::Vector3d row(1, std::cos(omega * s[t]), std::sin(omega * s[t]));
      const RowMajor34d P = start.P[t];
      N += row * row.transpose();
      right += row * Eigen::Map<const Eigen::Matrix<double, 1, 12>>(P.data());
    }
    const Eigen::MatrixXd solved = SolveSymmetric(N, right);
    const auto matrix = [&](int i) {
      return Eigen::Matrix<double, 4, 3>(Eigen::Matrix<double, 12, 1>(solved.row(i)).reshaped(4, 3)).transpose().eval();
    };
    const Matrix34d C = matrix(1), S = matrix(2), P0 = matrix(0) + C;
    const Eigen::Matrix3d PP = P0 * P0.transpose();
    const double det = PP.determinant();
    if (!(std::abs(det) > 1e-12 * std::pow(PP.trace(), 3))) continue;
    const Eigen::Matrix<double, 4, 3> back = P0.transpose() * PP.inverse();
    const Eigen::Vector4d centre = CentreOfProjection(P0);
    const Eigen::Vector3d moved = S * centre;
    if (!(moved.squaredNorm() > 1e-16)) continue;
    const Eigen::Matrix4d B = back * S - centre * (moved.transpose() * (C + S * back * S)) / moved.squaredNorm();
    const SingularValueDecomposition svd = DecomposeSingular(B);
    const Matrix42d U = svd.U.leftCols<2>(), V = svd.V.leftCols<2>();
    Eigen::Matrix2d turning = U.transpose() * B * U;
    turning.diagonal().array() -= 0.5 * turning.trace();
    const double rate_squared = turning.determinant();
    if (!(rate_squared > 1e-6) || !(std::abs((V.transpose() * U).determinant()) > 1e-9)) continue;  // no rotation
    const double rate = std::sqrt(rate_squared);
    std::vector<double> p(static_cast<std::size_t>(ParameterCount(MotionModel::kCircular)), 0.0);
    Eigen::Map<RowMajor34d>(p.data() + kP0) = P0 / P0.norm();
    Eigen::Map<Matrix42d>(p.data() + kU) << U.col(0), U * turning.col(0) / rate;
    Eigen::Map<Matrix42d>(p.data() + kV) = V;
    p[kOmega] = std::clamp(omega * rate, 0.01, 0.98 * kTurn / 2);
    starts.push_back(std::move(p));
  }
  if (starts.empty())
    throw DataError("circular: the camera moves along a line, as far as its shake can tell",
                    "use --model linear or smooth");
  return starts;
}

using Sights = std::vector<std::vector<WeighedSight>>;

double ErrorOf(MotionModel model, const double* p, double s, const WeighedSight& sight) {
  const Eigen::Vector3d q = MatrixAt(model, p, s) * sight.X;
  return q.z() > 1e-9 ? (q.head<2>() / q.z() - sight.x).norm() : 1e3;
}

// At most `wanted_a_frame` sights of each frame, evenly over its list: tracks begin anywhere in the picture. A sight is
// where the frame's matrix puts the point, not where the track was: objects that move by themselves affect tracks, but
// no camera's matrix.
Sights Some(const FilmedScene& film, const StartFrame& start, int wanted_a_frame, std::size_t every = 1) {
  Sights sights(film.frames.size());
  for (std::size_t t = 0; t < sights.size(); t += every) {
    const auto& all = film.frames[t].sights;
    const std::size_t wanted = std::min(all.size(), static_cast<std::size_t>(std::max(1, wanted_a_frame)));
    for (std::size_t k = 0; k < wanted; ++k) {
      const SightOfPoint& sight = all[k * all.size() / wanted];
      Eigen::Vector4d X = start.start_from_balanced * film.X[static_cast<std::size_t>(sight.point)];
      if (film.one_centre) X.w() = 0;  // directions: a homography is all that relates the frames
      const Eigen::Vector3d q = film.frames[t].P * film.X[static_cast<std::size_t>(sight.point)];
      if (q.z() > 1e-9) sights[t].push_back({X.normalized(), q.head<2>() / q.z()});
    }
  }
  return sights;
}

struct RoundSummary {
  bool usable = false;  // false: nothing came of it, p is as it was
  int iterations = 0;
};
// One round of the fit: weights by Huber at three times the median, then least squares. `object`: vertigo's.
RoundSummary FitRound(MotionModel model, const std::vector<double>& s, Sights& sights,
                      const std::vector<Eigen::Vector4d>& object, int max_iterations, std::vector<double>& p) {
  CheckInterrupted();
  std::vector<double> errors;
  for (std::size_t t = 0; t < s.size(); ++t) {
    const Matrix34d P = MatrixAt(model, p.data(), s[t]);
    std::erase_if(sights[t], [&](const WeighedSight& sight) { return !(P.row(2).dot(sight.X) > 1e-6); });
    for (const WeighedSight& sight : sights[t]) errors.push_back(ErrorOf(model, p.data(), s[t], sight));
  }
  if (errors.empty()) throw DataError("no frame has a point that the model can be fitted to", "use --model smooth");
  const double usual = 3 * std::max(Median(errors), 1e-6);
  ceres::Problem problem;
  problem.AddParameterBlock(p.data(), static_cast<int>(p.size()));
  std::size_t count = 0;
  for (std::size_t t = 0; t < s.size(); ++t) {
    if (sights[t].empty()) continue;
    for (WeighedSight& sight : sights[t])
      sight.root_weight = std::sqrt(std::min(1.0, usual / std::max(ErrorOf(model, p.data(), s[t], sight), 1e-12)));
    auto* residuals = new ceres::DynamicNumericDiffCostFunction<FrameResiduals, ceres::CENTRAL>(
        new FrameResiduals{model, s[t], &sights[t]});
    residuals->AddParameterBlock(static_cast<int>(p.size()));
    residuals->SetNumResiduals(static_cast<int>(2 * sights[t].size()));
    problem.AddResidualBlock(residuals, nullptr, p.data());
    count += sights[t].size();
  }
  if (model == MotionModel::kVertigo)
    for (const double at : {-1.0, -0.5, 0.5, 1.0}) {
      // As much as all sights together, shared among its points: the object's place is what the model is for.
      const double weight =
          kObjectWeight * std::sqrt(static_cast<double>(count) / static_cast<double>(4 * object.size())) * 0.1;
      auto* residuals = new ceres::DynamicNumericDiffCostFunction<ObjectResiduals, ceres::CENTRAL>(
          new ObjectResiduals{at, weight, &object});
      residuals->AddParameterBlock(static_cast<int>(p.size()));
      residuals->SetNumResiduals(static_cast<int>(2 * object.size()));
      problem.AddResidualBlock(residuals, nullptr, p.data());
    }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = max_iterations;
  solver.function_tolerance = 1e-10;
  solver.gradient_tolerance = 1e-16;
  solver.parameter_tolerance = 1e-12;
  solver.num_threads = 1;  // sums in one order: the same bytes each time
  solver.logging_type = ceres::SILENT;
  const std::vector<double> before = p;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  const bool usable = summary.IsSolutionUsable() && std::ranges::all_of(p, [](double x) { return std::isfinite(x); });
  if (!usable) p = before;
  return {usable, static_cast<int>(summary.iterations.size())};
}

// The start that a coarse fit brings nearest to the sights.
std::vector<double> BestStart(const FilmedScene& film, const StartFrame& start, const std::vector<double>& s,
                              const std::vector<std::vector<double>>& starts, int& iterations) {
  constexpr std::size_t kFrames = 60;
  constexpr int kSights = 12, kIterations = 25;
  const Sights all = Some(film, start, kSights, std::max<std::size_t>(1, s.size() / kFrames));
  std::vector<double> best;
  double least = 1e300;
  for (std::vector<double> p : starts) {
    Sights sights = all;
    std::size_t count = 0, kept = 0;
    for (std::size_t t = 0; t < s.size(); ++t)
      for (const WeighedSight& sight : sights[t]) {
        ++count;
        kept += MatrixAt(MotionModel::kCircular, p.data(), s[t]).row(2).dot(sight.X) > 1e-6 ? 1 : 0;
      }
    if (kept * 5 < count * 4) continue;  // most sights would lie behind the cameras
    const RoundSummary coarse = FitRound(MotionModel::kCircular, s, sights, {}, kIterations, p);
    iterations += coarse.iterations;
    if (!coarse.usable) continue;
    std::vector<double> errors;
    for (std::size_t t = 0; t < s.size(); ++t)
      for (const WeighedSight& sight : all[t]) errors.push_back(ErrorOf(MotionModel::kCircular, p.data(), s[t], sight));
    double sum = 0;
    for (const double e : errors) sum += std::min(e, 0.5);
    if (sum < least) {
      least = sum;
      best = p;
    }
  }
  if (best.empty()) throw DataError("circular: the camera does not go around anything", "use --model linear or smooth");
  return best;
}

// For how many frames the shake stays correlated, as seen by a slow motion: the sum of the autocorrelation of each
// frame's mean residual (Bartlett's, over a quarter of the video). A shake that swings back and forth cancels, and may
// leave less than a frame.
double FramesOfOneShake(const std::vector<Eigen::Vector2d>& off) {
  const auto n = static_cast<int>(off.size());
  const int most = std::max(1, n / 4);
  double power = 0, frames = 1;
  for (const auto& x : off) power += x.squaredNorm();
  if (!(power > 0)) return 1;
  for (int lag = 1; lag < most; ++lag) {
    double sum = 0;
    for (int t = 0; t + lag < n; ++t)
      sum += off[static_cast<std::size_t>(t)].dot(off[static_cast<std::size_t>(t + lag)]);
    frames += 2 * (1 - static_cast<double>(lag) / most) * sum / power;
  }
  return std::max(1.0, frames);
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
    s.push_back(2 * (frame.time_s - film.frames.front().time_s) /
                    std::max(film.frames.back().time_s - film.frames.front().time_s, 1e-12) -
                1);
  std::vector<Eigen::Vector4d> object;
  for (const std::int32_t i : options.object)
    object.push_back((start.start_from_balanced * film.X[static_cast<std::size_t>(i)]).normalized());
  if (model == MotionModel::kVertigo && object.empty())
    throw DataError("vertigo: no point lies on the object that is to stay",
                    "a larger --object box, or another --object-frame");

  ModelFit fit;
  std::vector<double> p = model == MotionModel::kCircular
                              ? BestStart(film, start, s, StartsCircular(film, start, s), fit.iterations)
                              : StartLinear(film, start, s, model, object);
  Sights sights =
      Some(film, start, std::min(options.sights_per_frame, std::max(kFewestSights, kMostSights / static_cast<int>(n))));
  const auto fit_rounds = [&](MotionModel of, Sights& at, std::vector<double>& q) {
    RoundSummary done{true, 0};
    for (int round = 0; round < options.rounds && done.usable; ++round) {
      done = FitRound(of, s, at, object, options.max_iterations, q);
      fit.iterations += done.iterations;
    }
  };
  fit_rounds(model, sights, p);
  if (model == MotionModel::kCircular) {
    // An arc differs from a line only by its departure from one, which has to exceed the shake: an F test with as many
    // independent samples as the shake has.
    std::vector<double> line = StartLinear(film, start, s, MotionModel::kLinear, object);
    Sights of_line = sights;
    fit_rounds(MotionModel::kLinear, of_line, line);
    std::vector<Eigen::Vector2d> off(n, Eigen::Vector2d::Zero());
    double left = 0, left_of_line = 0;
    std::size_t sightings = 0;
    for (std::size_t t = 0; t < n; ++t) {
      const Matrix34d P = MatrixAt(model, p.data(), s[t]);
      for (const WeighedSight& sight : sights[t]) {
        off[t] += (Eigen::Vector3d(P * sight.X).hnormalized() - sight.x) / static_cast<double>(sights[t].size());
        const double e = ErrorOf(model, p.data(), s[t], sight),
                     e_of_line = ErrorOf(MotionModel::kLinear, line.data(), s[t], sight);
        left += std::min(e * e, 1.0);
        left_of_line += std::min(e_of_line * e_of_line, 1.0);
        ++sightings;
      }
    }
    const double samples = std::max(1.0, static_cast<double>(n) / FramesOfOneShake(off));
    const double noise = left + kLeastNoise * kLeastNoise * static_cast<double>(sightings);
    constexpr double kMoreFree = 5;  // parameters of a circle's family than of a line's
    if (!((left_of_line - left) / kMoreFree > kLeastRatio * noise / (2 * samples)))
      throw DataError(fmt::format("circular: the arc departs from a straight line by less than the shake can tell "
                                  "({:.2f} px against {:.1f} px rms)",
                                  std::sqrt(std::max(0.0, left_of_line - left) / static_cast<double>(sightings)) *
                                      film.px_per_unit(),
                                  std::sqrt(left / static_cast<double>(sightings)) * film.px_per_unit()),
                      "use --model linear or smooth");
  }
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t t = 0; t < n; ++t) {
    for (const WeighedSight& sight : sights[t]) {
      const double e = ErrorOf(model, p.data(), s[t], sight);
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
