#include "scene/files/scene_folder.h"

#include <OpenImageIO/hash.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <tuple>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/file_name.h"
#include "scene/files/image_io.h"
#include "scene/files/json_fields.h"
#include "scene/files/mesh_io.h"
#include "scene/files/projective_json.h"
#include "scene/files/transforms_json.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/printable.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using json_fields::Fields;
using json_fields::Json;
using json_fields::ParseJson;
using json_fields::RequireFormat;

constexpr const char* kManifestName = "lumigraph.json";
constexpr const char* kFormatName = "lumigraph";

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

fs::path Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path), error);
  return error ? fs::absolute(path).lexically_normal() : canonical;
}

fs::path Lexical(const fs::path& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();  // without a slash at its end
}

// --- lumigraph.json ----------------------------------------------------------------------------------------------

Json ToJson(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

void CheckProxyName(const fs::path& file, const std::string& name) {
  if (name.find_first_of("/\\") != std::string::npos || name.starts_with('.'))
    throw InputError(file, fmt::format("active_proxy \"{}\" is no name of a proxy", name));
}

// What the manifest says of a scene but for its cameras and points. Views are found by name.
struct Manifest {
  Frame frame = Frame::kMetric;
  std::optional<Eigen::Vector3d> up;
  std::optional<Similarity3> normalized_from_world;
  std::optional<double> period_s, metres_per_unit;
  std::string active_proxy;
  std::string images = "images";
  struct ViewEntry {
    std::optional<double> time_s;
    std::optional<int> frame_index;
    double gain = 1;
    int orientation = 1;
  };
  std::map<std::string, ViewEntry> views;
};

Manifest ReadManifest(const fs::path& file) {
  const Json json = ParseJson(file);
  const Fields fields(json, file, "");
  RequireFormat(fields, file, kFormatName, kSceneFormatVersion, "is no manifest of a lumigraph");
  Manifest m;
  const std::string frame = fields.Text("frame").value_or("metric");
  const auto known = FrameFromName(frame);
  if (!known) throw InputError(file, fmt::format("frame \"{}\" is not known", frame));
  m.frame = *known;
  if (const auto up = fields.Vector<3>("up")) {
    if (!(up->norm() > 0)) throw fields.Wrong("up", "a direction");
    m.up = up->stableNormalized();  // of any length
  }
  if (const Json* n = fields.Find("normalisation")) {
    const Fields normalisation(*n, file, "normalisation.");
    Similarity3 s;
    s.scale = normalisation.Number("scale").value_or(1);
    if (!(s.scale > 0)) throw normalisation.Wrong("scale", "positive");
    if (const auto q = normalisation.Vector<4>("rotation_xyzw")) {
      if (!(q->norm() > 0)) throw normalisation.Wrong("rotation_xyzw", "a quaternion");
      s.rotation = Eigen::Quaterniond(q->stableNormalized().eval());
    }
    s.translation = normalisation.Vector<3>("translation").value_or(Eigen::Vector3d::Zero());
    m.normalized_from_world = s;
  }
  m.period_s = fields.Number("period_s");
  if (m.period_s && !(*m.period_s > 0)) throw fields.Wrong("period_s", "positive");
  m.metres_per_unit = fields.Number("metres_per_unit");
  if (m.metres_per_unit && !(*m.metres_per_unit > 0)) throw fields.Wrong("metres_per_unit", "positive");
  m.active_proxy = fields.Text("active_proxy").value_or("");
  CheckProxyName(file, m.active_proxy);
  m.images = fields.Text("images").value_or("images");
  // A link inside the folder is followed: only somebody who can write into the folder can have put it there.
  if (!StaysWithin(m.images))
    throw InputError(file, fmt::format("images \"{}\" leads out of the scene's folder", m.images),
                     "put the photos into its images/, or a link to them");
  if (const Json* views = fields.Array("views"))
    for (std::size_t i = 0; i < views->size(); ++i) {
      const Fields view((*views)[i], file, fmt::format("views[{}].", i));
      const auto name = view.Text("name");
      if (!name) throw view.Wrong("name", "there");
      Manifest::ViewEntry entry;
      entry.time_s = view.Number("time_s");
      entry.frame_index = view.Integer("frame_index");
      entry.gain = view.Number("gain").value_or(1);
      if (!(entry.gain > 0)) throw view.Wrong("gain", "positive");
      entry.orientation = view.Integer("orientation").value_or(1);
      if (!IsOrientation(entry.orientation)) throw view.Wrong("orientation", "1 to 8");
      if (!m.views.emplace(*name, entry).second) throw InputError(file, fmt::format("view \"{}\" comes twice", *name));
    }
  return m;
}

Scene ReadCamerasAndPoints(const fs::path& folder, Frame frame) {
  if (frame != Frame::kMetric) {
    const fs::path file = folder / kProjectiveName;
    if (!Exists(file)) throw InputError(file, "the scene's projection matrices are missing", "make the scene again");
    Scene scene = ReadProjectiveJson(file);
    if (scene.frame != frame)
      throw InputError(file, fmt::format("holds a {} frame, {} says {}", Name(scene.frame), kManifestName, Name(frame)),
                       "make the scene again");
    return scene;
  }
  const auto model = FindColmapModel(folder / "sparse");
  if (!model)
    throw InputError(folder / "sparse", "the scene's cameras are missing (a COLMAP model)", "make the scene again");
  return ReadColmapModel(*model);
}

Scene ReadOwnScene(const fs::path& folder) {
  const fs::path file = folder / kManifestName;
  const Manifest manifest = ReadManifest(file);
  Scene scene = ReadCamerasAndPoints(folder, manifest.frame);
  for (View& view : scene.views) {
    const auto entry = manifest.views.find(view.name);
    if (entry == manifest.views.end()) continue;
    view.time_s = entry->second.time_s;
    view.frame_index = entry->second.frame_index;
    view.gain = entry->second.gain;
    view.orientation = entry->second.orientation;
  }
  if (!manifest.up || !manifest.normalized_from_world) UpdateFrameOfReference(scene);
  if (manifest.up) scene.up = *manifest.up;
  if (manifest.normalized_from_world) scene.normalized_from_world = *manifest.normalized_from_world;
  scene.period_s = manifest.period_s;
  scene.metres_per_unit = manifest.metres_per_unit;
  scene.active_proxy = manifest.active_proxy;
  scene.folder = folder;
  scene.image_folder = (folder / manifest.images).lexically_normal();
  return scene;
}

// --- Other people's scenes ---------------------------------------------------------------------------------------

Scene ReadWorkspace(const fs::path& path, const fs::path& model) {
  Scene scene = ReadColmapModel(model);
  // The photos: images/ in the folder given, or beside any folder from the model up to it, or right in one of those.
  // By the names as given first, so that a linked sparse/ still belongs to the folder it is linked into.
  std::vector<fs::path> candidates;
  const auto add_from = [&](const fs::path& start, const fs::path& top) {
    fs::path at = start;
    for (int level = 0; level < 3; ++level, at = at.parent_path()) {
      for (const fs::path& candidate : {at / "images", at})
        if (std::find(candidates.begin(), candidates.end(), candidate) == candidates.end())
          candidates.push_back(candidate);
      if ((at == top && level > 0) || at == at.parent_path()) break;
    }
  };
  add_from(Lexical(model), Lexical(path));
  add_from(Canonical(model), Canonical(path));
  const std::string& first = scene.views.front().name;
  const auto found =
      std::find_if(candidates.begin(), candidates.end(), [&](const fs::path& c) { return Exists(c / first); });
  if (found == candidates.end()) {
    std::string looked;
    for (const fs::path& c : candidates) looked += (looked.empty() ? "" : ", ") + c.string();
    throw InputError(model, fmt::format("the model's photos are not there: {} was looked for in {}", first, looked),
                     "put them into a folder images/ beside sparse/");
  }
  scene.image_folder = *found;
  scene.folder = path;
  return scene;
}

// --- Photos and cameras ------------------------------------------------------------------------------------------

// Takes orientations from the photos themselves where the scene states none.
void TakeOrientations(Scene& scene, const std::vector<ImageInfo>& photos) {
  for (std::size_t i = 0; i < photos.size(); ++i)
    if (scene.views[i].orientation == 1) scene.views[i].orientation = photos[i].orientation;
}

std::vector<ImageInfo> ReadPhotoInfos(const Scene& scene, ProgressSink& sink) {
  std::vector<ImageInfo> photos(scene.views.size());
  Progress progress(sink, "checking photos", static_cast<long>(scene.views.size()));
  ParallelEach(scene.views.size(), 1, [&](std::size_t i) {
    photos[i] = ReadImageInfo(scene.ImagePath(scene.views[i]));
    progress.Step();
  });
  return photos;
}

void FitCamerasToPhotos(Scene& scene, const std::vector<ImageInfo>& photos, bool rescale, ProgressSink& sink) {
  std::vector<Eigen::Vector2i> sizes;
  for (const ImageInfo& photo : photos) sizes.emplace_back(photo.width, photo.height);
  const auto camera_size = [&](std::size_t i) { return SizePx(scene, scene.views[i]); };
  const auto fits = [&](std::size_t i) { return sizes[i] == camera_size(i); };
  std::vector<Eigen::Vector2d> factors(scene.views.size(), Eigen::Vector2d::Ones());
  std::vector<Camera> cameras;
  std::map<std::tuple<std::int32_t, int, int>, CameraId> known;
  bool changed = false;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (!fits(i)) {
      const Eigen::Vector2i size = camera_size(i);
      // A photo turned by 90 degrees: scaling the camera would not help.
      if (sizes[i].x() == size.y() && sizes[i].y() == size.x())
        throw InputError(
            scene.ImagePath(view),
            fmt::format("the photo is {} x {} pixels, its camera is for {} x {}: it is turned by 90 degrees",
                        sizes[i].x(), sizes[i].y(), size.x(), size.y()),
            "turn its pixels back: cameras are those of the pixels as they are stored, whatever EXIF's orientation "
            "says");
      if (!rescale)
        throw InputError(
            scene.ImagePath(view),
            fmt::format("the photo is {} x {} pixels, its camera is for {} x {}", sizes[i].x(), sizes[i].y(), size.x(),
                        size.y()),
            "put the photos there that the cameras were computed from, or scale the cameras: --rescale-cameras of "
            "lumi-pipeline (which makes a scene of them), lumi-render and lumi-view");
      factors[i] = sizes[i].cast<double>().cwiseQuotient(size.cast<double>());
      changed = true;
    }
  }
  if (!changed) return;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    View& view = scene.views[i];
    if (scene.frame != Frame::kMetric) {
      view.P.row(0) *= factors[i].x();
      view.P.row(1) *= factors[i].y();
      view.size_px = sizes[i];
      continue;
    }
    const auto [it, added] = known.try_emplace({view.camera.value, sizes[i].x(), sizes[i].y()},
                                               CameraId{static_cast<std::int32_t>(cameras.size())});
    if (added)
      cameras.push_back(fits(i) ? scene.CameraOf(view) : scene.CameraOf(view).Scaled(sizes[i].x(), sizes[i].y()));
    view.camera = it->second;
  }
  if (scene.frame == Frame::kMetric) scene.cameras = std::move(cameras);
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.x_px = o.x_px.cwiseProduct(factors[static_cast<std::size_t>(o.view.value)]);
  sink.Message("cameras were scaled to the size of their photos");
}

// A folder of the user's cache directory for this workspace and these cameras. The photos themselves are checked one by
// one when they are undistorted.
fs::path CacheFolder(const Scene& scene) {
  fs::path base;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg == '/')
    base = xdg;
  else if (const char* home = std::getenv("HOME"); home && *home == '/')
    base = fs::path(home) / ".cache";
  else
    base = fs::temp_directory_path();
  std::string key = Canonical(scene.image_folder).string();
  for (const View& view : scene.views) key += fmt::format("\n{} {}", view.name, view.camera.value);
  for (const Camera& c : scene.cameras) {
    key += fmt::format("\n{} {} {}", Name(c.model), c.width_px, c.height_px);
    for (const double p : c.params) key += fmt::format(" {}", p);
  }
  return base / "lumigraph" / fmt::format("{:016x}", OIIO::xxhash::XXH64(key.data(), key.size(), 0)) / "images";
}

}  // namespace

Scene OpenScene(const fs::path& path, const OpenOptions& options, ProgressSink& progress) {
  if (!Exists(path)) throw UsageError(fmt::format("{} is not there", path.string()));
  std::error_code error;
  Scene scene;
  bool ours = false;
  std::vector<std::string> skipped;
  if (!fs::is_directory(path, error)) {
    if (path.filename() == kManifestName) return OpenScene(fs::absolute(path).parent_path(), options, progress);
    if (path.extension() != ".json")
      throw UsageError(fmt::format("{} is no scene: a folder, lumigraph.json or transforms.json is", path.string()));
    scene = ReadTransformsJson(path, &skipped);
  } else if (Exists(path / kManifestName)) {
    scene = ReadOwnScene(path);
    ours = true;
  } else if (const auto models = FindColmapModels(path); !models.empty()) {
    scene = ReadWorkspace(path, models.front().path);
    if (models.size() > 1)
      progress.Message(fmt::format("{} COLMAP models: the largest is taken, {} of {} images; {} has {}", models.size(),
                                   models[0].path.lexically_relative(path).generic_string(), models[0].images,
                                   models[1].path.lexically_relative(path).generic_string(), models[1].images));
  } else if (Exists(path / "transforms.json")) {
    scene = ReadTransformsJson(path / "transforms.json", &skipped);
  } else {
    throw UsageError(fmt::format("{} is no scene: there is no lumigraph.json, no COLMAP model (cameras and images in "
                                 "it, sparse/ or sparse/0/) and no transforms.json",
                                 path.string()),
                     "lumi-reconstruct makes a scene of photos");
  }
  if (!skipped.empty())
    progress.Message(
        fmt::format("{} photos of the file are absent and were left out, {} first", skipped.size(), skipped.front()));
  if (options.check_photos || options.rescale_cameras) {
    const std::vector<ImageInfo> photos = ReadPhotoInfos(scene, progress);
    if (!ours) TakeOrientations(scene, photos);
    if (!ours) UpdateFrameOfReference(scene);
    FitCamerasToPhotos(scene, photos, options.rescale_cameras, progress);
  } else if (!ours) {
    UpdateFrameOfReference(scene);
  }
  const bool distorted =
      scene.frame == Frame::kMetric && std::any_of(scene.views.begin(), scene.views.end(),
                                                   [&](const View& v) { return !scene.CameraOf(v).IsPinhole(); });
  if (distorted && options.undistort)
    scene = UndistortPhotos(scene, options.cache_folder.empty() ? CacheFolder(scene) : options.cache_folder / "images",
                            progress);
  return scene;
}

// The photos' folder for the manifest. Links are resolved only if the path as given leads out of the scene, so that an
// images/ that is a link stays "images".
static fs::path ImagesOf(const Scene& scene, const fs::path& folder) {
  if (scene.image_folder.empty()) return "images";
  const fs::path named = Lexical(scene.image_folder).lexically_relative(Lexical(folder));
  if (StaysWithin(named.string())) return named;
  const fs::path resolved = Canonical(scene.image_folder).lexically_relative(Canonical(folder));
  if (!StaysWithin(resolved.string()))
    throw UsageError(fmt::format("the photos in {} lie outside of the scene's folder {}", scene.image_folder.string(),
                                 folder.string()),
                     "put them into its images/, or a link to them");
  return resolved;
}

void RequireManifest(const fs::path& folder) {
  if (!Exists(folder / kManifestName))
    throw UsageError(
        fmt::format("{} is no scene folder: there is no {} that could keep a scale", folder.string(), kManifestName),
        "make one: lumi-pipeline WORKSPACE -o SCENE");
}

void WriteScale(const fs::path& folder, double metres_per_unit) {
  RequireManifest(folder);
  const fs::path file = folder / kManifestName;
  const FolderLock lock(folder);
  ReadManifest(file);  // throws for a file that is no manifest
  Json json = ParseJson(file);
  json["metres_per_unit"] = metres_per_unit;
  WriteTextAtomically(file, json.dump(1) + "\n");
}

void WriteManifest(const Scene& scene, const fs::path& folder) {
  // An object from the beginning, not null: if memory runs out while the library turns null into an object, the value
  // is left as neither.
  Json json = Json::object();
  json["format"] = kFormatName;
  json["version"] = kSceneFormatVersion;
  json["frame"] = Name(scene.frame);
  json["up"] = ToJson(scene.up);
  const Similarity3& n = scene.normalized_from_world;
  json["normalisation"] = {{"scale", n.scale},
                           {"rotation_xyzw", {n.rotation.x(), n.rotation.y(), n.rotation.z(), n.rotation.w()}},
                           {"translation", ToJson(n.translation)}};
  if (scene.period_s) json["period_s"] = *scene.period_s;
  if (scene.metres_per_unit) json["metres_per_unit"] = *scene.metres_per_unit;
  json["active_proxy"] = scene.active_proxy;
  json["images"] = ImagesOf(scene, folder).generic_string();
  json["views"] = Json::array();
  for (const View& view : scene.views) {
    Json entry{{"name", view.name}};
    if (view.time_s) entry["time_s"] = *view.time_s;
    if (view.frame_index) entry["frame_index"] = *view.frame_index;
    entry["gain"] = view.gain;
    if (view.orientation != 1) entry["orientation"] = view.orientation;
    json["views"].push_back(std::move(entry));
  }
  for (const View& view : scene.views)
    if (!IsUtf8(view.name))
      throw DataError("the photo's name is not UTF-8 and cannot be written into a manifest", "rename it", view.name);
  WriteTextAtomically(folder / kManifestName, json.dump(1) + "\n");
}

void WriteScene(const Scene& scene, const fs::path& folder) {
  if (scene.frame == Frame::kMetric)
    WriteColmapModel(scene, folder / "sparse");
  else
    WriteProjectiveJson(scene, folder / kProjectiveName);
  WriteManifest(scene, folder);  // last: a folder with a manifest is a whole scene
}

fs::path FindMask(const fs::path& folder, const std::string& photo) {
  std::error_code error;
  for (const fs::path& path :
       {folder / (photo + ".png"), fs::path(folder / photo).replace_extension(".png"), folder / photo})
    if (fs::is_regular_file(path, error)) return path;
  return {};
}

fs::path ProxyPath(const fs::path& scene_folder, const std::string& name) {
  return scene_folder / "proxies" / (name + ".ply");
}

std::vector<std::string> ListProxies(const fs::path& scene_folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(scene_folder / "proxies", error), end; !error && it != end; it.increment(error))
    if (it->path().extension() == ".ply" && !it->path().filename().string().starts_with('.') &&
        !IsForEvaluation(it->path().stem().string()))
      names.push_back(it->path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string NameOfFolder(const fs::path& folder) { return Lexical(folder).filename().string(); }

bool IsMeshFile(const std::string& name) {
  const std::string ending = LowerExtension(name);
  return ending == ".ply" || ending == ".obj";
}

fs::path ProxyFile(const Scene& scene, const std::string& name) {
  const std::string wanted = name.empty() ? scene.active_proxy : name;
  const std::vector<std::string> names = ListProxies(scene.folder);
  if (std::find(names.begin(), names.end(), wanted) != names.end() ||
      (IsForEvaluation(wanted) && Exists(ProxyPath(scene.folder, wanted))))
    return ProxyPath(scene.folder, wanted);
  if (IsMeshFile(wanted)) {
    if (Exists(wanted)) return wanted;
    throw InputError(wanted, "no such file", "--proxy takes the name of one of the scene's proxies, or a mesh file");
  }
  const std::string what = wanted.empty() ? fmt::format("{} has no active proxy", scene.folder.string())
                                          : fmt::format("{} has no proxy \"{}\"", scene.folder.string(), wanted);
  if (!names.empty())
    throw UsageError(what, fmt::format("there are: {}; or name a file: --proxy MESH.ply", fmt::join(names, ", ")));
  if (Exists(scene.folder / kManifestName))
    throw UsageError(what, fmt::format("lumi-proxy auto {} makes one; or name a file: --proxy MESH.ply, or let "
                                       "lumi-render do without: --proxy per-view",
                                       scene.folder.string()));
  throw UsageError(what, fmt::format("make a scene with one: lumi-pipeline {} -o SCENE; or name a file: --proxy "
                                     "MESH.ply (lumi-proxy delaunay {} -o MESH.ply makes one), or let lumi-render do "
                                     "without: --proxy per-view",
                                     scene.folder.string(), scene.folder.string()));
}

Mesh LoadProxy(const Scene& scene, const std::string& name) {
  constexpr std::size_t kBytesPerFaceToDraw = 200;  // with the tree that rays are traced in, as measured on a million
  return ReadMesh(ProxyFile(scene, name), kBytesPerFaceToDraw);
}

}  // namespace lumi
