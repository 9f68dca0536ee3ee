#include "stabilize/filmed_scene.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {
namespace {

constexpr double kMostErrorPx = 4;          // of a point that is believed
constexpr int kBorderSamples = 8;           // along the longer side
constexpr std::size_t kFewestForDepth = 4;  // points of a frame that its border's depth is taken from

Eigen::Matrix3d PxFromUnits(const FilmedScene& film) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K.topLeftCorner<2, 2>() *= film.px_per_unit();
  K.topRightCorner<2, 1>() = 0.5 * film.size_px.cast<double>();
  return K;
}

// The transformation after which the matrices, each of norm 1 and stacked, have orthogonal columns of one length (found
// by iterating, since the norms change with it), turned so that the first camera is [L | 0], L lower triangular: the
// same numbers, to rounding, whatever projective frame the matrices came in. Its inverse is kept beside it: inverting
// it would cost the digits that a bad frame leaves.
void Balance(const std::vector<Matrix34d>& P, Eigen::Matrix4d& balanced, Eigen::Matrix4d& inverse) {
  constexpr int kMostRounds = 200;
  Eigen::MatrixXd stacked(3 * static_cast<Eigen::Index>(P.size()), 4);
  balanced.setIdentity();
  inverse.setIdentity();
  for (int round = 0; round < kMostRounds; ++round) {
    for (std::size_t t = 0; t < P.size(); ++t) {
      const Matrix34d p = P[t] * balanced;
      stacked.middleRows<3>(3 * static_cast<Eigen::Index>(t)) = p / p.norm();
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(stacked);
    const Eigen::Matrix4d R = qr.matrixQR().topRows<4>().triangularView<Eigen::Upper>();
    // If all cameras share a centre, no matrix depends on one direction of the world: that direction keeps its scale.
    const double largest = R.diagonal().cwiseAbs().maxCoeff();
    Eigen::Matrix4d regular = R;
    for (int i = 0; i < 4; ++i)
      if (std::abs(regular(i, i)) < 1e-9 * largest) regular(i, i) = largest;
    regular /= largest;
    balanced = regular.triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(balanced);
    inverse = (regular * inverse).eval();
    for (int i = 0; i < 4; ++i) regular(i, i) = std::abs(regular(i, i));
    if (regular.isApprox(Eigen::Matrix4d::Identity(), 1e-14)) break;
  }
  Eigen::Matrix4d Q = Eigen::HouseholderQR<Eigen::MatrixXd>((P.front() * balanced).transpose().eval()).householderQ();
  const Eigen::Matrix3d L = (P.front() * balanced * Q).leftCols<3>();
  for (int i = 0; i < 3; ++i)
    if (L(i, i) < 0) Q.col(i) = -Q.col(i);
  balanced = (balanced * Q).eval();
  inverse = (Q.transpose() * inverse).eval();
}

void SampleBorder(const FilmedScene& film, const std::vector<Eigen::Vector4d>& X, FilmedFrame& frame) {
  if (X.empty()) return;
  ViewTriangulationOptions options;
  options.margin = 0;
  options.border_samples = kBorderSamples;
  options.merge_px = 6;
  const Matrix34d P_px = PxFromUnits(film) * frame.P;
  const ViewTriangulation triangulation = TriangulateView(P_px, film.size_px, X, film.plane_at_infinity, options);
  const Eigen::Vector2d middle = 0.5 * film.size_px.cast<double>();
  std::vector<std::pair<double, std::size_t>> around;
  for (std::size_t v = 0; v < triangulation.vertices.size(); ++v)
    if (triangulation.point[v] < 0) {
      const Eigen::Vector2d d = (triangulation.x_px[v] - middle).cwiseQuotient(film.size_px.cast<double>());
      around.emplace_back(std::atan2(d.y(), d.x()), v);
    }
  std::ranges::sort(around);
  for (const auto& [angle, v] : around) frame.border.push_back(triangulation.vertices[v].normalized());
}

}  // namespace

Matrix34d FilmedScene::InPixels(const Matrix34d& P) const { return PxFromUnits(*this) * P * balanced_from_world; }

Matrix34d FilmedScene::InUnits(const Matrix34d& P_px) const {
  const Matrix34d P = PxFromUnits(*this).inverse() * P_px * world_from_balanced;
  return P / P.norm();
}

std::vector<double> FilmedScene::TimesInFrames() const {
  constexpr double kWhole = 1e-6;
  std::vector<double> times;
  bool whole = true;
  for (const FilmedFrame& frame : frames) {
    times.push_back((frame.time_s - frames.front().time_s) * fps);
    whole = whole && std::abs(times.back() - std::round(times.back())) <= kWhole;
  }
  for (double& t : times) t = whole ? std::round(t) : t;
  return times;
}

FilmedScene ReadFilmedScene(const Scene& scene, std::optional<double> fps) {
  if (scene.views.size() < 2)
    throw DataError(fmt::format("the scene has {} view: there is nothing to stabilise", scene.views.size()),
                    "lumi-reconstruct VIDEO --backend factorization --projective --all-frames", scene.folder);
  const std::optional<Plane> infinity = PlaneAtInfinity(scene);
  if (!infinity)
    throw DataError("the scene says nothing of its plane at infinity",
                    "reconstruct it with lumi-reconstruct --backend factorization --projective", scene.folder);
  FilmedScene film;
  film.size_px = SizePx(scene, scene.views.front());
  std::vector<std::size_t> order(scene.views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const bool numbered = std::ranges::all_of(scene.views, [](const View& v) { return v.frame_index.has_value(); });
  if (numbered)
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return *scene.views[a].frame_index < *scene.views[b].frame_index; });

  std::vector<Matrix34d> P;
  std::vector<std::int32_t> frame_of(scene.views.size());
  for (const std::size_t v : order) {
    const View& view = scene.views[v];
    if (SizePx(scene, view) != film.size_px)
      throw DataError("the views have several sizes: a video's frames have one", "stabilise one video at a time",
                      scene.ImagePath(view));
    frame_of[v] = static_cast<std::int32_t>(film.frames.size());
    FilmedFrame& frame = film.frames.emplace_back();
    frame.name = view.name;
    P.push_back(PxFromUnits(film).inverse() * (scene.frame == Frame::kMetric
                                                   ? MakeRenderView(scene, view).P
                                                   : view.P));  // a centre may lie on the plane w = 0
  }
  const bool timed = !fps && std::ranges::all_of(scene.views, [](const View& v) { return v.time_s.has_value(); });
  std::vector<double> steps;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const View& view = scene.views[order[i]];
    film.frames[i].time_s =
        timed ? *view.time_s : (numbered ? *view.frame_index : static_cast<double>(i)) / fps.value_or(30);
    if (i > 0) steps.push_back(film.frames[i].time_s - film.frames[i - 1].time_s);
  }
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (!(steps[i] > 0))
      throw DataError(fmt::format("{} was not taken after {}: times ascend from frame to frame",
                                  film.frames[i + 1].name, film.frames[i].name),
                      "--fps F counts frames instead");
  const double step = Median(steps);
  film.fps = step > 0 ? 1 / step : fps.value_or(30);

  Balance(P, film.world_from_balanced, film.balanced_from_world);
  const Eigen::Matrix4d& H = film.world_from_balanced;
  for (std::size_t t = 0; t < P.size(); ++t) {
    film.frames[t].P = P[t] * H;
    film.frames[t].P /= film.frames[t].P.norm();
  }
  film.plane_at_infinity = (H.transpose() * *infinity).normalized();
  int front = 0;
  for (const Point& point : scene.points) {
    if (point.error_px > kMostErrorPx || point.track.size() < 2) continue;
    const Eigen::Vector4d world =
        scene.frame == Frame::kMetric ? Eigen::Vector4d(point.x_in_world.homogeneous()) : point.X_in_world;
    const Eigen::Vector4d X = (film.balanced_from_world * world).normalized();
    if (!X.allFinite()) continue;
    front += film.plane_at_infinity.dot(X) > 0 ? 1 : -1;
    const auto index = static_cast<std::int32_t>(film.X.size());
    film.X.push_back(X);
    for (const Observation& o : point.track)
      film.frames[static_cast<std::size_t>(frame_of[static_cast<std::size_t>(o.view.value)])].sights.push_back(
          {index, (o.x_px - 0.5 * film.size_px.cast<double>()) / film.px_per_unit()});
  }
  if (front < 0) film.plane_at_infinity = -film.plane_at_infinity;

  // Whether all cameras share one centre: every matrix then maps the first camera's centre to zero.
  film.one_centre = true;
  const Eigen::Vector4d centre = CentreOfProjection(film.frames.front().P);
  for (const FilmedFrame& frame : film.frames) film.one_centre = film.one_centre && (frame.P * centre).norm() < 1e-9;

  ParallelEach(film.frames.size(), 4, [&](std::size_t t) {
    // A frame that sees hardly a point (a blank wall, blur) takes the depth of the nearest frame that does.
    std::size_t from = t;
    for (std::size_t d = 1; d < film.frames.size() && film.frames[from].sights.size() < kFewestForDepth; ++d)
      if (t >= d && film.frames[t - d].sights.size() >= kFewestForDepth)
        from = t - d;
      else if (t + d < film.frames.size() && film.frames[t + d].sights.size() >= kFewestForDepth)
        from = t + d;
    std::vector<Eigen::Vector4d> seen;
    for (const SightOfPoint& s : film.frames[from].sights) seen.push_back(film.X[static_cast<std::size_t>(s.point)]);
    SampleBorder(film, seen, film.frames[t]);
  });
  if (film.one_centre) {
    // Their depth is not known, and a matrix that was free to use it would bend the picture: points become directions
    // from the centre.
    const auto direction = [&](Eigen::Vector4d& X) { X = (X - centre * centre.dot(X)).normalized(); };
    for (Eigen::Vector4d& X : film.X) direction(X);
    for (FilmedFrame& frame : film.frames)
      for (Eigen::Vector4d& X : frame.border) direction(X);
  }
  return film;
}

}  // namespace lumi
