#include "proxy/simplify/pixel_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/program/parallel_each.h"

namespace lumi {

std::vector<double> PixelScale(const Mesh& mesh, const std::vector<ProxyView>& views) {
  // A face that reaches into the frame with a corner only is seen too.
  constexpr double kBeyondFrame = 0.1;
  // Nearer than this share of a photo's median depth nothing is: one face at a camera would outweigh all others.
  constexpr double kNearest = 0.02;
  std::vector<double> scale(mesh.faces.size(), 0);
  std::vector<Eigen::Vector3d> middle(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    middle[f] = (mesh.vertices[static_cast<std::size_t>(mesh.faces[f][0])] +
                 mesh.vertices[static_cast<std::size_t>(mesh.faces[f][1])] +
                 mesh.vertices[static_cast<std::size_t>(mesh.faces[f][2])]) /
                3;
  for (const ProxyView& view : views) {
    const double width = view.render.size_px.x(), height = view.render.size_px.y();
    std::vector<double> depth(mesh.faces.size(), 0);  // 0: not in the frame
    ParallelEach(mesh.faces.size(), 4096, [&](std::size_t f) {
      const Eigen::Vector3d x = view.render.P.leftCols<3>() * (middle[f] - view.render.centre);
      if (!(x.z() > 0)) return;
      const double u = x.x() / x.z(), v = x.y() / x.z();
      if (u < -kBeyondFrame * width || u > (1 + kBeyondFrame) * width || v < -kBeyondFrame * height ||
          v > (1 + kBeyondFrame) * height)
        return;
      depth[f] = view.DepthOf(middle[f]);
    });
    std::vector<double> there;
    for (const double d : depth)
      if (d > 0) there.push_back(d);
    if (there.empty()) continue;
    std::ranges::nth_element(there, there.begin() + static_cast<std::ptrdiff_t>(there.size() / 2));
    const double nearest = kNearest * there[there.size() / 2];
    for (std::size_t f = 0; f < depth.size(); ++f)
      if (depth[f] > 0) scale[f] = std::max(scale[f], view.focal_px / std::max(depth[f], nearest));
  }
  double least = std::numeric_limits<double>::infinity();
  for (const double s : scale)
    if (s > 0) least = std::min(least, s);
  for (double& s : scale)
    if (!(s > 0)) s = std::isfinite(least) ? least : 1;
  return scale;
}

}  // namespace lumi
