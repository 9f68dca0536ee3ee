#include "render/path/matrix_path.h"

#include <fmt/format.h>

#include <unordered_map>

#include "render/time/clock.h"
#include "render/time/photo_order.h"
#include "scene/program/error.h"

namespace lumi {

MatrixPath MatrixPathOfPhotos(const Scene& scene, double fps) {
  MatrixPath path;
  path.fps = fps;
  const Eigen::Vector2i size = SizePx(scene, scene.views.front());
  path.width_px = size.x();
  path.height_px = size.y();
  const PhotoOrder order(scene);
  for (int rank = 0; rank < order.count(); ++rank) {
    const View& v = scene.views[static_cast<std::size_t>(order.view(rank))];
    MatrixKey key;
    key.time_s = rank / fps;
    key.P = scene.frame == Frame::kMetric ? MakeRenderView(scene, v).P : v.P;
    const Eigen::Vector2i own = SizePx(scene, v);
    key.P.row(0) *= static_cast<double>(size.x()) / own.x();
    key.P.row(1) *= static_cast<double>(size.y()) / own.y();
    key.view = v.name;
    path.keys.push_back(key);
  }
  return path;
}

std::optional<MatrixPath> MatrixPathFor(const Scene& scene, const std::filesystem::path& file, double fps) {
  if (!file.empty() && IsMatrixPath(file)) return ReadMatrixPath(file);
  if (scene.frame == Frame::kMetric) return std::nullopt;
  if (file.empty()) return MatrixPathOfPhotos(scene, fps);
  throw DataError(
      fmt::format("{} is a path of poses, which a {} scene does not have", file.generic_string(), Name(scene.frame)),
      "a path of projection matrices comes from lumi-stabilize", scene.folder);
}

std::vector<RenderView> MatrixViews(const Scene& scene, const MatrixPath& path, int width_px, int height_px) {
  std::unordered_map<std::string, const View*> called;
  for (const View& v : scene.views) called[v.name] = &v;
  const std::optional<double> first = FirstTime(scene);
  std::vector<RenderView> views;
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    const MatrixKey& key = path.keys[i];
    RenderView v;
    v.P = key.P;
    v.P.row(0) *= static_cast<double>(width_px) / path.width_px;
    v.P.row(1) *= static_cast<double>(height_px) / path.height_px;
    v.size_px = {width_px, height_px};
    if (first) v.time_s = *first + (key.time_s - path.keys.front().time_s);
    if (!key.view.empty()) {
      const auto found = called.find(key.view);
      if (found == called.end())
        throw DataError(fmt::format("key {} of the path is of the photo {}, which the scene has not", i, key.view),
                        "take the scene that the path was made for", scene.folder);
      v.time_s = found->second->time_s;
      v.gain = found->second->gain / (found->second->correction ? found->second->correction->scale : 1);
    }
    if (scene.frame == Frame::kMetric) {
      const Eigen::Vector4d c = CentreOfProjection(v.P);
      if (!(std::abs(c.w()) > 1e-12))
        throw DataError(fmt::format("the centre of projection of key {} lies at infinity", i), "", scene.folder);
      v.centre = c.head<3>() / c.w();
    }
    views.push_back(v);
  }
  return views;
}

}  // namespace lumi
