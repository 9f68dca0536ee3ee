// Structure and motion from feature tracks by projective factorisation (thesis sec. 2.5, 6.4.1), to a Euclidean frame
// where the intrinsics are known and the data allow it, else to an honest quasi-affine one.
//
//   tracks -> windows -> (seed, factorise, cull, adjust) each -> merged -> adjusted -> upgraded -> adjusted
//
// A scene that has no projective structure (one plane, a camera that only turns or does not move) is refused by name.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/factorization/cull.h"
#include "reconstruct/factorization/metric_bundle.h"
#include "reconstruct/factorization/windows.h"
#include "scene/geometry/projection.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"
#include "scene/model/scene.h"
#include "scene/program/error.h"
#include "scene/program/progress.h"
#include "scene/tracks/tracks.h"

namespace lumi {

struct FactorizationOptions {
  WindowOptions windows;
  double inlier_px = 4.0;         // reprojection error within which a sight agrees, before anything is adjusted
  double epipolar_px = 2.0;       // the same for the distance to an epipolar line
  CullOptions cull;               // afterwards: by the robust scale
  int factorise_iterations = 30;  // 0: the seed's cameras as they are
  bool adjust = true;             // bundle adjustment; off for measuring what it is worth
  BundleOptions::Loss loss = BundleOptions::Loss::kCauchy;
  int adjust_sights = 80;  // a frame's sights that steer the projective adjustment of all frames; 0: all
  FreeIntrinsics intrinsics = FreeIntrinsics::kNone;  // in the metric adjustment
  bool projective_only = false;                       // stop at the quasi-affine frame on purpose
  double max_plane_sigma = 0.1;  // a plane at infinity less certain than this (see Upgrade) is not believed
  std::uint64_t seed = 0;
};
// What is wrong with the options, or empty.
std::string Validate(const FactorizationOptions& options);

enum class FactorizationRefusal {
  kTooFewTracks,  // no two frames share 16 tracks that agree
  kNoMotion,      // the camera does not move
  kPureRotation,  // it only turns
  kPlanarScene,   // it moves, but all that is seen lies in one plane
};
std::string_view Name(FactorizationRefusal refusal);  // "too few tracks", ...

// Exit code 1, the reason's name first in its message.
struct FactorizationRefused : DataError {
  FactorizationRefused(FactorizationRefusal why, const std::string& detail, const std::string& hint);
  FactorizationRefusal refusal;
};

enum class UpgradeKind { kNone, kQuasiAffine, kMetric };
std::string_view Name(UpgradeKind kind);  // "none", "quasi-affine", "metric"

struct WindowDiagnostics {
  int first_frame = -1, last_frame = -1, frames = 0, tracks = 0;  // what went in
  int placed = 0, solved = 0;                                     // what came out
  std::string outcome;              // "merged", "no parallax", "too few tracks", "not connected", "known already"
  double parallax_px = 0;           // of the first pair
  double gap = 0, rank3_gap = 0;    // Factorisation's; gap is the quality figure
  double sigma_px = 0, rms_px = 0;  // after adjustment
  double merge_rms_px = 0;
};

struct FactorizationPoint {
  int track = -1;                               // into Tracks::tracks
  Eigen::Vector4d X = Eigen::Vector4d::Zero();  // homogeneous, norm 1, w >= 0 (w < 0: beyond infinity by its noise)
  double error_px = 0;                          // mean over its sights
  std::vector<int> observations;                // into Track::observations: those that agree
};

struct MissingFrame {
  int frame = -1;
  std::string reason;
};

struct StageSeconds {
  double windows = 0, merging = 0, projective = 0, upgrade = 0, metric = 0, total = 0;
};

struct FactorizationResult {
  UpgradeKind upgrade = UpgradeKind::kNone;
  std::string upgrade_reason;          // why it is not metric; empty where it is
  std::vector<char> placed;            // one a frame
  std::vector<Matrix34d> P;            // undistorted pixels from world, w > 0 in front; one a frame, where placed
  std::optional<Camera> camera;        // metric: pinhole for undistorted pixels, as given or as adjusted
  std::vector<Rigid3> cam_from_world;  // metric; one a frame, where placed
  std::vector<FactorizationPoint> points;
  Eigen::Vector4d plane_at_infinity = Eigen::Vector4d(0, 0, 0, 1);
  std::vector<MissingFrame> missing;
  std::vector<std::string> warnings;

  double projective_rms_px = 0;  // over inlier sights, before the upgrade
  double rms_px = 0;             // of the result
  double sigma_px = 0;           // robust noise of one image coordinate
  long sights = 0, culled = 0;
  double upgrade_condition = 0, upgrade_plane_sigma = 0, upgrade_residual = 0;  // see Upgrade; 0 where not tried
  double quasi_affine_margin = 0;
  std::vector<WindowDiagnostics> windows;
  StageSeconds seconds;
};

// camera: one for all frames; its distortion is taken out of the tracks first. Without it the result is quasi-affine.
// Throws FactorizationRefused, UsageError for bad options or a camera that is not valid, Interrupted.
FactorizationResult ReconstructFromTracks(const Tracks& tracks, const std::optional<Camera>& camera,
                                          const FactorizationOptions& options, ProgressSink& progress);

// As a scene: views are the placed frames sorted by name, image_folder is left to the caller. Points at infinity
// (farther than 1e4 times the extent of the cameras, metric) are left out: a scene's points are finite.
Scene ToScene(const FactorizationResult& result, const Tracks& tracks);

}  // namespace lumi
