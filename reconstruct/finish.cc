#include "reconstruct/finish.h"

#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "reconstruct/reprojection.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/program/out_of_memory.h"
#include "scene/program/parallel_each.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// A mask moved along with its photo: nearest pixel, outside the photo = ignore. The photo's own camera is `distorted`,
// the undistorted copy's is `pinhole`.
Image8 UndistortMask(const Image8& mask, const Camera& distorted, const Camera& pinhole) {
  Image8 result(pinhole.width_px, pinhole.height_px, 1);
  const Eigen::Vector2d f = pinhole.FocalPx(), c = pinhole.PrincipalPointPx();
  ParallelEach(static_cast<std::size_t>(result.height), 16, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < result.width; ++x) {
      const Eigen::Vector3d ray((x + 0.5 - c.x()) / f.x(), (y + 0.5 - c.y()) / f.y(), 1);
      const auto source = distorted.Project(ray);
      if (!source) continue;
      const int u = static_cast<int>(std::floor(source->x() * mask.width / distorted.width_px));
      const int v = static_cast<int>(std::floor(source->y() * mask.height / distorted.height_px));
      if (u >= 0 && v >= 0 && u < mask.width && v < mask.height) result.At(x, y, 0) = mask.At(u, v, 0) > 127 ? 255 : 0;
    }
  });
  return result;
}

void WriteMasks(const Scene& distorted, const Scene& pinhole, const fs::path& masks, const fs::path& target,
                ProgressSink& sink) {
  Progress progress(sink, "masks", static_cast<long>(pinhole.views.size()));
  for (std::size_t i = 0; i < pinhole.views.size(); ++i) {
    progress.Step();
    // A photo that was undistorted may have got another ending.
    const std::string name = pinhole.views[i].name + ".png";
    const fs::path source = FindMask(masks, distorted.views[i].name);
    if (source.empty()) continue;
    const Image8 rgb = ReadImage8(source);
    Image8 mask(rgb.width, rgb.height, 1);
    for (int y = 0; y < rgb.height; ++y)
      for (int x = 0; x < rgb.width; ++x) mask.At(x, y, 0) = rgb.At(x, y, 0);
    const Camera& before = distorted.CameraOf(distorted.views[i]);
    WriteImage(target / name,
               before.IsPinhole() ? mask : UndistortMask(mask, before, pinhole.CameraOf(pinhole.views[i])));
  }
}

}  // namespace

static fs::path OldOf(fs::path target) { return target += ".old"; }

void ReplaceFolder(const fs::path& fresh, const fs::path& target) {
  ThrowIfMemoryRanOut();
  const fs::path old = OldOf(target);
  std::error_code ec;
  fs::remove_all(old, ec);
  if (fs::exists(target)) fs::rename(target, old);
  fs::rename(fresh, target);
  fs::remove_all(old, ec);
}

void ColorPoints(Scene& scene, ProgressSink& sink) {
  std::vector<std::vector<std::pair<std::size_t, Eigen::Vector2d>>> seen(scene.views.size());
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track)
      seen[static_cast<std::size_t>(o.view.value)].emplace_back(p, o.x_px);
  std::vector<Eigen::Vector3d> sum(scene.points.size(), Eigen::Vector3d::Zero());
  std::vector<int> count(scene.points.size(), 0);
  Progress progress(sink, "colours of the points", static_cast<long>(scene.views.size()));
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    progress.Step();
    if (seen[v].empty()) continue;
    const Image8 photo = ReadImage8(scene.ImagePath(scene.views[v]));
    for (const auto& [p, x] : seen[v]) {
      const int px = static_cast<int>(std::floor(x.x())), py = static_cast<int>(std::floor(x.y()));
      if (px < 0 || py < 0 || px >= photo.width || py >= photo.height) continue;
      for (int c = 0; c < 3; ++c) sum[p][c] += photo.At(px, py, c);
      ++count[p];
    }
  }
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (int c = 0; c < 3 && count[p] > 0; ++c)
      scene.points[p].color[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(std::lround(sum[p][c] / count[p]));
}

void RemoveMasksOfEarlierRun(const fs::path& scene) {
  const auto record = ReadProvenance(scene, "reconstruct");
  if (record && record->outputs.contains("masks")) fs::remove_all(scene / "masks");
}

void NoteHowPhotosWereTaken(const Scene& scene, const GivenCamera& given, const std::map<std::string, Camera>& skewed) {
  std::vector<TakenPhoto> photos = ReadTakenPhotos(scene.image_folder);
  if (photos.empty())  // none was undistorted: both cameras of a photo are one, and where it has none, any will do
    for (const View& view : scene.views) {
      const Eigen::Vector2i size = SizePx(scene, view);
      const Camera as_it_is = scene.frame == Frame::kMetric ? scene.CameraOf(view)
                                                            : Camera::Pinhole(size.x(), size.y(), size.x(), size.x(),
                                                                              size.x() / 2.0, size.y() / 2.0);
      photos.push_back({view.name, view.name, as_it_is, as_it_is});
    }
  std::map<std::string, std::string> original;
  for (const InputPhoto& photo : given.capture.photos) original[photo.name] = photo.OriginalName();
  const std::optional<Camera> resampled_to =
      given.resampled ? std::optional(PinholeInside(*given.resampled)) : std::nullopt;
  for (TakenPhoto& photo : photos) {
    if (const auto it = skewed.find(photo.taken); it != skewed.end()) photo.camera = it->second;
    if (const auto it = original.find(photo.taken); it != original.end()) photo.taken = it->second;
    if (!resampled_to) continue;
    photo.camera = *given.resampled;
    photo.pinhole = *resampled_to;
  }
  WriteTakenPhotos(photos, scene.image_folder);
}

Scene FinishScene(Scene scene, const ReconstructOptions& options, ReconstructSummary& summary, ProgressSink& sink) {
  std::set<std::string> models;
  for (const View& view : scene.views) models.insert(std::string(Name(scene.CameraOf(view).model)));
  for (const auto& model : models) summary.camera_model += (summary.camera_model.empty() ? "" : "+") + model;

  const fs::path fresh_images = options.scene / "images.part", fresh_masks = options.scene / "masks.part";
  fs::remove_all(fresh_images);
  fs::remove_all(fresh_masks);
  for (const char* replaced : {"images", "masks"}) {  // an earlier run was killed while it replaced them
    std::error_code ignored;
    fs::remove_all(OldOf(options.scene / replaced), ignored);
  }
  Scene pinhole = UndistortPhotos(scene, fresh_images, sink);
  if (!options.masks.empty()) WriteMasks(scene, pinhole, options.masks, fresh_masks, sink);
  summary.mean_reprojection_error_px = UpdatePointErrors(pinhole);
  summary.points = static_cast<int>(pinhole.points.size());
  summary.cameras = static_cast<int>(pinhole.cameras.size());
  summary.images_registered = static_cast<int>(pinhole.views.size());
  if (!pinhole.cameras.empty()) summary.focal_px = pinhole.cameras.front().FocalPx().x();

  UpdateFrameOfReference(pinhole);
  // From here on old and new must not mix: without a manifest the folder is no scene.
  CheckInterrupted();
  fs::remove(options.scene / "lumigraph.json");
  ReplaceFolder(fresh_images, options.scene / "images");
  if (fs::exists(fresh_masks))
    ReplaceFolder(fresh_masks, options.scene / "masks");
  else
    RemoveMasksOfEarlierRun(options.scene);
  pinhole.folder = options.scene;
  pinhole.image_folder = options.scene / "images";
  WriteScene(pinhole, options.scene);
  return pinhole;
}

}  // namespace lumi
