#include "reconstruct/cameras_beside.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/transforms_json.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kTransforms = "transforms.json";

bool IsFolder(const fs::path& path) {
  std::error_code ec;
  return fs::is_directory(path, ec);
}
bool IsFile(const fs::path& path) {
  std::error_code ec;
  return fs::is_regular_file(path, ec);
}

// Made by this suite: its sparse/ and truth/ are results.
bool IsOurs(const fs::path& folder) {
  return IsFile(folder / "lumigraph.json") || IsFile(folder / "truth" / "cameras.json");
}

void RequireNoScene(const fs::path& input) {
  if (!IsOurs(input)) return;
  std::string where;
  for (const char* name : {"images", "videos"})
    if (IsFolder(input / name)) where += (where.empty() ? "" : " or ") + (input / name).string();
  throw UsageError(fmt::format("{} is a scene or capture of this suite, not a folder of photos", input.string()),
                   where.empty() ? "give a folder of photos" : "its photos are inside: give " + where);
}

// A COLMAP model as its folder has it; of transforms.json the file.
fs::path CamerasIn(const fs::path& folder) {
  if (const auto model = FindColmapModel(folder)) return *model;
  return IsFile(folder / kTransforms) ? folder / kTransforms : fs::path();
}

// The deepest folder that holds all photos which the file names.
fs::path PhotosOf(const fs::path& transforms) {
  const Scene scene = ReadTransformsJson(transforms);
  std::optional<fs::path> common;
  for (const View& view : scene.views) {
    const fs::path folder = scene.ImagePath(view).parent_path();
    if (!common) common = folder;
    fs::path shared;
    for (auto a = common->begin(), b = folder.begin(); a != common->end() && b != folder.end() && *a == *b; ++a, ++b)
      shared /= *a;
    common = shared;
  }
  return common.value_or(transforms.parent_path());
}

fs::path PhotosBeside(const fs::path& folder, const fs::path& cameras) {
  if (cameras.extension() == ".json") return PhotosOf(cameras);
  return IsFolder(folder / "images") ? folder / "images" : folder;
}

// The option that makes this run find its cameras itself; nullptr: there is none.
const char* FindsThemItself(const ReconstructOptions& o) {
  if (o.rig != Rig::kNone) return "--rig";
  if (o.backend == Backend::kFactorization) return "--backend factorization";
  if (o.mapper != Mapper::kQuick) return "--mapper";
  return o.tradeoff ? "--tradeoff" : nullptr;
}

}  // namespace

void TakeCamerasBeside(ReconstructOptions& options, ProgressSink& sink) {
  const bool anew = options.poses == kCamerasAnew;
  if (anew) options.poses.clear();
  const fs::path input = options.input;
  const bool json = IsFile(input) && input.extension() == ".json";
  if (json && input.filename() == "lumigraph.json") RequireNoScene(fs::absolute(input).parent_path());
  if (!json && !IsFolder(input)) return;
  if (!json) RequireNoScene(input);
  if (json && anew) throw UsageError(input.string() + " names cameras, and --poses none wants none", "give its photos");
  const fs::path inside = json ? input : CamerasIn(input);
  if (!inside.empty()) {
    if (const char* other = FindsThemItself(options); !anew && options.poses.empty() && other == nullptr) {
      options.poses = inside;
      sink.Message(fmt::format("the cameras come from {} (--poses none finds them anew)", inside.string()));
    } else if (!anew && options.poses.empty()) {
      sink.Message(fmt::format("the cameras in {} are not used: {} finds them anew", inside.string(), other));
    }
    options.input = PhotosBeside(json ? input.parent_path() : input, inside);
    return;
  }
  if (anew || !options.poses.empty()) return;
  const fs::path parent = fs::absolute(input).lexically_normal() / "..";
  const fs::path beside = IsOurs(parent) ? fs::path() : CamerasIn(parent.lexically_normal());
  if (!beside.empty() && FindsThemItself(options) == nullptr)
    sink.Message(
        fmt::format("cameras lie beside these photos and are not used; --poses {} uses them", beside.string()));
}

}  // namespace lumi
