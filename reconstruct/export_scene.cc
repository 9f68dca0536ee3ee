#include "reconstruct/export_scene.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/scene_folder.h"
#include "scene/files/transforms_json.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/printable.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// This file is there while an export is under way, and after an export that ended early: what lies beside it is then
// this program's own, and is written once more.
fs::path MarkOf(const fs::path& output) {
  return output.extension() == ".json" ? output.parent_path() / ("." + output.filename().string() + ".exporting")
                                       : output / ".exporting";
}

void RequireNewOrEmpty(const fs::path& folder) {
  std::error_code ec;
  if (fs::exists(folder, ec) && !(fs::is_directory(folder, ec) && fs::is_empty(folder, ec)))
    throw UsageError(folder.string() + " is there already: nothing was touched",
                     "choose a folder that is new or empty");
}

bool LiesBelow(const fs::path& file, const fs::path& folder) {
  const fs::path name = fs::weakly_canonical(fs::absolute(file)).lexically_relative(fs::weakly_canonical(folder));
  return !name.empty() && *name.begin() != "..";
}

// The scene over copies of its photos.
Scene WithPhotosIn(Scene scene, const fs::path& folder, ProgressSink& sink) {
  Progress progress(sink, "copying photos", static_cast<long>(scene.views.size()));
  ParallelEach(scene.views.size(), 1, [&](std::size_t i) {
    const fs::path from = scene.ImagePath(scene.views[i]), to = folder / scene.views[i].name;
    WriteFileAtomically(to, [&](const fs::path& temporary) {
      std::error_code ec;
      fs::copy_file(from, temporary, ec);
      if (ec) throw MachineError(fmt::format("cannot be copied: {}", ec.message()), "is the disk full?", from);
    });
    progress.Step();
  });
  scene.image_folder = folder;
  return scene;
}

}  // namespace

ExportSummary ExportScene(const ExportOptions& options, ProgressSink& sink) {
  if (options.output.empty())
    throw UsageError("say where it goes: -o FILE.json for a transforms.json, -o FOLDER for a COLMAP workspace");
  std::error_code ec;
  const bool json = options.output.extension() == ".json";
  const fs::path folder = json ? fs::absolute(options.output).parent_path() : options.output;
  const fs::path mark = MarkOf(options.output);
  const bool begun = fs::exists(mark, ec);
  if (!begun && json && fs::exists(options.output, ec))
    throw UsageError(options.output.string() + " is there already: nothing was touched",
                     "remove it, or choose another name");
  if (!begun && !json) RequireNewOrEmpty(folder);
  OpenOptions open;
  open.undistort = false;
  Scene scene = OpenScene(options.scene, open, sink);
  RequireMetric(scene, json ? "a transforms.json" : "a COLMAP workspace");

  for (const View& view : scene.views)
    if (json && !IsUtf8(view.name))
      throw DataError("the photo's name is not UTF-8 and cannot be written as JSON", "rename it", view.name);

  ExportSummary summary;
  summary.output = options.output;
  summary.format = json ? "transforms.json" : "colmap";
  const bool copy =
      !json || !std::ranges::all_of(scene.views, [&](const View& v) { return LiesBelow(scene.ImagePath(v), folder); });
  if (!begun && copy && json) RequireNewOrEmpty(folder / "images");
  RemoveStaleTemporariesOf(options.output);
  WriteTextAtomically(mark, "");
  if (copy) {
    RemoveStaleTemporaries(folder / "images");
    scene = WithPhotosIn(std::move(scene), folder / "images", sink);
    summary.photos_copied = static_cast<int>(scene.views.size());
  }
  if (json) {
    try {
      WriteTransformsJson(scene, options.output);
    } catch (...) {
      if (!copy && !begun) fs::remove(mark, ec);  // nothing was written
      throw;
    }
  } else {
    WriteColmapModel(scene, folder / "sparse" / "0");
  }
  summary.photos = static_cast<int>(scene.views.size());
  summary.cameras = static_cast<int>(scene.cameras.size());
  summary.points = json ? 0 : static_cast<int>(scene.points.size());
  return summary;
}

void FinishExport(const ExportOptions& options) {
  std::error_code error;
  fs::remove(MarkOf(options.output), error);
  if (error) throw MachineError("cannot be removed: " + error.message(), "remove it", MarkOf(options.output));
}

void ListKeys(JsonKeys& j, ExportSummary& s) {
  j("output", s.output, "format", s.format, "photos", s.photos, "cameras", s.cameras, "points", s.points,
    "photos_copied", s.photos_copied);
}

std::string Describe(const ExportSummary& s) {
  return fmt::format("{}: {} photos{}, {} cameras{}", s.output.string(), s.photos,
                     s.photos_copied > 0 ? " (copied)" : "", s.cameras,
                     s.format == "colmap" ? fmt::format(", {} points", s.points) : "");
}

}  // namespace lumi
