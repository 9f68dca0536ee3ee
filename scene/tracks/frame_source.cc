#include "scene/tracks/frame_source.h"

#include <fmt/format.h>

#include "scene/files/image_io.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {
constexpr int kIgnoredBelow = 128;
}  // namespace

FrameSource PhotoSource(const fs::path& folder, std::vector<std::string> names, const fs::path& mask_folder) {
  FrameSource source;
  source.folder = folder;
  source.image = [folder, names](int i) { return ReadImage8(folder / names[static_cast<std::size_t>(i)]); };
  if (!mask_folder.empty())
    source.mask = [mask_folder, names](int i) {
      const fs::path file = mask_folder / (names[static_cast<std::size_t>(i)] + ".png");
      std::error_code ec;
      return fs::exists(file, ec) ? ReadImage8(file) : Image8();
    };
  source.names = std::move(names);
  return source;
}

namespace tracks_internal {

FrameAndMask LoadFrame(const FrameSource& source, int frame) {
  FrameAndMask f;
  const fs::path file = source.folder / source.names[static_cast<std::size_t>(frame)];
  f.image = source.image(frame);
  if (f.image.empty() || f.image.width < 1 || f.image.height < 1) throw DataError("the frame has no pixels", {}, file);
  if (f.image.channels != 1 && f.image.channels != 3)
    throw DataError(fmt::format("the frame has {} channels, 1 or 3 are wanted", f.image.channels), {}, file);
  if (!source.mask) return f;
  const Image8 mask = source.mask(frame);
  if (mask.empty()) return f;
  f.mask = Image8(f.image.width, f.image.height, 1);
  for (int y = 0; y < f.mask.height; ++y) {
    const int v = static_cast<int>((static_cast<long>(y) * 2 + 1) * mask.height / (2L * f.mask.height));
    for (int x = 0; x < f.mask.width; ++x) {
      const int u = static_cast<int>((static_cast<long>(x) * 2 + 1) * mask.width / (2L * f.mask.width));
      f.mask.At(x, y, 0) = mask.At(u, v, 0) < kIgnoredBelow ? 0 : 255;
    }
  }
  return f;
}

}  // namespace tracks_internal
}  // namespace lumi
