#include "render/show/camera_configuration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <set>
#include <vector>

#include "render/radiance/sources.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

const cv::Scalar kWhite(255, 255, 255), kBlue(70, 110, 205), kRed(215, 40, 35), kGrey(205, 205, 205),
    kFrame(225, 225, 225);
constexpr std::size_t kMostEdges = 30000, kMostPoints = 30000;
constexpr double kFrustumSize = 0.06;  // of the panel: a camera is to be seen, and not to hide its neighbours
constexpr double kMargin = 1.12;
constexpr int kShift = 4;  // fractional bits of a drawn coordinate

// Orthographic: right and down in the panel.
struct Projection {
  Eigen::Vector3d right, down, centre;
  double scale = 1;
  int side = 0, offset = 0;
  cv::Point At(const Eigen::Vector3d& x) const {
    const double u = offset + side / 2.0 + scale * right.dot(x - centre), v = side / 2.0 + scale * down.dot(x - centre);
    const double limit = 1e5;  // far outside: cut off by the panel
    return {static_cast<int>(std::lround(std::clamp(u, -limit, limit) * (1 << kShift))),
            static_cast<int>(std::lround(std::clamp(v, -limit, limit) * (1 << kShift)))};
  }
};

void Line(cv::Mat& image, const Projection& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
          const cv::Scalar& color, int thickness) {
  cv::line(image, p.At(a), p.At(b), color, thickness, cv::LINE_AA, kShift);
}

// The pyramid of a view: apex at its centre, the photo's corners at `depth` along the axis.
void Frustum(cv::Mat& image, const Projection& p, const RenderView& view, double depth, const cv::Scalar& color,
             int thickness) {
  const std::array<Eigen::Vector3d, 4> corner = CornersAt(view, depth);
  for (std::size_t i = 0; i < 4; ++i) {
    Line(image, p, view.centre, corner[i], color, thickness);
    Line(image, p, corner[i], corner[(i + 1) % 4], color, thickness);
  }
}

}  // namespace

Image8 DrawCameraConfiguration(const Scene& scene, const Mesh& proxy, const RenderView& desired, int side_px) {
  const Similarity3 world = scene.normalized_from_world.Inverse();
  std::vector<RenderView> views;
  for (const View& v : scene.views) views.push_back(MakeRenderView(scene, v));

  // What must be in the picture: all cameras and the middle of the points; a proxy's backdrop may reach far beyond.
  std::vector<Eigen::Vector3d> shown;
  for (const RenderView& v : views) shown.push_back(v.centre);
  shown.push_back(desired.centre);
  std::vector<double> far;
  for (const Point& p : scene.points) far.push_back((p.x_in_world - world.translation).norm());
  if (!far.empty()) {
    const double reach = NthSmallest(far, far.size() * 8 / 10);
    for (const Point& p : scene.points)
      if ((p.x_in_world - world.translation).norm() <= reach) shown.push_back(p.x_in_world);
  } else {
    shown.insert(shown.end(), proxy.vertices.begin(), proxy.vertices.end());
  }

  const Eigen::Vector3d up = scene.up.normalized();
  // Seen from behind the cameras: along their mean axis, levelled.
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
  for (const RenderView& v : views) ahead += v.P.row(2).head<3>().transpose().normalized();
  ahead -= up * up.dot(ahead);
  const Eigen::Vector3d forward = ahead.norm() > 1e-6 ? ahead.normalized() : up.unitOrthogonal();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  const Eigen::Vector3d oblique = (forward - 0.6 * up + 0.7 * right).normalized();
  const std::array<std::pair<Eigen::Vector3d, Eigen::Vector3d>, 3> panels = {
      std::pair{right, Eigen::Vector3d(-forward)}, std::pair{forward, Eigen::Vector3d(-up)},
      std::pair{oblique.cross(up).normalized(), oblique.cross(oblique.cross(up).normalized()).normalized()}};

  cv::Mat image(side_px, 3 * side_px, CV_8UC3, kWhite);
  for (int i = 0; i < 3; ++i) {
    Projection p;
    p.right = panels[static_cast<std::size_t>(i)].first;
    p.down = panels[static_cast<std::size_t>(i)].second;
    p.side = side_px;
    p.offset = 0;
    Eigen::Vector2d low(1e300, 1e300), high(-1e300, -1e300);
    for (const auto& x : shown) {
      const Eigen::Vector2d q(p.right.dot(x), p.down.dot(x));
      low = low.cwiseMin(q);
      high = high.cwiseMax(q);
    }
    const Eigen::Vector2d middle = 0.5 * (low + high);
    p.centre = middle.x() * p.right + middle.y() * p.down;
    const double extent = std::max((high - low).maxCoeff(), 1e-12);
    p.scale = side_px / (kMargin * extent * (1 + 2 * kFrustumSize));
    cv::Mat panel = image.colRange(i * side_px, (i + 1) * side_px);

    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& f : proxy.faces)
      for (std::size_t e = 0; e < 3 && edges.size() < kMostEdges; ++e) {
        const auto a = static_cast<std::uint32_t>(f[e]), b = static_cast<std::uint32_t>(f[(e + 1) % 3]);
        edges.insert({std::min(a, b), std::max(a, b)});
      }
    for (const auto& [a, b] : edges) Line(panel, p, proxy.vertices[a], proxy.vertices[b], kGrey, 1);
    const std::size_t step = std::max<std::size_t>(1, scene.points.size() / kMostPoints);
    for (std::size_t k = 0; k < scene.points.size(); k += step) {
      const Point& x = scene.points[k];
      cv::circle(panel, p.At(x.x_in_world), 1 << kShift, cv::Scalar(x.color[0], x.color[1], x.color[2]), cv::FILLED,
                 cv::LINE_AA, kShift);
    }
    for (const RenderView& v : views) Frustum(panel, p, v, kFrustumSize * extent, kBlue, 1);
    Frustum(panel, p, desired, 1.6 * kFrustumSize * extent, kRed, 2);
    cv::rectangle(panel, {0, 0}, {side_px - 1, side_px - 1}, kFrame);
  }
  Image8 out(image.cols, image.rows, 3);
  for (int y = 0; y < image.rows; ++y) std::memcpy(out.Row(y), image.ptr(y), static_cast<std::size_t>(3 * image.cols));
  return out;
}

}  // namespace lumi
