#include "reconstruct/map_lenses.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "reconstruct/colmap_database.h"
#include "reconstruct/lenses.h"
#include "reconstruct/reprojection.h"
#include "reconstruct/standing.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// With fewer photos placed another way is worth its time.
constexpr double kNearlyAll = 0.9;
// Of the mean reprojection error: what several lenses must gain where they place as many photos.
constexpr double kClearlyBetter = 0.8;
// ... or what it may lose where fewer cameras contradict their matches.
constexpr double kNoWorse = 1.02;
constexpr double kContradicts = 0.5;  // of the points that others hold are where it has them
// Sharing lenses again may cost this much.
constexpr double kAlike = 1.05;
constexpr std::size_t kPhotosForLenses = 3;

bool SomeLensIsGuessed(const Capture& capture, const CameraPlan& cameras, const ReconstructOptions& options) {
  return !capture.is_video && !cameras.known && options.database.empty() &&
         options.single_camera == SingleCamera::kAuto &&
         static_cast<std::size_t>(std::ranges::count_if(capture.photos, LensIsUnknown)) >= kPhotosForLenses;
}

std::ptrdiff_t Contradicting(const std::vector<CameraEvidence>& evidence) {
  return std::ranges::count_if(
      evidence, [](const CameraEvidence& e) { return e.agreeing < kContradicts * static_cast<double>(e.seen.size()); });
}

}  // namespace

Mapping MapScenePerLens(const Capture& capture, const CameraPlan& cameras, const Features& features,
                        const ColmapJob& job) {
  Mapping first = MapScene(capture, cameras, features, job);
  if (!SomeLensIsGuessed(capture, cameras, job.options)) return first;
  const auto evidence = EvidenceOf(first.scene, VerifiedMatchesOf(first.scene, ColmapDatabase(features.database)));
  const bool one_lens = OneLensExplains(FocalsOfViews(first.scene, evidence));
  const bool nearly_all =
      static_cast<double>(first.scene.views.size()) >= kNearlyAll * static_cast<double>(capture.photos.size());
  if (one_lens && nearly_all) return first;
  const std::string found = one_lens ? fmt::format("{} of {} photos were placed by one camera for all of a size",
                                                   first.scene.views.size(), capture.photos.size())
                                     : "the photos were not all taken by one lens";
  if (!SplitUnknownLenses(capture, features.database)) {
    job.sink.Message(found + "; --single-camera no gives each its own");
    return first;
  }
  job.sink.Message(found + ": trying a camera for each");
  std::optional<Mapping> second;
  try {
    second = MapScene(capture, cameras, features, job);
  } catch (const DataError&) {
    // The first mapping is kept.
  }
  if (second) {
    Scene own = second->scene, shared = ShareLikeLenses(own);
    const double own_px = UpdatePointErrors(own);
    UpdatePointErrors(shared);
    shared = PolishCameras(shared, false, kPolishIterations, job);
    shared.image_folder = own.image_folder;
    if (UpdatePointErrors(shared) <= kAlike * own_px) second->scene = std::move(shared);
    const auto placed = second->scene.views.size(), before = first.scene.views.size();
    const double now_px = UpdatePointErrors(second->scene), before_px = UpdatePointErrors(first.scene);
    second->steps.insert(second->steps.begin(), first.steps.begin(), first.steps.end());
    const auto contradicting = [&](const Scene& scene) {
      return Contradicting(EvidenceOf(scene, VerifiedMatchesOf(scene, ColmapDatabase(features.database))));
    };
    const bool clearly_better = now_px < kClearlyBetter * before_px;
    if (placed > before ||
        (placed == before && (clearly_better || (now_px < kNoWorse * before_px &&
                                                 contradicting(second->scene) < Contradicting(evidence))))) {
      job.sink.Message(fmt::format("{} cameras for {} photos: {:.2f} px instead of {:.2f}, {} placed instead of {}",
                                   second->scene.cameras.size(), placed, now_px, before_px, placed, before));
      return std::move(*second);
    }
    first.steps = std::move(second->steps);
  }
  return first;
}

}  // namespace lumi
