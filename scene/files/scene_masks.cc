#include "scene/files/scene_masks.h"

#include <utility>

#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

bool IsOurs(const fs::path& scene_folder) {
  std::error_code error;
  return fs::exists(scene_folder / "lumigraph.json", error);
}

Image8 FirstChannel(const Image8& image) {
  if (image.channels == 1) return image;
  Image8 first(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) first.At(x, y, 0) = image.At(x, y, 0);
  return first;
}

}  // namespace

fs::path MasksFolder(const Scene& scene) {
  const fs::path own = scene.folder / "masks";
  std::error_code error;
  if (fs::is_directory(own, error) || IsOurs(scene.folder)) return own;
  constexpr int kLevels = 2;  // sparse/0
  fs::path above = fs::absolute(scene.folder, error).lexically_normal();
  if (!above.has_filename()) above = above.parent_path();
  for (int level = 0; level < kLevels; ++level) {
    above = above.parent_path();
    if (fs::is_directory(above / "images", error) && fs::is_directory(above / "masks", error)) return above / "masks";
  }
  return own;
}

SceneMasks::SceneMasks(const Scene& scene) : SceneMasks(scene, scene) {}

SceneMasks::SceneMasks(const Scene& scene, const Scene& input) : folder_(MasksFolder(input)) {
  std::error_code error;
  if (!IsOurs(input.folder) && fs::is_directory(folder_, error)) taken_.emplace(scene);
}

fs::path SceneMasks::File(const View& view) const {
  const fs::path file = taken_ ? FindMask(folder_, taken_->Name(view)) : fs::path();
  return file.empty() ? FindMask(folder_, view.name) : file;
}

Image8 SceneMasks::Of(const View& view) const {
  const fs::path file = File(view);
  if (file.empty()) return {};
  Image8 mask = FirstChannel(ReadImage8(file));
  return taken_ ? taken_->Mask(view, std::move(mask)) : mask;
}

}  // namespace lumi
