#include "scene/files/taken_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "scene/files/atomic_file.h"
#include "scene/files/json_keys.h"
#include "scene/program/error.h"
#include "scene/program/printable.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTakenName = ".taken.json";

struct CameraEntry {
  std::string model;
  int width = 0, height = 0;
  std::vector<double> params;
};
void ListKeys(JsonKeys& j, CameraEntry& c) {
  j("model", c.model, "width", c.width, "height", c.height, "params", c.params);
}

struct PhotoEntry {
  std::string name, taken;
  int camera = -1, pinhole = -1;
};
void ListKeys(JsonKeys& j, PhotoEntry& p) {
  j("name", p.name, "taken", p.taken, "camera", p.camera, "pinhole", p.pinhole);
}

struct TakenFile {
  std::vector<CameraEntry> cameras;
  std::vector<PhotoEntry> photos;
};
void ListKeys(JsonKeys& j, TakenFile& f) { j("cameras", f.cameras, "photos", f.photos); }

// Cameras in the order in which they are first asked for.
class CameraEntries {
 public:
  int IndexOf(const Camera& c) {
    const auto [it, is_new] = index_.try_emplace({static_cast<int>(c.model), c.width_px, c.height_px, c.params},
                                                 static_cast<int>(entries_.size()));
    if (is_new) entries_.push_back({std::string(Name(c.model)), c.width_px, c.height_px, c.params});
    return it->second;
  }
  std::vector<CameraEntry> Take() { return std::move(entries_); }

 private:
  std::map<std::tuple<int, int, int, std::vector<double>>, int> index_;
  std::vector<CameraEntry> entries_;
};

// Also the model that COLMAP does not know.
std::optional<CameraModel> ModelNamed(const std::string& name) {
  const auto* const found = std::ranges::find(kCameraModels, name, &CameraModelInfo::name);
  return found == kCameraModels.end() ? std::nullopt : std::optional(found->model);
}

}  // namespace

void WriteTakenPhotos(const std::vector<TakenPhoto>& photos, const fs::path& image_folder) {
  const fs::path file = image_folder / kTakenName;
  if (std::ranges::all_of(photos, [](const TakenPhoto& p) { return p.camera.IsPinhole() && p.taken == p.name; })) {
    std::error_code none;
    fs::remove(file, none);
    return;
  }
  TakenFile written;
  CameraEntries cameras;
  for (const TakenPhoto& photo : photos) {
    const int camera = cameras.IndexOf(photo.camera), pinhole = cameras.IndexOf(photo.pinhole);
    written.photos.push_back({photo.name, photo.taken, camera, pinhole});
  }
  written.cameras = cameras.Take();
  const std::string text = JsonKeys(written).Text() + "\n";
  // A cache that is complete may lie where nothing can be written.
  std::error_code none;
  if (!fs::exists(file, none) || ReadText(file) != text) WriteTextAtomically(file, text);
}

std::vector<TakenPhoto> ReadTakenPhotos(const fs::path& image_folder) {
  const fs::path file = image_folder / kTakenName;
  const std::string what = "a record of photos as they were taken";
  const auto fail = [&](const std::string& why) {
    return InputError(file, fmt::format("not {}: {}", what, why), "make the scene again");
  };
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  TakenFile read;
  if (!JsonKeys::Read(file, what).Into(read)) throw fail("a key is missing");
  std::vector<Camera> cameras;
  for (const CameraEntry& entry : read.cameras) {
    const auto model = ModelNamed(entry.model);
    if (!model) throw fail("there is no camera model " + Printable(entry.model));
    cameras.push_back({*model, entry.width, entry.height, entry.params});
    if (const auto wrong = Validate(cameras.back())) throw fail(*wrong);
  }
  std::vector<TakenPhoto> photos;
  for (const PhotoEntry& photo : read.photos) {
    const auto camera_of = [&](int index) -> const Camera& {
      if (index < 0 || static_cast<std::size_t>(index) >= cameras.size())
        throw fail(Printable(photo.name) + " has no camera");
      return cameras[static_cast<std::size_t>(index)];
    };
    photos.push_back({photo.name, photo.taken, camera_of(photo.camera), camera_of(photo.pinhole)});
    if (!photos.back().pinhole.IsPinhole()) throw fail(Printable(photo.name) + " is still distorted");
  }
  return photos;
}

TakenToScene::TakenToScene(const Scene& scene) : scene_(scene) {
  for (TakenPhoto& photo : ReadTakenPhotos(scene.image_folder)) {
    std::string name = photo.name;
    entries_.emplace(std::move(name), Entry{std::move(photo), nullptr});
  }
  for (const View& view : scene.views) {
    const Entry* const entry = Of(view);
    if (entry &&
        Eigen::Vector2i(entry->photo.pinhole.width_px, entry->photo.pinhole.height_px) != lumi::SizePx(scene, view))
      throw InputError(scene.image_folder / kTakenName,
                       fmt::format("is of photos of another size: {}", Printable(view.name)), "make the scene again");
  }
  // Photos mostly share a camera, and a camera's map has 8 bytes a pixel: a few cameras' are kept.
  constexpr std::size_t kMostKept = 4;
  std::vector<const Entry*> kept;
  const Entry* before = nullptr;
  const auto same = [](const Entry& a, const Entry& b) {
    const auto equal = [](const Camera& c, const Camera& d) {
      return c.model == d.model && c.width_px == d.width_px && c.height_px == d.height_px && c.params == d.params;
    };
    return equal(a.photo.camera, b.photo.camera) && equal(a.photo.pinhole, b.photo.pinhole);
  };
  for (auto& named : entries_) {
    Entry& entry = named.second;  // clang 14 hands no structured binding on to a lambda
    if (entry.photo.camera.IsPinhole()) continue;
    const auto known = std::ranges::find_if(kept, [&](const Entry* e) { return same(*e, entry); });
    if (known != kept.end()) {
      entry.undistorter = (*known)->undistorter;
    } else if (before && same(*before, entry) && kept.size() < kMostKept) {
      entry.undistorter = std::make_shared<const Undistorter>(entry.photo.camera, entry.photo.pinhole);
      kept.push_back(&entry);
    }
    before = &entry;
  }
}

const TakenToScene::Entry* TakenToScene::Of(const View& view) const {
  const auto it = entries_.find(view.name);
  return it == entries_.end() ? nullptr : &it->second;
}

std::string TakenToScene::Name(const View& view) const {
  const Entry* const entry = Of(view);
  return entry ? entry->photo.taken : view.name;
}

Eigen::Vector2i TakenToScene::SizePx(const View& view) const {
  const Entry* const entry = Of(view);
  if (!entry) return lumi::SizePx(scene_, view);
  return {entry->photo.camera.width_px, entry->photo.camera.height_px};
}

std::shared_ptr<const Undistorter> TakenToScene::UndistorterOf(const View& view) const {
  const Entry* const entry = Of(view);
  if (!entry || entry->photo.camera.IsPinhole()) return nullptr;
  return entry->undistorter ? entry->undistorter
                            : std::make_shared<const Undistorter>(entry->photo.camera, entry->photo.pinhole);
}

Image8 TakenToScene::Photo(const View& view, Image8 photo) const {
  const auto undistort = UndistorterOf(view);
  return undistort ? (*undistort)(photo) : std::move(photo);
}

Image8 TakenToScene::Mask(const View& view, Image8 mask) const {
  const auto undistort = UndistorterOf(view);
  return undistort ? undistort->Mask(mask) : std::move(mask);
}

}  // namespace lumi
