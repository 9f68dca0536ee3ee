#include "pipeline/import_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/scene_masks.h"
#include "scene/files/taken_photos.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kStage = "import";
// Says that a folder without a manifest is ours: an import that was killed.
constexpr const char* kUnfinishedMark = "IMPORT-UNFINISHED";
constexpr const char *kNewImages = ".images-import", *kNewMasks = ".masks-import";

// As lumi-reconstruct's.
JsonKeys SummaryOf(const Scene& scene, bool reused) {
  double error_sum = 0;
  std::size_t observations = 0;
  for (const Point& point : scene.points) {
    error_sum += point.error_px * static_cast<double>(point.track.size());
    observations += point.track.size();
  }
  JsonKeys j;
  j.Say("images_total", scene.views.size())
      .Say("images_registered", scene.views.size())
      .Say("missing", std::vector<std::string>());
  j.Say("mean_reprojection_error_px", observations ? error_sum / static_cast<double>(observations) : 0.0)
      .Say("points", scene.points.size());
  j.Say("backend", kStage).Say("upgrade", Name(scene.frame)).Say("colmap_seconds", 0.0).Say("reused", reused);
  return j;
}

// A scene that did not come from an import holds photos of its own, which an import would replace.
void RequireImportedBefore(const fs::path& output) {
  std::error_code error;
  if (fs::exists(output / "lumigraph.json", error) && !fs::exists(output / kUnfinishedMark, error) &&
      !fs::exists(output / "provenance" / (std::string(kStage) + ".json"), error))
    throw UsageError(output.string() + " is another scene, which was not imported: nothing was touched",
                     "choose another output");
}

// An output without a manifest holds nothing but this import's: it goes, and the folder where it is left empty.
void RemoveUnfinished(const fs::path& output) {
  std::error_code ignored;
  for (const char* made : {kNewImages, kNewMasks, "lumigraph.json", "images", "masks", "sparse"})
    fs::remove_all(output / made, ignored);
  fs::remove(output / "provenance" / (std::string(kStage) + ".json"), ignored);
  fs::remove(output / "provenance", ignored);  // empty folders only
  fs::remove(output / "LOCK", ignored);
  const auto left = std::distance(fs::directory_iterator(output, ignored), fs::directory_iterator());
  if (left > 1) return;  // proxies of an earlier import: the mark says whose they are
  fs::remove(output / kUnfinishedMark, ignored);
  fs::remove(output, ignored);
}

// The masks that the input has beside its photos, moved along with them. How many there are.
std::size_t WriteMasks(const Scene& input, const Scene& ours, const fs::path& folder, ProgressSink& sink) {
  std::error_code error;
  const fs::path from = MasksFolder(input);
  if (!fs::is_directory(from, error)) return 0;
  const SceneMasks masks(ours, input);
  Progress progress(sink, "masks", static_cast<long>(ours.views.size()));
  std::vector<char> has(ours.views.size());
  ParallelEach(ours.views.size(), 1, [&](std::size_t i) {
    progress.Step();
    const Image8 mask = masks.Of(ours.views[i]);
    if (mask.empty()) return;
    WriteImage(folder / (ours.views[i].name + ".png"), mask);
    has[i] = 1;
  });
  const auto count = static_cast<std::size_t>(std::ranges::count(has, 1));
  if (count > 0)
    sink.Message(fmt::format("{}: {} of {} photos have a mask; dense proxies leave out what is black in it",
                             from.string(), count, ours.views.size()));
  return count;
}

// Puts the new masks into their place; somebody else's there stay, and false is returned.
bool ReplaceMasks(const fs::path& output, ProgressSink& sink) {
  std::error_code error;
  if (fs::exists(output / "masks", error) && !IsAsRecorded(output / "masks")) {
    sink.Message((output / "masks").string() + " was not made by an import: it stays, in place of the input's masks");
    fs::remove_all(output / kNewMasks);
    return false;
  }
  fs::remove_all(output / "masks");
  fs::rename(output / kNewMasks, output / "masks");
  return true;
}

}  // namespace

StageResult ImportScene(const ImportOptions& options, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  // What a run that failed has left (colmap/) may stay where it is: an import has no use for it.
  std::error_code none;
  RequireOurFolder(options.output,
                   fs::is_directory(options.output / "provenance", none) ? "provenance" : kUnfinishedMark);
  RequireImportedBefore(options.output);

  OpenOptions open;
  open.rescale_cameras = options.rescale_cameras;
  open.undistort = false;
  Scene scene = OpenScene(options.input, open, progress);
  RequireMetric(scene, "a lumigraph's proxy");
  if (scene.points.empty())
    throw DataError("the model has cameras but no points, and a proxy needs points",
                    "run lumi-pipeline on its photos with --poses " + options.input.string(), options.input);

  Provenance wanted;
  wanted.stage = kStage;
  wanted.version = kVersion;
  wanted.options["rescale_cameras"] = options.rescale_cameras ? "true" : "false";
  wanted.inputs[scene.image_folder.string()] = Fingerprint(scene.image_folder);
  std::error_code no_masks;
  if (const fs::path masks = MasksFolder(scene); fs::is_directory(masks, no_masks))
    wanted.inputs[masks.string()] = Fingerprint(masks);
  if (const auto model = FindColmapModel(options.input)) wanted.inputs[model->string()] = Fingerprint(*model);

  StageResult result;
  result.name = kStage;
  // Killed between its record and the mark's removal: only a whole import removes the mark.
  std::error_code no_mark;
  result.reused = IsUpToDate(options.output, wanted) && !fs::exists(options.output / kUnfinishedMark, no_mark);
  if (!result.reused) {
    std::error_code error;
    const bool had_manifest = fs::exists(options.output / "lumigraph.json", error);
    try {
      const FolderLock lock(options.output);
      WriteTextAtomically(options.output / kUnfinishedMark,
                          "An import is being written, or was killed; a second run starts it again.\n");
      for (const char* left : {kNewImages, kNewMasks}) fs::remove_all(options.output / left);
      Scene ours = UndistortPhotos(scene, options.output / kNewImages, progress);
      // Of a scene of ours, whose photos are undistorted already, what it says of them goes along.
      if (const auto taken = ReadTakenPhotos(scene.image_folder); !taken.empty())
        WriteTakenPhotos(taken, options.output / kNewImages);
      const std::size_t masks = WriteMasks(scene, ours, options.output / kNewMasks, progress);
      // From here on old and new must not mix: without a manifest the folder is no scene.
      fs::remove(options.output / "lumigraph.json");
      fs::remove_all(options.output / "images");
      fs::rename(options.output / kNewImages, options.output / "images");
      const bool masked = masks > 0 && ReplaceMasks(options.output, progress);
      if (masks == 0 && IsAsRecorded(options.output / "masks")) fs::remove_all(options.output / "masks");
      ours.image_folder = options.output / "images";
      ours.folder = options.output;
      ours.active_proxy.clear();
      UpdateFrameOfReference(ours);
      WriteScene(ours, options.output);
      wanted.outputs["images"] = Fingerprint(options.output / "images");
      if (masked) wanted.outputs["masks"] = Fingerprint(options.output / "masks");
      wanted.outputs["sparse"] = Fingerprint(options.output / "sparse");
      wanted.outputs["lumigraph.json"] = kChangedLater;
      wanted.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      WriteProvenance(options.output, wanted);
      fs::remove(options.output / kUnfinishedMark);
    } catch (...) {
      // What was there before stays as far as it is whole; the mark lets a second run start again.
      if (!had_manifest) RemoveUnfinished(options.output);
      throw;
    }
  }
  result.summary = SummaryOf(scene, result.reused);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace lumi
