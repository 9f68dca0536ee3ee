#include "reconstruct/own_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "reconstruct/colmap_database.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "scene/tracks/frame_source.h"
#include "scene/tracks/sift.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// As many of a photo's spots as COLMAP takes: its threshold on their contrast.
constexpr double kContrast = 0.02;

Camera FirstCamera(const CameraPlan& plan, const InputPhoto& photo) {
  if (plan.known) return *plan.known;
  return GuessCamera(plan.model, photo.width_px, photo.height_px);
}

void MakeDatabase(const fs::path& database, const std::string& task, const ColmapJob& job) {
  if (ColmapDatabase::IsDatabase(database)) return;
  const int rc = job.colmap.Run("database_creator", {{"database_path", database.string()}}, task, 0);
  if (ColmapDatabase::IsDatabase(database)) return;
  const std::string complaint = job.colmap.LastComplaint();
  throw MachineError(
      fmt::format("COLMAP made no database; it ended with {}{}", rc, complaint.empty() ? "" : " (" + complaint + ")"),
      "see the log", job.colmap.log_file());
}

}  // namespace

bool FindOwnFeatures(const PhotosToSearch& photos, const fs::path& database, const ColmapJob& job) {
  MakeDatabase(database, photos.task, job);
  ColmapDatabase db(database);
  if (db.HasRigs()) return false;
  std::set<std::string> there;
  std::int64_t last_id = 0, camera_id = 0;
  for (const auto& image : db.Images()) {
    there.insert(image.name);
    last_id = std::max(last_id, image.id);
    camera_id = image.camera_id;
  }
  std::vector<const InputPhoto*> wanted;
  std::vector<std::string> names;
  for (const InputPhoto& photo : photos.photos)
    if (!there.count(photo.name)) {
      wanted.push_back(&photo);
      names.push_back(photo.name);
    }
  const FrameSource source = PhotoSource(photos.folder, names, photos.masks);
  const SiftOptions options{.max_features = photos.limits.max_features,
                            .max_size_px = photos.limits.max_image_size_px,
                            .order = SiftOrder::kLargest,
                            .contrast = kContrast};
  Progress progress(job.sink, photos.task, static_cast<long>(wanted.size()));
  std::vector<std::optional<DatabasePhoto>> found(wanted.size());
  std::vector<std::string> unreadable(wanted.size());
  const auto find = [&](std::size_t i) {
    CheckInterrupted();
    try {
      const auto loaded = tracks_internal::LoadFrame(source, static_cast<int>(i));
      SiftFeatures sift = FindSift(loaded.image, loaded.mask, options);
      DatabasePhoto photo;
      photo.name = names[i];
      photo.descriptors = ToBytes(sift.descriptors);
      photo.features = std::move(sift.features);
      found[i] = std::move(photo);
    } catch (const InputError& error) {
      unreadable[i] = error.what();
    }
  };
  const auto write = [&](std::size_t i) {
    progress.Step();
    if (!found[i]) {
      job.sink.Message(fmt::format("{} is left out: {}", names[i], unreadable[i]));
      return;
    }
    DatabasePhoto& photo = *found[i];
    photo.id = last_id + 1 + static_cast<std::int64_t>(i);
    photo.camera_id = camera_id;
    if (!photos.cameras.shared || camera_id == 0) photo.camera = FirstCamera(photos.cameras, *wanted[i]);
    camera_id = db.AddPhoto(photo);
    found[i].reset();
  };
  ParallelInOrder(wanted.size(), find, write);
  return true;
}

}  // namespace lumi
