#include "proxy/hull/coverage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// Rows of pixels whose centres a triangle covers, filled. Its border counts: two triangles leave no gap between them.
void FillTriangle(const std::array<Eigen::Vector2d, 3>& t, Image8& image) {
  const auto [low_y, high_y] = std::minmax({t[0].y(), t[1].y(), t[2].y()});
  const int from = static_cast<int>(std::ceil(std::max(low_y - 0.5, 0.0))),
            to = static_cast<int>(std::floor(std::min(high_y - 0.5, image.height - 1.0)));
  for (int y = from; y <= to; ++y) {
    const double at = y + 0.5;
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (std::size_t k = 0; k < 3; ++k) {
      // From the lower end to the upper: an edge gives the same number in both of its triangles.
      const bool up = t[k].y() < t[(k + 1) % 3].y();
      const Eigen::Vector2d& a = up ? t[k] : t[(k + 1) % 3];
      const Eigen::Vector2d& b = up ? t[(k + 1) % 3] : t[k];
      if (at < a.y() || at > b.y()) continue;
      if (a.y() == b.y()) {
        left = std::min({left, a.x(), b.x()});
        right = std::max({right, a.x(), b.x()});
        continue;
      }
      const double x = a.x() + (at - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (!(left <= right) || right < 0.5 || left > image.width) continue;
    const int x_from = static_cast<int>(std::ceil(std::max(left - 0.5, 0.0))),
              x_to = static_cast<int>(std::floor(std::min(right - 0.5, image.width - 1.0)));
    if (x_from <= x_to) std::fill(image.Row(y) + x_from, image.Row(y) + x_to + 1, std::uint8_t{255});
  }
}

}  // namespace

Image8 RenderOutline(const Mesh& mesh, const Matrix34d& P, int width, int height) {
  Image8 image(width, height, 1);
  std::vector<Eigen::Vector2d> pixels(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto x = Project(P, mesh.vertices[v]);
    pixels[v] = x ? *x : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  for (const auto& f : mesh.faces) {
    const std::array<Eigen::Vector2d, 3> t{pixels[static_cast<std::size_t>(f[0])],
                                           pixels[static_cast<std::size_t>(f[1])],
                                           pixels[static_cast<std::size_t>(f[2])]};
    // What a front face covers a back face covers too: one kind is enough. NaN is neither.
    const Eigen::Vector2d a = t[1] - t[0], b = t[2] - t[0];
    if (a.x() * b.y() - a.y() * b.x() <= 0) FillTriangle(t, image);
  }
  return image;
}

SilhouetteFit MeasureSilhouette(const Mesh& mesh, const SilhouetteView& view, std::vector<UncoveredPixel>* uncovered) {
  if (uncovered != nullptr) uncovered->clear();
  const Image8 outline = RenderOutline(mesh, view.P, view.mask.width, view.mask.height);
  // Beyond its own frame a silhouette may go on: the image's sides are no border of it.
  cv::Mat inside(view.mask.height, view.mask.width, CV_8U), depth;
  std::size_t silhouette = 0, both = 0, either = 0;
  for (int y = 0; y < view.mask.height; ++y) {
    for (int x = 0; x < view.mask.width; ++x) {
      const bool s = view.mask.At(x, y, 0) >= 128, m = outline.At(x, y, 0) != 0;
      inside.at<std::uint8_t>(y, x) = s ? 255 : 0;
      silhouette += s ? 1 : 0;
      both += s && m ? 1 : 0;
      either += s || m ? 1 : 0;
    }
  }
  SilhouetteFit fit;
  fit.coverage = silhouette > 0 ? static_cast<double>(both) / static_cast<double>(silhouette) : 1;
  fit.iou = either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 1;
  if (both == silhouette) return fit;
  cv::distanceTransform(inside, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = 0; y < view.mask.height; ++y) {
    for (int x = 0; x < view.mask.width; ++x) {
      if (view.mask.At(x, y, 0) < 128 || outline.At(x, y, 0) != 0) continue;
      fit.deepest_uncovered_px = std::max(fit.deepest_uncovered_px, depth.at<float>(y, x) - 0.5);
      if (uncovered != nullptr) uncovered->push_back({x, y, depth.at<float>(y, x) - 0.5F});
    }
  }
  return fit;
}

std::vector<SilhouetteFit> MeasureSilhouettes(const Mesh& mesh, const std::vector<SilhouetteView>& views,
                                              std::vector<std::vector<UncoveredPixel>>* uncovered) {
  std::vector<SilhouetteFit> fits(views.size());
  if (uncovered != nullptr) uncovered->assign(views.size(), {});
  ParallelEach(views.size(), 1, [&](std::size_t v) {
    fits[v] = MeasureSilhouette(mesh, views[v], uncovered != nullptr ? &(*uncovered)[v] : nullptr);
  });
  return fits;
}

SilhouetteFitSummary Summarize(const std::vector<SilhouetteFit>& fits) {
  SilhouetteFitSummary s;
  std::vector<double> ious;
  for (const SilhouetteFit& f : fits) {
    s.coverage_min = std::min(s.coverage_min, f.coverage);
    s.iou_min = std::min(s.iou_min, f.iou);
    s.deepest_uncovered_px = std::max(s.deepest_uncovered_px, f.deepest_uncovered_px);
    ious.push_back(f.iou);
  }
  if (!ious.empty()) s.iou_median = Median(ious);
  return s;
}

double EnclosedVolume(const Mesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // digits wherever the scene is
  for (const Eigen::Vector3d& v : mesh.vertices) middle += v / static_cast<double>(mesh.vertices.size());
  double six = 0;
  for (const auto& f : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[static_cast<std::size_t>(f[0])] - middle,
                          b = mesh.vertices[static_cast<std::size_t>(f[1])] - middle,
                          c = mesh.vertices[static_cast<std::size_t>(f[2])] - middle;
    six += a.dot(b.cross(c));
  }
  return six / 6;
}

}  // namespace lumi
