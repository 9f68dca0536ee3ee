#include "pipeline/report/cameras_from_above.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "pipeline/report/html.h"
#include "scene/model/orientation.h"

namespace lumi {
namespace {

constexpr double kWidthPx = 900, kMaxHeightPx = 640, kMarginPx = 28;
constexpr std::size_t kMaxPoints = 3000;
constexpr double kOutlierShare = 0.02;  // of the points on either side are left out when the frame is chosen

// World directions of the drawing's axes.
struct Axes {
  Eigen::Vector3d right, forward;
  Eigen::Vector2d operator()(const Eigen::Vector3d& x) const { return {right.dot(x), forward.dot(x)}; }
};

// Forward (up in the drawing) is where the cameras look on average; any direction where that is undecided.
Axes ChooseAxes(const Scene& scene) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) mean += view.cam_from_world.R().row(2).transpose();
  Eigen::Vector3d forward = mean - scene.up * scene.up.dot(mean);
  if (forward.norm() < 0.05 * static_cast<double>(scene.views.size())) forward = scene.up.unitOrthogonal();
  forward.normalize();
  return {forward.cross(scene.up), forward};
}

struct Range {
  double low = 0, high = 0;
};
Range RobustRange(std::vector<double> values, double share) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto cut = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return {values[cut], values[values.size() - 1 - cut]};
}

}  // namespace

std::string CamerasFromAboveSvg(const Scene& scene, const std::set<std::string>& held_out) {
  if (scene.frame != Frame::kMetric || scene.views.empty()) return {};
  const Axes axes = ChooseAxes(scene);

  std::vector<double> px, py;
  for (const Point& point : scene.points) {
    const Eigen::Vector2d p = axes(point.x_in_world);
    px.push_back(p.x());
    py.push_back(p.y());
  }
  Range rx = RobustRange(px, kOutlierShare), ry = RobustRange(py, kOutlierShare);
  bool first = scene.points.empty();
  for (const View& view : scene.views) {
    const Eigen::Vector2d c = axes(view.CentreInWorld());
    if (first) rx = {c.x(), c.x()}, ry = {c.y(), c.y()};
    first = false;
    rx = {std::min(rx.low, c.x()), std::max(rx.high, c.x())};
    ry = {std::min(ry.low, c.y()), std::max(ry.high, c.y())};
  }
  const double extent = std::max({rx.high - rx.low, ry.high - ry.low, 1e-12});
  const double scale = std::min((kWidthPx - 2 * kMarginPx) / std::max(rx.high - rx.low, extent * 1e-3),
                                (kMaxHeightPx - 2 * kMarginPx) / std::max(ry.high - ry.low, extent * 1e-3));
  const double height = std::max(160.0, (ry.high - ry.low) * scale + 2 * kMarginPx);
  const double offset_x = (kWidthPx - (rx.high + rx.low) * scale) / 2;
  const double offset_y = (height + (ry.high + ry.low) * scale) / 2;
  const auto draw = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(offset_x + p.x() * scale, offset_y - p.y() * scale);
  };

  std::string svg = fmt::format(
      "<svg class=\"map\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"Cameras and points seen from "
      "above\">\n",
      kWidthPx, height);
  // Dots of one colour share a path: a zero-length stroke with round ends is a dot, and the page stays small.
  std::string dots;
  const std::size_t stride = std::max<std::size_t>(1, (scene.points.size() + kMaxPoints - 1) / kMaxPoints);
  for (std::size_t i = 0; i < scene.points.size(); i += stride) {
    const Eigen::Vector2d p = draw(axes(scene.points[i].x_in_world));
    if (p.x() < 0 || p.y() < 0 || p.x() > kWidthPx || p.y() > height) continue;
    fmt::format_to(std::back_inserter(dots), "M{:.1f} {:.1f}h0", p.x(), p.y());
  }
  svg += "<path class=\"points\" d=\"" + dots + "\"/>\n";

  // A wedge as long as fits between neighbours, not longer than a tenth of the drawing.
  const double wedge = std::clamp(0.6 * kWidthPx / std::sqrt(static_cast<double>(scene.views.size()) + 1), 14.0, 60.0);
  for (const View& view : scene.views) {
    const auto [camera, cam_from_world] = UprightCamera(scene.CameraOf(view), view.cam_from_world, view.orientation);
    const Eigen::Vector2d c = draw(axes(view.CentreInWorld()));
    const Eigen::Matrix3d R = cam_from_world.R();
    const double half_width = 0.5 * camera.width_px / camera.FocalPx().x();
    std::string corners;
    for (const double side : {-half_width, half_width}) {
      const Eigen::Vector3d d = R.transpose() * Eigen::Vector3d(side, 0, 1);
      Eigen::Vector2d flat = axes(d);
      flat *= wedge / std::max(1.0, std::sqrt(1 + side * side));
      corners += fmt::format(" {:.1f},{:.1f}", c.x() + flat.x(), c.y() - flat.y());
    }
    svg += fmt::format(
        "<g class=\"{}\"><polygon points=\"{:.1f},{:.1f}{}\"/><circle cx=\"{:.1f}\" cy=\"{:.1f}\" "
        "r=\"3\"/><title>{}</title></g>\n",
        held_out.count(view.name) ? "held-out" : "camera", c.x(), c.y(), corners, c.x(), c.y(), EscapeHtml(view.name));
  }
  return svg + "</svg>\n";
}

}  // namespace lumi
