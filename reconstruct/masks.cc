#include "reconstruct/masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "scene/files/image_io.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

std::string InLowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The pictures of a folder by their names, and by those in lower case.
class MaskFolder {
 public:
  explicit MaskFolder(const fs::path& folder) : folder_(folder) {
    std::error_code error;
    for (auto it = fs::recursive_directory_iterator(folder, fs::directory_options::follow_directory_symlink, error);
         !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
      if (!HasImageExtension(it->path()) || !it->is_regular_file(error)) continue;
      const std::string name = it->path().lexically_relative(folder).generic_string();
      exact_.emplace(name, name);
      lower_.emplace(InLowerCase(name), name);
    }
    if (error) throw InputError(folder, "cannot be read: " + error.message());
  }

  // The mask of a photo's file, relative to the folder; empty: it has none.
  std::string Of(const fs::path& photo_folder, const std::string& photo) const {
    const std::string stem = fs::path(photo).replace_extension().generic_string();
    std::vector<std::string> names;
    for (const char* ending : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"})
      for (const std::string& base : {photo, stem}) names.push_back(base + ending);
    names.push_back(photo);
    for (const auto* known : {&exact_, &lower_})
      for (const std::string& name : names) {
        const auto it = known->find(known == &lower_ ? InLowerCase(name) : name);
        std::error_code error;  // a mask that is the photo itself is none: both may lie in one folder
        if (it != known->end() && !fs::equivalent(folder_ / it->second, photo_folder / photo, error)) return it->second;
      }
    return {};
  }

 private:
  fs::path folder_;
  std::map<std::string, std::string> exact_, lower_;
};

// Masks are often drawn over the photo as it is looked at.
bool IsTurned(const ImageInfo& mask, const InputPhoto& photo) {
  return SwapsSides(photo.orientation) && photo.width_px != photo.height_px &&
         (mask.width > mask.height) != (photo.width_px > photo.height_px);
}

void StageMask(const fs::path& mask, const InputPhoto& photo, const fs::path& target) {
  fs::create_directories(target.parent_path());
  std::error_code ec;
  fs::remove(target, ec);
  if (IsTurned(ReadImageInfo(mask), photo))
    WriteImage(target, StoredPicture(ReadImage8(mask), photo.orientation));
  else if (InLowerCase(mask.extension().string()) == ".png")
    fs::create_symlink(fs::absolute(mask), target);
  else
    WriteImage(target, ReadImage8(mask));
}

std::string FirstNames(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, names.size()); ++i) text += (i ? ", " : "") + names[i];
  return names.size() > kShown ? text + ", ..." : text;
}

}  // namespace

fs::path MasksForColmap(const Capture& capture, const fs::path& masks, const fs::path& staging, ProgressSink& sink) {
  const MaskFolder folder(masks);
  std::vector<std::string> found(capture.photos.size()), none;
  const fs::path& photos = capture.originals.empty() ? capture.folder : capture.originals;
  std::error_code ec;
  bool as_colmap_wants = !fs::equivalent(masks, photos, ec);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const InputPhoto& photo = capture.photos[i];
    found[i] = folder.Of(photos, photo.OriginalName());
    if (found[i].empty() && !photo.original.empty()) found[i] = folder.Of(photos, photo.name);
    if (found[i].empty())
      none.push_back(photo.OriginalName());
    else
      as_colmap_wants &= found[i] == photo.name + ".png" &&
                         !(SwapsSides(photo.orientation) && IsTurned(ReadImageInfo(masks / found[i]), photo));
  }
  if (none.size() == capture.photos.size())
    throw InputError(masks, fmt::format("none of the {} photos has a mask there", capture.photos.size()),
                     fmt::format("the mask of {0} is looked for as {0}.png, black = ignore", none.front()));
  if (!none.empty())
    sink.Message(fmt::format("{} of {} photos have no mask and are used whole: {}", none.size(), capture.photos.size(),
                             FirstNames(none)));
  if (as_colmap_wants || staging.empty()) return masks;
  fs::remove_all(staging, ec);
  ParallelEach(found.size(), 1, [&](std::size_t i) {
    if (!found[i].empty()) StageMask(masks / found[i], capture.photos[i], staging / (capture.photos[i].name + ".png"));
  });
  return staging;
}

}  // namespace lumi
