#include "render/radiance/sources.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace lumi {

std::array<Eigen::Vector3d, 4> CornersAt(const RenderView& view, double depth) {
  const Eigen::Matrix3d M = view.P.leftCols<3>() / view.P.row(2).head<3>().norm(), rays = M.inverse();
  const double w = view.size_px.x(), h = view.size_px.y();
  std::array<Eigen::Vector3d, 4> corners = {Eigen::Vector3d(0, 0, 1), {w, 0, 1}, {w, h, 1}, {0, h, 1}};
  for (Eigen::Vector3d& corner : corners) corner = view.centre + depth * rays * corner;
  return corners;
}

RenderView Normalized(const RenderView& view, const Similarity3& normalized_from_world) {
  const Similarity3 world = normalized_from_world.Inverse();
  RenderView n = view;
  // P x_world = P (s R x_n + t): the scale stays on the matrix, so that w is a depth in world units; RelativeSources
  // rescales it.
  const Eigen::Matrix3d M = view.P.leftCols<3>();
  n.P.leftCols<3>() = world.scale * M * world.rotation.toRotationMatrix();
  n.P.col(3) = M * world.translation + view.P.col(3);
  n.centre = normalized_from_world * view.centre;
  return n;
}

Sources MakeSources(const Scene& scene) {
  Sources sources;
  sources.normalized_from_world = scene.normalized_from_world;
  sources.views.reserve(scene.views.size());
  for (const View& view : scene.views)
    sources.views.push_back(Normalized(MakeRenderView(scene, view), scene.normalized_from_world));
  TakeFields(sources);
  return sources;
}

void TakeFields(Sources& sources) {
  PhotoFields fields;
  MeasureList::ForEach([&]<typename M> {
    if constexpr (Estimated<M>) {
      PhotoField& field = fields[static_cast<std::size_t>(MeasureList::IndexOf<M>())];
      for (std::size_t j = 0; j < sources.views.size(); ++j) {
        const auto& grids = sources.views[j].grids;
        if (!grids || !grids->contains(M::kName)) continue;
        const PhotoGrid& grid = grids->find(M::kName)->second;
        const auto cells = static_cast<std::size_t>(grid.columns * grid.rows);
        if (field.value.empty()) {
          field.columns = grid.columns;
          field.rows = grid.rows;
          field.value.assign(cells * sources.views.size(), 1.0F);
        }
        if (grid.columns != field.columns || grid.rows != field.rows || grid.value.size() != cells)
          throw std::invalid_argument("TakeFields: the photos' grids differ in size");
        std::copy(grid.value.begin(), grid.value.end(), field.value.begin() + static_cast<std::ptrdiff_t>(cells * j));
      }
    }
  });
  sources.fields = std::make_shared<const PhotoFields>(std::move(fields));
}

RelativeSources MakeRelative(const Sources& sources, const RenderView& desired, const std::vector<bool>& use,
                             double fov_feather) {
  constexpr int kLanes = RelativeSources::kLanes;
  RelativeSources r;
  r.fields = sources.fields;
  r.count = static_cast<int>(sources.views.size());
  r.padded = (r.count + kLanes - 1) / kLanes * kLanes;
  const auto n = static_cast<std::size_t>(r.padded);
  for (auto* v : {&r.dx, &r.dy, &r.dz, &r.width_px, &r.height_px, &r.enabled}) v->assign(n, 0.0F);
  for (auto& m : r.m) m.assign(n, 0.0F);
  r.feather_px.assign(n, 1.0F);
  r.focal_px.assign(n, 1.0F);
  r.exact.assign(RelativeSources::kExact * n, 0.0);
  r.view.assign(n, -1);
  r.dt_s.assign(n, 0.0F);
  r.timed.assign(n, 0.0F);
  r.gain.assign(n, 1.0F);
  const Eigen::Matrix3d view = desired.P.leftCols<3>() / desired.P.row(2).head<3>().norm();
  for (int i = 0; i < 9; ++i) r.desired_m[i] = static_cast<float>(view(i / 3, i % 3));
  r.desired_focal_px = static_cast<float>(std::sqrt(std::abs(view.determinant())));
  for (const RenderView& s : sources.views)
    if (s.time_s) {
      r.time_origin_s = *s.time_s;
      break;
    }
  for (std::size_t j = 0; j < sources.views.size(); ++j) {
    const RenderView& s = sources.views[j];
    const Eigen::Vector3d D = s.centre - desired.centre;
    r.dx[j] = static_cast<float>(D.x());
    r.dy[j] = static_cast<float>(D.y());
    r.dz[j] = static_cast<float>(D.z());
    Eigen::Matrix3d M = s.P.leftCols<3>();
    M /= M.row(2).norm();  // the third row of K is (0,0,1): this makes w the depth along the optical axis
    for (int i = 0; i < 9; ++i) r.m[i][j] = static_cast<float>(M(i / 3, i % 3));
    // K from M = K R: the area a pixel covers at unit depth is 1 / (fx fy) = 1 / |det M|.
    r.focal_px[j] = static_cast<float>(std::sqrt(std::abs(M.determinant())));
    r.width_px[j] = static_cast<float>(s.size_px.x());
    r.height_px[j] = static_cast<float>(s.size_px.y());
    r.feather_px[j] = static_cast<float>(fov_feather * s.size_px.minCoeff());
    // Differences in double: video times run into hours.
    r.dt_s[j] = s.time_s ? static_cast<float>(*s.time_s - r.time_origin_s) : 0.0F;
    r.timed[j] = s.time_s ? 1.0F : 0.0F;
    r.gain[j] = static_cast<float>(desired.gain / s.gain);
    double* exact = r.exact.data() + RelativeSources::kExact * j;
    for (int i = 0; i < 3; ++i) exact[i] = D[i];
    for (int i = 0; i < 9; ++i) exact[3 + i] = M(i / 3, i % 3);
    exact[12] = s.size_px.x();
    exact[13] = s.size_px.y();
    exact[14] = fov_feather * s.size_px.minCoeff();
    r.view[j] = static_cast<std::int32_t>(j);
    r.enabled[j] = use.empty() || use[j] ? 1.0F : 0.0F;
  }
  return r;
}

void Subset(const RelativeSources& all, std::span<const std::int32_t> photos, RelativeSources& subset) {
  constexpr std::size_t kLanes = RelativeSources::kLanes, kExact = RelativeSources::kExact;
  subset.time_origin_s = all.time_origin_s;
  subset.fields = all.fields;
  std::copy(std::begin(all.desired_m), std::end(all.desired_m), std::begin(subset.desired_m));
  subset.desired_focal_px = all.desired_focal_px;
  subset.count = static_cast<int>(photos.size());
  const std::size_t n = (photos.size() + kLanes - 1) / kLanes * kLanes;
  subset.padded = static_cast<int>(n);
  const auto take = [&](const std::vector<float>& from, std::vector<float>& to, float padding) {
    to.resize(n);
    for (std::size_t i = 0; i < n; ++i) to[i] = i < photos.size() ? from[static_cast<std::size_t>(photos[i])] : padding;
  };
  for (const auto& [from, to] : {std::pair(&all.dx, &subset.dx),
                                 {&all.dy, &subset.dy},
                                 {&all.dz, &subset.dz},
                                 {&all.width_px, &subset.width_px},
                                 {&all.height_px, &subset.height_px},
                                 {&all.dt_s, &subset.dt_s},
                                 {&all.timed, &subset.timed},
                                 {&all.enabled, &subset.enabled}})
    take(*from, *to, 0.0F);
  for (const auto& [from, to] :
       {std::pair(&all.feather_px, &subset.feather_px), {&all.focal_px, &subset.focal_px}, {&all.gain, &subset.gain}})
    take(*from, *to, 1.0F);
  for (std::size_t i = 0; i < 9; ++i) take(all.m[i], subset.m[i], 0.0F);
  subset.view.assign(n, -1);
  subset.exact.assign(kExact * n, 0.0);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const auto j = static_cast<std::size_t>(photos[i]);
    subset.view[i] = all.view[j];
    std::copy_n(all.exact.begin() + static_cast<std::ptrdiff_t>(kExact * j), kExact,
                subset.exact.begin() + static_cast<std::ptrdiff_t>(kExact * i));
  }
}

}  // namespace lumi
