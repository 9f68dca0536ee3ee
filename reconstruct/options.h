// What lumi-reconstruct is asked for and what it answers: photos or a video -> cameras and sparse points.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/step_time.h"
#include "scene/files/json_keys.h"

namespace lumi {

enum class Backend { kColmap, kFactorization };
enum class Refine { kAuto, kNone, kFocal, kCentre };
enum class Matching { kAuto, kExhaustive, kSequential, kSimilar };
enum class SingleCamera { kAuto, kYes, kNo };
enum class Quality { kAuto, kLow, kMedium, kHigh };
enum class PosesFormat { kUnset, kProjection, kCamFromWorld, kWorldFromCam };
enum class PixelOrigin { kCorner, kCentre };  // where (0, 0) lies in the upper-left pixel
enum class Rig { kNone, kRing, kGrid };
// How COLMAP places photos. kQuick and kCareful: its incremental mapper; while cameras are placed, adjustments stop
// early or at COLMAP's own bounds. kHierarchical: its hierarchical mapper, which places parts by themselves and joins
// them.
enum class Mapper { kHierarchical, kQuick, kCareful };
enum class FeatureFinder { kAuto, kOwn, kColmap };
enum class Homographies { kAuto, kAlways, kNever };

struct ReconstructOptions {
  std::filesystem::path input;  // folder of photos, or a video
  std::filesystem::path scene;  // output folder

  Backend backend = Backend::kColmap;
  bool projective = false;  // factorisation: stop at the quasi-affine frame
  // With `projective`: frames without rank-4 structure are related by homographies; auto: where the factorisation
  // refuses them.
  Homographies homographies = Homographies::kAuto;
  double fps = 0;               // a folder's frame_000123.jpg are a video's, so many a second; 0: they carry no time
  bool require_metric = false;  // fail where the scene would not be metric
  Refine refine =
      Refine::kAuto;  // factorisation: which intrinsics the metric adjustment may move; auto: EXIF's focal length only
  int features = 0;   // factorisation: tracks aimed at in a frame, or features a photo; 0 = their defaults
  int window_frames = 0;  // factorisation: frames that are factorised at once; 0 = the default
  bool adjust = true;     // factorisation: bundle adjustment; off to see what it is worth

  std::filesystem::path camera_yaml;  // intrinsics, held fixed; empty: estimated
  std::filesystem::path masks;        // folder of NAME.png, black = ignore; empty: none
  std::filesystem::path database;  // a COLMAP database to take features and matches from (copied); empty: look beside
  int component = 0;               // which part of a split scene, by size; 0 = the largest
  Matching matching = Matching::kAuto;
  int partners = 0;  // how many photos that look most like it each is matched with at first; 0 = the default
  Mapper mapper = Mapper::kQuick;
  FeatureFinder finder = FeatureFinder::kAuto;  // of features and matches; auto: own
  Quality quality = Quality::kAuto;             // sets the next two where they are 0
  int max_image_size_px = 0;                    // features are searched in photos shrunk to this
  int max_features = 0;                         // a photo
  SingleCamera single_camera = SingleCamera::kAuto;
  double min_registered = 0.0;  // fraction of the photos that must get a camera, in [0, 1]
  std::uint64_t seed = 0;
  int threads = 0;              // 0 = all cores
  bool database_beside = true;  // a database.db beside the folder of photos is taken where `database` is empty

  // Measuring (tradeoff.h); the scene does not depend on it.
  bool tradeoff = false;
  std::filesystem::path
      reference;  // scene, COLMAP model or truth/ that cameras are compared with; empty: see ReconstructWithTradeoff

  // Video.
  int keyframes = 0;        // how many; 0 = by parallax
  bool all_frames = false;  // every other frame is resectioned against the keyframes

  std::vector<std::filesystem::path> inputs;  // several videos: clips; `input` is the first. Else empty or that alone
  bool clips = false;  // `input` is a folder of hand-held videos of one place, not taken at once: clips.h

  // Several videos of one scene, from fixed cameras.
  std::vector<int>
      offsets_frames;  // when each starts, in frames of a common clock, in the order of their names; empty: found
  int frame_step = 1;  // every so many frames become views

  // Time, where the user knows it.
  std::filesystem::path times;     // CSV: view_times.h; empty: a video's own, or none
  std::optional<double> period_s;  // of a scene that repeats itself
  bool turntable = false;          // `poses` are in the frame of an object that turns once a period: turntable.h

  // Cameras that are already known.
  std::filesystem::path poses;
  PosesFormat poses_format = PosesFormat::kUnset;
  PixelOrigin pixel_origin = PixelOrigin::kCorner;
  std::optional<double> focal_px;
  std::vector<double> intrinsics;  // fx, fy, cx, cy in pixels, or empty
  bool rescale_cameras = false;

  // A scale: of `poses` or `grid_positions`, how long their unit is; of a rig, how far neighbouring cameras are apart.
  std::optional<double> unit_m, step_m;

  // Cameras that are assumed.
  Rig rig = Rig::kNone;
  bool search_focal = false;             // --focal-px search
  std::string grid_size;                 // "ROWSxCOLUMNS"
  std::filesystem::path grid_positions;  // CSV: file, row, column, vertical, horizontal coordinate
  std::optional<double> grid_plane;  // distance of the plane on which all photos coincide, in units of the positions;
                                     // 0: parallel cameras with the principal point in the middle; none: found
};

// As the options call them.
std::string Name(Backend backend);
std::string Name(Matching matching);
std::string Name(Mapper mapper);

// What is wrong with the options, or an empty string. Looks at no file.
std::string Validate(const ReconstructOptions& options);

// As name -> value, for provenance (without threads).
std::map<std::string, std::string> OptionsAsText(const ReconstructOptions& options);

struct MissingPhoto {
  std::string name;
  std::string reason;
  std::string hint;  // what to shoot or try
};

// What holds a camera (standing.h).
struct CameraStanding {
  std::string name;
  int points = 0;        // that two other photos hold, and that its pose shows where the matches have them
  int offered = 0;       // of so many
  double spread = 0;     // share of the photo, by an 8 x 8 grid, that shows some of them
  double angle_deg = 0;  // under which other photos hold them, the median
  std::optional<double> sigma_percent;  // standard deviation of its centre, of the cameras' extent; none: undetermined
  bool placed_anew = false;             // its points contradicted where it stood first
  std::string remark;                   // why it is named; empty: nothing speaks against it
};

// The other backend's cameras of the same capture, after the similarity that aligns them.
struct BackendComparison {
  Backend backend = Backend::kColmap;  // the other one
  int views = 0;                       // that both placed
  double centre_rms_percent = 0;       // of the extent of the other's centres
  double rotation_rms_deg = 0;
  double mean_reprojection_error_px = 0, seconds = 0;  // the other's
};

struct ReconstructSummary {
  int images_total = 0;
  int images_registered = 0;
  std::vector<MissingPhoto> missing;
  std::vector<CameraStanding> standings;  // COLMAP's cameras only; those that are named first, then the least certain
  double mean_reprojection_error_px = 0;
  Backend backend = Backend::kColmap;
  std::string upgrade = "metric";    // or quasi-affine, none
  std::string upgrade_reason;        // why it is not metric
  std::string structure = "points";  // or homographies: all cameras at one centre
  int homography_frames = 0;         // frames placed by a homography against their neighbour, without structure
  std::optional<int>
      cut_frame;  // projective videos: the first frame of the next shot, by its number; the scene ends before it
  std::vector<std::string> warnings;
  std::optional<BackendComparison> comparison;
  int points = 0;
  int cameras = 0;
  std::string camera_model;         // as estimated, before undistortion; several joined by "+"
  std::vector<int> components;      // photos of each part that COLMAP found, the largest first
  int component = 0;                // which of them the scene is
  int keyframes = 0;                // video only
  std::optional<double> focal_px;   // of the first camera
  std::vector<std::string> reused;  // what an earlier run or the user's database had done already
  std::vector<StepTime> steps;      // estimated cameras, COLMAP's mapper: those that were done
  double colmap_seconds = 0;
  double seconds = 0;
};

// The keys of the programs' contract; the text for people.
void ListKeys(JsonKeys& j, ReconstructSummary& summary);
std::string Describe(const ReconstructSummary& summary);

}  // namespace lumi
