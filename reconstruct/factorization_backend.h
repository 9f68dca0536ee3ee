// --backend factorization: cameras from feature tracks alone, without COLMAP (thesis sec. 2.5, 6.4.1).
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "reconstruct/given_camera.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/model/camera.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"
#include "scene/tracks/tracks.h"

namespace lumi {

// What is known of the lens before the first track is followed.
struct KnownIntrinsics {
  std::optional<Camera> camera;  // of every photo; none: nothing is known
  bool approximate = false;      // from EXIF: the adjustment may move its focal length
  std::string source;            // for people: "camera.yaml", "EXIF", "--focal-px", "--intrinsics", or empty
};
// --camera, --intrinsics or --focal-px, else the EXIF focal length where all photos agree in it. Throws DataError where
// the photos differ in size.
KnownIntrinsics FindIntrinsics(const Capture& capture, const ReconstructOptions& options);

// Features followed through the frames of a video (or of a folder, with --matching sequential), else matched across
// photos. A video is followed through all its frames; the tracks are then those of the frames that `capture` names and,
// where these are few, of some between them; or of all with --all-frames.
struct FoundTracks {
  Tracks tracks;
  Capture used;  // the frames that a camera is asked for
  std::optional<int>
      cut_frame;  // with --projective, all frames of a video end with the first shot: the next one's first
};
FoundTracks FindTracks(const Capture& capture, const ReconstructOptions& options, const GivenCamera& given,
                       const std::filesystem::path& work_folder, ProgressSink& sink);

// Metric (distorted cameras, as they took the photos), or quasi-affine where the data or --projective ask for it;
// summary.upgrade tells. Throws DataError: no structure in the tracks (named), or not metric where --require metric
// wants it so.
Scene ReconstructByFactorization(const Capture& capture, const ReconstructOptions& options, const GivenCamera& given,
                                 const std::filesystem::path& work_folder, ReconstructSummary& summary,
                                 ProgressSink& sink);

// FinishScene's counterpart: undistorted photos and projective.json.
Scene FinishProjectiveScene(Scene scene, const ReconstructOptions& options, ReconstructSummary& summary,
                            ProgressSink& sink);

}  // namespace lumi
