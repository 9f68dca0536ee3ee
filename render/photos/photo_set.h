// The photographs of a scene in memory, with their pyramids, ready to be sampled.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "scene/model/image.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct PhotoOptions {
  bool pyramids = true;
  int halvings = 0;  // level 0 is the photo halved so often: a quarter of the memory each time
};

struct Photo {
  std::vector<Image8> levels;  // RGB, level 0 first; empty: not loaded
  int level0_shift = 0;        // level 0 is the photo halved this many times
};

// Of a pyramid's level; a pixel at least.
Eigen::Vector2i HalvedSize(const Eigen::Vector2i& size_px, int halvings);
// The levels of a photo from so many halvings on; at least one.
Photo HalvedTo(const Photo& photo, int halvings);

// Reads all photos in parallel. Throws InputError naming the file.
std::vector<Photo> LoadPhotos(const Scene& scene, const PhotoOptions& options, ProgressSink& progress);

// One, for the viewer's background loading.
Photo LoadPhoto(const Scene& scene, ViewId view, const PhotoOptions& options);

}  // namespace lumi
