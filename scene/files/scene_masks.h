// The masks of a scene's photos, in masks/ beside them: what is black is ignored (COLMAP's convention, and its names).
#pragma once

#include <filesystem>
#include <optional>

#include "scene/files/taken_photos.h"

namespace lumi {

// SCENE/masks. In another tool's workspace also masks/ beside the images/ of a folder above, where the scene was given
// as its model's folder. It need not be there.
std::filesystem::path MasksFolder(const Scene& scene);

class SceneMasks {
 public:
  // Of MasksFolder. In a scene of this suite they show what its photos show; in another tool's workspace they belong to
  // the photos as they were taken. Throws InputError as ReadTakenPhotos.
  explicit SceneMasks(const Scene& scene);
  // Those of `input`, for the photos of a scene that was made of it and may not have its folder yet.
  SceneMasks(const Scene& scene, const Scene& input);

  // Whether there are masks that belong to photos as they were taken.
  bool as_taken() const { return taken_.has_value(); }
  std::filesystem::path File(const View& view) const;  // empty: the photo has no mask
  // One channel, of the file's size, or of the undistorted photo's where it was moved along; empty: none. Throws
  // InputError. May be called by any number of threads.
  Image8 Of(const View& view) const;

 private:
  std::filesystem::path folder_;
  std::optional<TakenToScene> taken_;
};

}  // namespace lumi
