#include "reconstruct/lenses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "reconstruct/place_camera.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/levenberg_marquardt.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kLensUnknowns = 7;  // a turn, a shift, the focal length's logarithm
// At most this many of a photo's points are used, evenly chosen.
constexpr std::size_t kMostPointsAsked = 400;
// Residuals beyond this count less (Cauchy).
constexpr double kLensErrorPx = 2;
// Photos whose focal lengths span no more share a lens.
constexpr double kLikeLenses = 0.04;
constexpr std::size_t kPhotosForTwoTerms = 5;

// A camera that agrees with less than this share of its evidence is tried with other focal lengths, from a third to
// three times its own; one of them must explain so many times more.
constexpr double kAgreesWell = 0.8;
constexpr double kExplainsMore = 1.3;
constexpr double kWidestZoom = 3;
constexpr int kZoomsEachWay = 11;  // a tenth from one to the next

struct SeenPoint {
  Eigen::Vector3d x_in_cam;  // by the pose that the view has
  Eigen::Vector2d x_px;
};

using Vector7d = Eigen::Matrix<double, kLensUnknowns, 1>;
using LensInformation = Eigen::Matrix<double, kLensUnknowns, kLensUnknowns>;

Eigen::Vector3d Moved(const Vector7d& by, const Eigen::Vector3d& x_in_cam) {
  const Eigen::Vector3d turn = by.head<3>();
  const double angle = turn.norm();
  const Eigen::Vector3d turned =
      angle > 0 ? Eigen::Vector3d(Eigen::AngleAxisd(angle, turn / angle) * x_in_cam) : x_in_cam;
  return turned + by.segment<3>(3);
}

// The inverse's last entry, or nullopt where there is none. Turns and shifts have other units than a logarithm: scaled
// before they are inverted.
std::optional<double> LastOfInverse(const LensInformation& information) {
  if (!(information.diagonal().minCoeff() > 0)) return std::nullopt;
  const Vector7d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const auto inverse = InverseOf(scale.asDiagonal() * information * scale.asDiagonal());
  if (!inverse) return std::nullopt;
  return (*inverse)(kLensUnknowns - 1, kLensUnknowns - 1) * scale[kLensUnknowns - 1] * scale[kLensUnknowns - 1];
}

FocalOfView FocalFrom(const Camera& camera, const std::vector<SeenPoint>& seen) {
  FocalOfView result{1, std::numeric_limits<double>::infinity()};
  if (2 * seen.size() <= kLensUnknowns) return result;
  double distance = 0;
  for (const SeenPoint& s : seen) distance += s.x_in_cam.norm() / static_cast<double>(seen.size());
  if (!(distance > 0)) return result;
  const Eigen::Vector2d principal_point = camera.PrincipalPointPx();
  const auto project = [&](const Vector7d& by, const Eigen::Vector3d& x_in_cam) -> std::optional<Eigen::Vector2d> {
    const auto x = camera.Project(Moved(by, x_in_cam));
    if (!x) return std::nullopt;
    return Eigen::Vector2d(principal_point + std::exp(by[6]) * (*x - principal_point));
  };
  double squares = 0;
  LensInformation information;
  const auto cost = [&](const Vector7d& by, NormalEquations<kLensUnknowns>* normal) {
    double sum = 0;
    squares = 0;
    for (const SeenPoint& s : seen) {
      const auto x = project(by, s.x_in_cam);
      if (!x) return std::numeric_limits<double>::infinity();
      const Eigen::Vector2d r = *x - s.x_px;
      const RobustLoss loss = Cauchy(r.squaredNorm(), kLensErrorPx * kLensErrorPx);
      sum += loss.cost;
      squares += loss.weight * r.squaredNorm();
      if (!normal) continue;
      // Derivatives by the point are differences, since the lens may be of any model. Shifts are in units of the
      // points' distance.
      Eigen::Matrix<double, 2, 3> by_point;
      const double step = 1e-6 * distance;
      for (int k = 0; k < 3; ++k) {
        Vector7d ahead = by, behind = by;
        ahead[3 + k] += step, behind[3 + k] -= step;
        const auto more = project(ahead, s.x_in_cam), less = project(behind, s.x_in_cam);
        if (!more || !less) return std::numeric_limits<double>::infinity();
        by_point.col(k) = (*more - *less) / (2 * step);
      }
      const Eigen::Vector3d X = Moved(by, s.x_in_cam) - by.segment<3>(3);
      Eigen::Matrix3d cross;
      cross << 0, -X.z(), X.y(), X.z(), 0, -X.x(), -X.y(), X.x(), 0;
      Eigen::Matrix<double, 2, kLensUnknowns> J;
      J << by_point * -cross, by_point, *x - principal_point;
      normal->Add(J, r, loss.weight);
    }
    if (normal) information = normal->A;
    return sum;
  };
  Vector7d by = Vector7d::Zero();
  MinimiseSquares<kLensUnknowns>({.max_iterations = 15}, cost, by);
  NormalEquations<kLensUnknowns> normal(kLensUnknowns);
  if (!std::isfinite(cost(by, &normal))) return result;
  const auto variance_of_focal = LastOfInverse(information);
  if (!variance_of_focal) return result;
  const double variance = squares / static_cast<double>(2 * seen.size() - kLensUnknowns);
  result.ratio = std::exp(by[6]);
  result.sigma = std::sqrt(std::max(0.0, *variance_of_focal * variance));
  return result;
}

Camera WithFocal(const Camera& camera, double ratio) {
  return camera.WithPinhole(ratio * camera.FocalPx(), camera.PrincipalPointPx());
}

// The focal length under which a pose explains most of the evidence, refined; nullopt: none explains clearly more than
// the camera as it is.
std::optional<FocalOfView> OtherFocal(const Camera& camera, const CameraEvidence& evidence) {
  PlacedCamera best;
  double ratio = 1;
  for (int k = -kZoomsEachWay; k <= kZoomsEachWay; ++k) {
    const double candidate = std::pow(kWidestZoom, static_cast<double>(k) / kZoomsEachWay);
    PlacedCamera placed = PlaceCamera(evidence.seen, evidence.points, WithFocal(camera, candidate));
    if (placed.ok && placed.inliers > best.inliers) best = std::move(placed), ratio = candidate;
  }
  if (best.inliers < kExplainsMore * evidence.agreeing) return std::nullopt;
  std::vector<SeenPoint> seen;
  for (const Sighting& s : best.observations) {
    const Point& point = evidence.points[static_cast<std::size_t>(s.first)];
    seen.push_back({best.cam_from_world * point.x_in_world, s.second});
  }
  FocalOfView found = FocalFrom(WithFocal(camera, ratio), seen);
  found.ratio *= ratio;
  return found;
}

}  // namespace

std::vector<FocalOfView> FocalsOfViews(const Scene& scene, const std::vector<CameraEvidence>& evidence) {
  std::vector<std::vector<SeenPoint>> seen(scene.views.size());
  for (const Point& point : scene.points)
    for (const Observation& o : point.track) {
      const auto v = static_cast<std::size_t>(o.view.value);
      const Eigen::Vector3d x_in_cam = scene.views[v].cam_from_world * point.x_in_world;
      if (x_in_cam.z() > 0) seen[v].push_back({x_in_cam, o.x_px});
    }
  std::vector<FocalOfView> focals(scene.views.size());
  ParallelEach(scene.views.size(), 1, [&](std::size_t v) {
    std::vector<SeenPoint> some;
    const std::size_t count = std::min(seen[v].size(), kMostPointsAsked);
    for (std::size_t k = 0; k < count; ++k) some.push_back(seen[v][k * seen[v].size() / count]);
    const Camera& camera = scene.CameraOf(scene.views[v]);
    focals[v] = FocalFrom(camera, some);
    if (v >= evidence.size()) return;
    const CameraEvidence& e = evidence[v];
    if (e.agreeing < kAgreesWell * static_cast<double>(e.seen.size()))
      if (const auto other = OtherFocal(camera, e)) focals[v] = *other;
  });
  return focals;
}

bool OneLensExplains(const std::vector<FocalOfView>& focals) {
  return std::ranges::none_of(focals, [](const FocalOfView& f) {
    const double off = std::abs(std::log(f.ratio));
    return off > kOtherLens && off > kOtherLensSigmas * f.sigma;
  });
}

Scene ShareLikeLenses(const Scene& scene) {
  using Key = std::tuple<int, int, CameraModel>;
  std::vector<std::pair<std::pair<Key, double>, std::size_t>> order;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const Camera& camera = scene.CameraOf(scene.views[v]);
    order.push_back({{{camera.width_px, camera.height_px, camera.model}, camera.FocalPx().x()}, v});
  }
  std::ranges::sort(order);
  Scene shared = scene;
  shared.cameras.clear();
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && order[end].first.first == order[begin].first.first &&
           order[end].first.second <= (1 + kLikeLenses) * order[begin].first.second)
      ++end;
    Camera camera = scene.CameraOf(scene.views[order[begin].second]);
    for (std::size_t k = 0; k < camera.params.size(); ++k) {
      std::vector<double> values;
      for (std::size_t i = begin; i < end; ++i)
        values.push_back(scene.CameraOf(scene.views[order[i].second]).params[k]);
      camera.params[k] = Median(std::move(values));
    }
    if (camera.model == CameraModel::kSimpleRadial && end - begin >= kPhotosForTwoTerms) {
      camera.model = CameraModel::kRadial;
      camera.params.push_back(0);
    }
    for (std::size_t i = begin; i < end; ++i)
      shared.views[order[i].second].camera = CameraId{static_cast<std::int32_t>(shared.cameras.size())};
    shared.cameras.push_back(camera);
    begin = end;
  }
  return shared;
}

}  // namespace lumi
