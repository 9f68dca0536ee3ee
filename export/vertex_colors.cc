#include "export/vertex_colors.h"

#include <algorithm>
#include <cmath>

#include "render/cpu/blend.h"
#include "render/world/visibility_maps.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// A camera at `centre` that looks at `x`; its own picture does not matter.
RenderView LookingAt(const Eigen::Vector3d& x, const Eigen::Vector3d& centre) {
  const Eigen::Vector3d z = (x - centre).normalized();
  const Eigen::Vector3d across = std::abs(z.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d right = z.cross(across).normalized();
  Eigen::Matrix3d m;
  m << right.transpose(), z.cross(right).transpose(), z.transpose();
  m.topRows<2>() *= 1000;
  RenderView view;
  view.P.leftCols<3>() = m;
  view.P.col(3) = -m * centre;
  view.centre = centre;
  view.size_px = {1000, 1000};
  return view;
}

class Colorer {
 public:
  explicit Colorer(const Lumigraph& lumigraph)
      : lumigraph_(lumigraph), traced_(lumigraph.scene(), lumigraph.mesh()), settings_(lumigraph.settings()) {
    settings_.similarity = Similarity::kIdentity;
    settings_.time = false;
    if (settings_.k == 0) settings_.k = kMaxBlend;
    for (const RenderView& view : traced_.sources.views) centres_.push_back(view.centre);
  }
  const std::vector<Eigen::Vector3d>& centres() const { return centres_; }

  // x and its normal in the normalised frame; false where no photo sees it.
  bool Color(const Eigen::Vector3d& x, const Eigen::Vector3d& normal, WeighScratch& scratch,
             Eigen::Array3f& rgb) const {
    std::vector<double> distances;
    for (const Eigen::Vector3d& c : centres_) distances.push_back((c - x).norm());
    const double distance = Median(distances);
    Eigen::Vector3d towards = normal;
    if (!(towards.norm() > 0))
      towards = (centres_[static_cast<std::size_t>(std::ranges::min_element(distances) - distances.begin())] - x)
                    .normalized();
    const RenderView view = LookingAt(x, x + distance * towards);
    const RelativeSources sources = MakeRelative(traced_.sources, view, {}, settings_.fov_feather);
    const RayWeights weights =
        Weigh({sources, settings_.visibility && !traced_.maps.empty() ? &traced_.maps : nullptr, settings_},
              ProxyRay(Eigen::Vector3d(-towards), distance, normal.cast<float>()), scratch);
    if (weights.count == 0 || !(weights.alpha > 0)) return false;
    rgb = Eigen::Array3f::Zero();
    for (int i = 0; i < weights.count; ++i) {
      const auto n = static_cast<std::size_t>(i);
      const auto j = static_cast<std::size_t>(weights.camera[n]);
      const RenderView& source = traced_.sources.views[j];
      const Eigen::Vector2d at = (source.P * x.homogeneous()).hnormalized();
      rgb += weights.weight[n] * SamplePhoto(lumigraph_.photos()[j], static_cast<float>(at.x() / source.size_px.x()),
                                             static_cast<float>(at.y() / source.size_px.y()), 0);
    }
    rgb = (rgb / 255).min(1).max(0);
    return true;
  }

 private:
  const Lumigraph& lumigraph_;
  TracedProxy traced_;
  RadianceSettings settings_;
  std::vector<Eigen::Vector3d> centres_;
};

}  // namespace

std::vector<Eigen::Vector3d> VertexNormals(const Mesh& mesh, const std::vector<Eigen::Vector3d>& centres) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& f : mesh.faces) {
    const auto at = [&](std::size_t i) -> const Eigen::Vector3d& {
      return mesh.vertices[static_cast<std::size_t>(f[i])];
    };
    const Eigen::Vector3d area = (at(1) - at(0)).cross(at(2) - at(0));
    for (const std::int32_t v : f) normals[static_cast<std::size_t>(v)] += area;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!(normals[i].norm() > 0)) continue;
    normals[i].normalize();
    long before = 0;
    for (const Eigen::Vector3d& c : centres) before += normals[i].dot(c - mesh.vertices[i]) > 0 ? 1 : -1;
    if (before < 0) normals[i] = -normals[i];
  }
  return normals;
}

VertexColors ColorVertices(const Lumigraph& lumigraph, ProgressSink& sink) {
  const Colorer colorer(lumigraph);
  Mesh mesh = lumigraph.mesh();
  for (Eigen::Vector3d& v : mesh.vertices) v = lumigraph.scene().normalized_from_world * v;
  const std::vector<Eigen::Vector3d> normals = VertexNormals(mesh, colorer.centres());
  VertexColors colors;
  colors.rgb.resize(mesh.vertices.size());
  std::vector<char> seen(mesh.vertices.size());
  Progress progress(sink, "colouring vertices", static_cast<long>(mesh.vertices.size()));
  ParallelFor(mesh.vertices.size(), 256, [&](std::size_t begin, std::size_t end) {
    WeighScratch scratch;
    for (std::size_t i = begin; i < end; ++i)
      seen[i] = colorer.Color(mesh.vertices[i], normals[i], scratch, colors.rgb[i]) ? 1 : 0;
    progress.Step(static_cast<long>(end - begin));
  });
  Eigen::Array3d mean = Eigen::Array3d::Zero();
  double n = 0;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] != 0) {
      mean += colors.rgb[i].cast<double>();
      ++n;
    }
  mean = n > 0 ? Eigen::Array3d(mean / n) : Eigen::Array3d::Constant(0.5);
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] == 0) colors.rgb[i] = mean.cast<float>();
  colors.seen.assign(seen.begin(), seen.end());
  return colors;
}

}  // namespace lumi
