// What a scene's photos were before they were undistorted: masks and pictures of the background that belong to the
// photos as they were taken are undistorted with it. Kept beside the undistorted photos, in images/.taken.json:
//
//   {"cameras": [{"model": "RADIAL", "width": 640, "height": 480, "params": [...]}, {"model": "PINHOLE", ...}],
//    "photos": [{"name": "a.png", "taken": "a.heic", "camera": 0, "pinhole": 1}]}
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/model/camera.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"
#include "scene/undistort/undistorter.h"

namespace lumi {

struct TakenPhoto {
  std::string name;   // in the scene
  std::string taken;  // as its file was called: of another ending where the scene's photo is a copy
  Camera camera;      // with its distortion and skew, of the photo's size
  Camera pinhole;     // that took the undistorted photo; a scene's cameras may be estimated anew after it
};

// Without any photo, or where all are as they were taken, the record is removed. Throws MachineError.
void WriteTakenPhotos(const std::vector<TakenPhoto>& photos, const std::filesystem::path& image_folder);
// In the order in which they were written; empty: nothing is recorded. Throws InputError.
std::vector<TakenPhoto> ReadTakenPhotos(const std::filesystem::path& image_folder);

// Moves pictures of photos as they were taken to where the scene's undistorted photos show the same. A photo without
// an entry is as it was taken. Its functions may be called by any number of threads.
class TakenToScene {
 public:
  explicit TakenToScene(const Scene& scene);           // throws InputError as ReadTakenPhotos
  std::string Name(const View& view) const;            // as taken
  Eigen::Vector2i SizePx(const View& view) const;      // as taken
  Image8 Photo(const View& view, Image8 photo) const;  // bicubic; of SizePx()
  Image8 Mask(const View& view, Image8 mask) const;    // one channel: the nearest pixel, 0 beyond the photo

 private:
  struct Entry {
    TakenPhoto photo;
    std::shared_ptr<const Undistorter> undistorter;  // of a camera that took several; null: made when it is needed
  };
  const Entry* Of(const View& view) const;
  std::shared_ptr<const Undistorter> UndistorterOf(const View& view) const;  // null: nothing moves

  const Scene& scene_;
  std::map<std::string, Entry> entries_;
};

}  // namespace lumi
