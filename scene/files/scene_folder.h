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
  // Photos of another size than their camera: scale the camera and its observations instead of refusing. Distortion
  // parameters stay as they are. (A photo turned by 90 degrees is refused all the same.)
  bool rescale_cameras = false;
  // Where undistorted copies of distorted photos go, in images/ below it. Empty: a folder of the user's cache directory
  // (XDG_CACHE_HOME or ~/.cache, then lumigraph/), keyed by the photos' folder, their names and their cameras.
  std::filesystem::path cache_folder;
  bool check_photos = true;  // that each exists and has its camera's size (headers only)
  bool undistort = true;     // false: cameras stay as they are (distorted ones cannot be rendered)
};

// path: a folder with lumigraph.json; one with a COLMAP model in it, in sparse/ or in sparse/0/, photos in images/
// beside any of these or right in it; the model's own folder; transforms.json or a folder with one. up,
// normalized_from_world and the photos' orientations are stored in ours; for others' they are estimated, and read from
// the photos (with check_photos). Throws InputError (corrupt, newer version, photo
// absent, a camera that does not fit its photo) or UsageError (no scene there, with what was looked for). A scene of
// ours may be quasi-affine or projective: a caller that needs cameras says so with RequireMetric (scene/model/scene.h).
Scene OpenScene(const std::filesystem::path& path, const OpenOptions& options, ProgressSink& progress);

// lumigraph.json and sparse/, or projective.json where the scene is not metric (the manifest says which of them counts,
// where an earlier scene left the other). Photos are not copied; scene.image_folder must lie in `folder`: one elsewhere
// is refused when the scene is read.
void WriteScene(const Scene& scene, const std::filesystem::path& folder);
// lumigraph.json alone (active_proxy, up ...): sparse/ stays.
void WriteManifest(const Scene& scene, const std::filesystem::path& folder);
// Throws UsageError where the folder has no manifest that could keep a scale.
void RequireManifest(const std::filesystem::path& folder);
// What a unit of a scene of ours is (Scene::metres_per_unit); everything else in its manifest stays. The folder is
// locked meanwhile. Throws UsageError as RequireManifest.
void WriteScale(const std::filesystem::path& folder, double metres_per_unit);

// Writes undistorted pinhole copies of all photos (bicubic; JPEG quality 95, other endings kept where they can be
// written in 8 bits, else .png is added to the name) and returns the scene with pinhole cameras and observations moved
// along; observations without a ray are dropped. A photo whose camera has no distortion is hard-linked or copied. A new
// camera keeps the photo's size; both focal lengths are multiplied by the one factor that makes the new image lie just
// inside the photo, so that there are no blank pixels (COLMAP's blank_pixels = 0), and the principal point moves only
// as far as that needs. A fisheye is cut at 80 degrees off its axis. Photos that an earlier run completed from the same
// photo and camera stay (recorded in image_folder/.undistorted). What the photos were before is kept beside them
// (taken_photos.h). Throws InputError, DataError, MachineError; UsageError where image_folder is the photos' own.
Scene UndistortPhotos(const Scene& scene, const std::filesystem::path& image_folder, ProgressSink& progress);

// Where `folder` has the mask of a photo: photo.jpg.png (as COLMAP), photo.png or photo.jpg, in this order; empty: it
// has none.
std::filesystem::path FindMask(const std::filesystem::path& folder, const std::string& photo);

// Proxies: SCENE/proxies/NAME.ply. ListProxies leaves out those made for an evaluation (evaluation_proxy.h).
std::filesystem::path ProxyPath(const std::filesystem::path& scene_folder, const std::string& name);
std::vector<std::string> ListProxies(const std::filesystem::path& scene_folder);
// What a scene is called: its folder's name, also of "desk/" and ".".
std::string NameOfFolder(const std::filesystem::path& folder);
// Whether the name of a proxy is that of a mesh file: PLY or OBJ.
bool IsMeshFile(const std::string& name);
// By name, the active one for an empty name, or a mesh file anywhere. Throws UsageError naming those that exist and
// what else works, InputError for a file that is not there.
std::filesystem::path ProxyFile(const Scene& scene, const std::string& name);
Mesh LoadProxy(const Scene& scene, const std::string& name);

}  // namespace lumi
