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

SceneMasks::SceneMasks(const Scene& scene) : SceneMasks(scene, scene.folder / "masks", !IsOurs(scene.folder)) {}

SceneMasks::SceneMasks(const Scene& scene, fs::path folder, bool as_taken) : folder_(std::move(folder)) {
  std::error_code error;
  if (as_taken && fs::is_directory(folder_, error)) taken_.emplace(scene);
}

fs::path SceneMasks::File(const View& view) const { return FindMask(folder_, taken_ ? taken_->Name(view) : view.name); }

Image8 SceneMasks::Of(const View& view) const {
  const fs::path file = File(view);
  if (file.empty()) return {};
  Image8 mask = FirstChannel(ReadImage8(file));
  if (!taken_ || !taken_->Moves(view)) return mask;
  const Eigen::Vector2i size = taken_->SizePx(view);
  if (mask.width != size.x() || mask.height != size.y()) mask = Resize(mask, size.x(), size.y());
  return taken_->Mask(view, std::move(mask));
}

}  // namespace lumi
