#include "render/photos/photo_set.h"

#include <algorithm>
#include <utility>

#include "render/photos/photo_correction.h"
#include "scene/files/image_io.h"
#include "scene/program/parallel.h"

namespace lumi {

Photo LoadPhoto(const Scene& scene, ViewId view, const PhotoOptions& options) {
  Photo photo;
  const View& of = scene.views[static_cast<std::size_t>(view.value)];
  Image8 pixels = ReadImage8(scene.ImagePath(of), 3);
  if (of.correction) Correct(*of.correction, pixels);
  photo.levels = BuildPyramid(std::move(pixels), options.pyramids ? 0 : 1 + options.halvings);
  const int finer = std::min(options.halvings, static_cast<int>(photo.levels.size()) - 1);
  photo.levels.erase(photo.levels.begin(), photo.levels.begin() + finer);
  photo.level0_shift = finer;
  return photo;
}

Eigen::Vector2i HalvedSize(const Eigen::Vector2i& size_px, int halvings) {
  return {std::max(1, size_px.x() >> halvings), std::max(1, size_px.y() >> halvings)};
}

Photo HalvedTo(const Photo& photo, int halvings) {
  const int from = std::clamp(halvings - photo.level0_shift, 0, static_cast<int>(photo.levels.size()) - 1);
  Photo halved;
  halved.levels.assign(photo.levels.begin() + from, photo.levels.end());
  halved.level0_shift = photo.level0_shift + from;
  return halved;
}

std::vector<Photo> LoadPhotos(const Scene& scene, const PhotoOptions& options, ProgressSink& sink) {
  std::vector<Photo> photos(scene.views.size());
  Progress progress(sink, "reading photos", static_cast<long>(photos.size()));
  ParallelFor(photos.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      photos[i] = LoadPhoto(scene, {static_cast<std::int32_t>(i)}, options);
      progress.Step();
    }
  });
  return photos;
}

}  // namespace lumi
