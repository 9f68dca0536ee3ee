// A scene on disk (see CONVENTIONS.md, "A scene folder"). Opens ours, any COLMAP workspace (images + sparse) as it is
// and without writing to it, and transforms.json.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

constexpr int kSceneFormatVersion = 1;

struct OpenOptions {
  bool rescale_cameras = false;   // photos of another size than their camera: scale the camera instead of refusing
  // Where undistorted copies of distorted photos go (a cache). Empty: a folder of the user's cache directory, keyed by
  // the workspace and its model.
  std::filesystem::path cache_folder;
  bool check_photos = true;       // that each exists and has its camera's size (headers only)
  bool undistort = true;          // false: cameras stay as they are (distorted ones cannot be rendered)
};

// Throws InputError (corrupt, newer version, a camera that does not fit its photo) or UsageError (no scene there, with
// what was looked for).
Scene OpenScene(const std::filesystem::path& path, const OpenOptions& options, ProgressSink& progress);

// lumigraph.json and sparse/. Photos are not copied; scene.image_folder must be folder/images or outside.
void WriteScene(const Scene& scene, const std::filesystem::path& folder);
// lumigraph.json alone (active_proxy, up ...): sparse/ stays.
void WriteManifest(const Scene& scene, const std::filesystem::path& folder);

// Writes undistorted pinhole copies of all photos and returns the scene with pinhole cameras and point observations
// moved along. A photo whose camera has no distortion is hard-linked or copied. Focal length is kept; the image size
// too, principal point too; pixels from outside the photo are black and their mask is returned nowhere: `min_scale`
// crops by scaling so that no such pixel is inside (COLMAP's blank_pixels = 0).
Scene UndistortPhotos(const Scene& scene, const std::filesystem::path& image_folder, ProgressSink& progress);

// Proxies: SCENE/proxies/NAME.ply.
std::filesystem::path ProxyPath(const std::filesystem::path& scene_folder, const std::string& name);
std::vector<std::string> ListProxies(const std::filesystem::path& scene_folder);
// By name, or the active one for an empty name. Throws UsageError naming those that exist.
Mesh LoadProxy(const Scene& scene, const std::string& name);

}  // namespace lumi
