// Silhouettes beside a scene: SCENE/silhouettes/NAME.png, white = object, named as COLMAP names masks (photo.jpg.png).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "proxy/hull/silhouette_cone.h"
#include "proxy/silhouettes/silhouette.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// Of every view that has one in `folder` (as FindMask, scene/files/scene_folder.h, finds it), cleaned. Throws
// InputError (unreadable, of another size than the photo), DataError where there is none at all. without: the names of
// the views that have none.
std::vector<SilhouetteView> ReadSilhouettes(const Scene& scene, const std::filesystem::path& folder,
                                            const CleanOptions& clean, std::vector<std::string>* without,
                                            ProgressSink& progress);

// How silhouettes are to be found in the photos; exactly one of these.
struct SilhouetteSource {
  std::string rule;                       // see colour_rule.h
  std::filesystem::path background;       // a photo of the background, or a folder with one for each photo, by name
  std::optional<Eigen::Vector3d> colour;  // of the background, 0..255
  bool border_colour = false;             // the background's colour is the median of the photo's border
  bool alpha = false;                     // the photos' own
  std::filesystem::path masks;            // a folder of masks
  bool undistort = false;                 // masks and backgrounds are of the photos as they were taken
  std::optional<Eigen::Vector4d> box_px;  // around the object in every photo: left, top, right, bottom
  double threshold = 40;                  // of colours against the background's, 0..441
};
std::string Validate(const SilhouetteSource& source);  // empty, or what is wrong

struct FoundSilhouette {
  std::string name;
  SilhouetteInfo info;
  bool no_mask = false;  // there was none of this photo: it counts as empty
};
// Written to `folder` as NAME.png. Throws InputError, DataError (every one of them empty or full).
std::vector<FoundSilhouette> MakeSilhouettes(const Scene& scene, const SilhouetteSource& source,
                                             const CleanOptions& clean, const std::filesystem::path& folder,
                                             ProgressSink& progress);

// Whether masks in `folder` may belong to photos from before they were undistorted: these were, and the folder is not
// the scene's.
bool MayBeDistorted(const Scene& scene, const std::filesystem::path& folder);

}  // namespace lumi
