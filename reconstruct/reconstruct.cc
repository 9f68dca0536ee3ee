#include "reconstruct/reconstruct.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "reconstruct/all_frames.h"
#include "reconstruct/cameras_beside.h"
#include "reconstruct/clips.h"
#include "reconstruct/colmap_database.h"
#include "reconstruct/colmap_program.h"
#include "reconstruct/compare_backends.h"
#include "reconstruct/factorization_backend.h"
#include "reconstruct/features.h"
#include "reconstruct/finish.h"
#include "reconstruct/given_camera.h"
#include "reconstruct/grid.h"
#include "reconstruct/held_cameras.h"
#include "reconstruct/known_cameras.h"
#include "reconstruct/map_lenses.h"
#include "reconstruct/masks.h"
#include "reconstruct/measure_scene.h"
#include "reconstruct/missing.h"
#include "reconstruct/multi_camera.h"
#include "reconstruct/near_pairs.h"
#include "reconstruct/photos.h"
#include "reconstruct/ring.h"
#include "reconstruct/standing.h"
#include "reconstruct/turntable.h"
#include "reconstruct/unsuitable.h"
#include "reconstruct/video_frames.h"
#include "reconstruct/view_times.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kStage = "reconstruct";
constexpr const char* kSummaryFile = "provenance/reconstruct-summary.json";

bool LiesIn(const fs::path& inner, const fs::path& outer) {
  const fs::path a = fs::weakly_canonical(inner), b = fs::weakly_canonical(outer);
  const fs::path relative = a.lexically_relative(b);
  return !relative.empty() && *relative.begin() != "..";
}

// Nothing of the user's is changed: the output is new, empty, or an earlier output of this program.
void RequireUsableOutput(const ReconstructOptions& options) {
  RequireOurFolder(options.scene, "provenance");
  std::error_code ec;
  for (const fs::path& input : options.inputs.size() > 1 ? options.inputs : std::vector{options.input})
    if (fs::exists(options.scene, ec) && LiesIn(input, options.scene))
      throw UsageError(fmt::format("the input lies inside the output folder {}", options.scene.string()),
                       "choose another output");
  if (fs::exists(options.scene / "truth", ec))
    throw UsageError(
        fmt::format("{} is a simulated capture with its truth; it would be overwritten", options.scene.string()),
        "choose another output");
}

Provenance WantedProvenance(const ReconstructOptions& options) {
  Provenance wanted;
  wanted.stage = kStage;
  wanted.version = kVersion;
  wanted.options = OptionsAsText(options);
  for (const fs::path& input : options.inputs.size() > 1 ? options.inputs : std::vector{options.input})
    wanted.inputs[fs::absolute(input).lexically_normal().string()] = Fingerprint(input);
  return wanted;
}

void RecordOutputs(const ReconstructOptions& options, const ReconstructSummary& summary, Provenance& record) {
  std::vector<std::string> outputs{"images", summary.upgrade == "metric" ? "sparse" : "projective.json", kSummaryFile};
  if (!options.masks.empty()) outputs.push_back("masks");
  for (const std::string& output : outputs) record.outputs[output] = Fingerprint(options.scene / output);
  record.outputs["lumigraph.json"] = kChangedLater;
  if (const fs::path kept = CamerasOf(summary.backend, {}); fs::exists(options.scene / kept))
    record.outputs[kept.string()] = Fingerprint(options.scene / kept);
}

std::set<std::string> ViewNames(const Scene& scene) {
  std::set<std::string> names;
  for (const View& view : scene.views) names.insert(view.name);
  return names;
}

// Cameras estimated by COLMAP.
Scene Estimate(const Capture& capture, const GivenCamera& given, const ColmapJob& job, ReconstructSummary& summary) {
  const auto& [options, work_folder, colmap, sink] = job;
  const CameraPlan cameras = PlanCameras(capture, options);
  const Features features = FindAndMatchFeatures(capture, cameras, job, {.near = ClipPairs(capture)});
  summary.reused.insert(summary.reused.end(), features.reused.begin(), features.reused.end());
  Mapping mapping = MapScenePerLens(capture, cameras, features, job);
  summary.steps = features.steps;
  summary.steps.insert(summary.steps.end(), mapping.steps.begin(), mapping.steps.end());
  summary.components = mapping.components;
  summary.component = mapping.component;
  summary.missing =
      ExplainMissing(capture, ColmapDatabase(features.database), ViewNames(mapping.scene), mapping.other_parts);
  Scene scene = std::move(mapping.scene);
  StandingCameras standing = KeepCamerasThatStand(scene, cameras, features, job);
  summary.standings = std::move(standing.standings);
  std::ranges::move(standing.left_out, std::back_inserter(summary.missing));
  std::ranges::sort(summary.missing, {}, &MissingPhoto::name);
  const double fraction = static_cast<double>(scene.views.size()) / std::max(1, capture.total());
  if (fraction < options.min_registered)
    throw DataError(fmt::format("only {} of {} photos got a camera, {:.0f} % were asked for{}", scene.views.size(),
                                capture.total(), 100 * options.min_registered,
                                summary.missing.empty() ? ""
                                                        : fmt::format("; {}: {}", summary.missing.front().name,
                                                                      summary.missing.front().reason)),
                    summary.missing.empty() ? "" : summary.missing.front().hint);
  CopyPhotoFacts(capture, scene);
  if (options.all_frames) {
    Capture keyframes = capture;
    keyframes.folder = given.originals;
    Capture all = ExtractAllFrames(options, keyframes, work_folder / "frames", sink);
    if (given.resampled) all = Resampled(all, *given.resampled, work_folder / "straight-frames", sink);
    RegisterAllFrames(scene, all, features, cameras.known.has_value(), job, summary.missing);
    CopyPhotoFacts(all, scene);
    summary.images_total = all.total();
  }
  return scene;
}

// Cameras given (--poses) or assumed (--rig): only points are sought.
// *skewed: by their names, the cameras of photos that lost a skew.
Scene Hold(const Capture& photos, const ColmapJob& job, ReconstructSummary& summary,
           std::map<std::string, Camera>* skewed) {
  const auto& [options, work_folder, colmap, sink] = job;
  summary.missing = photos.unreadable;
  Capture capture = photos;
  // Read before COLMAP works for minutes: most mistakes are here.
  std::vector<HeldView> views;
  if (!options.poses.empty()) {
    views = ReadKnownCameras(capture, options, &summary.missing, sink);
    // Features of photos without a pose would serve nothing.
    std::set<std::string> posed;
    for (const HeldView& view : views) posed.insert(view.name);
    std::erase_if(capture.photos, [&](const InputPhoto& photo) { return !posed.contains(photo.name); });
  }
  if (HasSkew(views, capture)) {
    sink.Message("the given cameras have skew: the photos are resampled without it");
    capture = RemoveSkew(capture, views, work_folder / "unskewed", sink);
    for (const HeldView& view : views)
      if (view.camera.IsPinhole()) skewed->emplace(view.name, WithSkew(view));
  }
  CameraPlan cameras;  // every photo its own: nothing is estimated
  ReconstructOptions feature_options = options;
  feature_options.camera_yaml.clear();
  feature_options.single_camera = SingleCamera::kNo;
  std::vector<KnownStand> stands;
  std::vector<GridPosition> grid;
  if (options.rig == Rig::kGrid) {
    grid = GridPositions(capture, options);
    for (const GridPosition& p : grid) stands.push_back({{p.horizontal, p.vertical, 0}, Eigen::Vector3d::UnitZ()});
  }
  if (views.size() == capture.photos.size())  // in the photos' order
    for (const HeldView& view : views)
      stands.push_back({view.cam_from_world.OriginInSource(), view.cam_from_world.R().row(2)});
  const Features features = FindAndMatchFeatures(capture, cameras, {feature_options, work_folder, colmap, sink},
                                                 {.near = NearPairs(stands), .is_all = !stands.empty()});
  summary.reused.insert(summary.reused.end(), features.reused.begin(), features.reused.end());
  if (options.rig == Rig::kRing) views = AssumeRing(capture, options, features.database, sink);
  if (options.rig == Rig::kGrid) views = AssumeGrid(capture, options, grid, features.database, sink);

  const HeldTriangulationOptions triangulation;
  Scene scene = TriangulateHeld(views, features.database, triangulation, sink);
  if (std::ranges::any_of(views, [](const HeldView& v) { return !v.undistorted_alternative.params.empty(); })) {
    std::vector<HeldView> plain = views;
    for (HeldView& view : plain)
      if (!view.undistorted_alternative.params.empty()) view.camera = view.undistorted_alternative;
    Scene other = TriangulateHeld(plain, features.database, triangulation, sink);
    const auto observations = [](const Scene& s) {
      std::size_t n = 0;
      for (const Point& point : s.points) n += point.track.size();
      return n;
    };
    const bool undistorted = observations(other) > observations(scene);
    sink.Message(undistorted
                     ? "the rescaled photos agree better without the cameras' distortion: they were undistorted before"
                     : "the rescaled photos still have the cameras' distortion");
    if (undistorted) scene = std::move(other);
  }
  constexpr std::size_t kMinPoints = 20;
  if (scene.points.size() < kMinPoints && !options.poses.empty() &&
      (options.poses_format == PosesFormat::kProjection || options.poses_format == PosesFormat::kUnset)) {
    scene = TriangulateHeld(Mirrored(views), features.database, triangulation, sink);
    if (scene.points.size() >= kMinPoints)
      sink.Message("the given matrices describe a mirrored world: its z axis was reversed");
  }
  if (scene.points.size() < kMinPoints)
    throw DataError(
        fmt::format("only {} points agree with the {} cameras", scene.points.size(),
                    options.rig == Rig::kNone ? "given" : "assumed"),
        options.rig == Rig::kNone
            ? "check --poses-format, --pixel-origin, the focal length, and that the order or names fit the photos"
            : "check the focal length, the order of the photos and the rig");
  scene.image_folder = capture.folder;
  CopyPhotoFacts(capture, scene);
  ColorPoints(scene, sink);
  summary.standings = MeasureStandings(scene, VerifiedMatchesOf(scene, ColmapDatabase(features.database)));
  summary.components = {static_cast<int>(scene.views.size())};
  return scene;
}

// Options that the kind of input decides.
void RequireThatTheyGoTogether(const ReconstructOptions& options, bool is_video, bool several_videos) {
  if (is_video && !HasVideoExtension(options.input))
    throw InputError(options.input, "neither a folder of photos nor a video",
                     "give a folder of photos, or a video file");
  if (is_video && options.clips) throw UsageError("--clips is for a folder of videos", "one video needs no option");
  if (!is_video && options.all_frames) throw UsageError("--all-frames goes with a video");
  if (several_videos && options.backend == Backend::kFactorization)
    throw UsageError("several videos at once go with --backend colmap");
  if (!several_videos && (!options.offsets_frames.empty() || options.frame_step != 1))
    throw UsageError("--offsets-frames and --frame-step are for a folder of videos that fixed cameras took at once");
  if (!options.times.empty() && (is_video || several_videos))
    throw UsageError("--times is for photos: a video's frames have their own");
  if (options.turntable && !PeriodOfScene(options))
    throw UsageError("--turntable needs the period: --period-s, or phases in the file of --times");
}

void RequireTwoPhotos(const Capture& photos, const ReconstructOptions& options) {
  if (photos.photos.size() >= 2) return;
  if (photos.photos.empty() && !photos.unreadable.empty()) {
    const MissingPhoto& first = photos.unreadable.front();
    const bool unreadable = first.reason.starts_with("unreadable");
    throw DataError(fmt::format("none of the {} photos can be {} ({}: {})", photos.total(),
                                unreadable ? "read" : "used", first.name, first.reason),
                    unreadable ? "give pictures that are whole: JPEG, PNG, TIFF, HEIC or RAW" : first.hint,
                    options.input);
  }
  throw DataError("only one photo can be used; a scene needs two or more",
                  "take photos of the same thing from several places", options.input);
}

// What --masks names, under the names that the steps look for. A video's other frames than its keyframes have masks
// too: its folder is left as it is.
fs::path MasksToUse(const Capture& capture, const ReconstructOptions& options, bool several_videos,
                    const fs::path& work_folder, ProgressSink& sink) {
  if (options.masks.empty() || several_videos) return options.masks;
  const bool some_frames = capture.is_video && !capture.every_frame;
  return MasksForColmap(capture, options.masks, some_frames ? fs::path() : work_folder / "masks", sink);
}

// The photos of a folder; before anything is written, whether all that is given can be used.
Capture PhotosToUse(const ReconstructOptions& options, bool is_video, bool several_videos, ProgressSink& sink) {
  Capture photos;
  if (is_video) {
    const VideoReader readable(options.input);
    CheckGivenCamera(options, {{readable.width(), readable.height()}});
  } else if (!several_videos && !options.clips) {
    photos = FindPhotos(options.input, sink);
    LeaveOutUnsuitable(photos, options, sink);
    if (!options.times.empty()) photos = WithTimes(photos, options);
    RequireTwoPhotos(photos, options);
    std::set<std::pair<int, int>> sizes_px;
    for (const InputPhoto& photo : photos.photos) sizes_px.insert({photo.width_px, photo.height_px});
    CheckGivenCamera(options, sizes_px);
  }
  return photos;
}

}  // namespace

ReconstructSummary Reconstruct(const ReconstructOptions& given_options, ProgressSink& sink) {
  const Stopwatch watch;
  ReconstructOptions options = given_options;
  if (options.inputs.size() > 1) {
    ClipsOf(options);
    options.clips = true;
  } else {
    TakeCamerasBeside(options, sink);
  }
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  std::error_code ec;
  for (const auto& path :
       {options.camera_yaml, options.masks, options.database, options.poses, options.grid_positions, options.times})
    if (!path.empty() && !fs::exists(path, ec)) throw InputError(path, "no such file or folder");
  const bool several_clips = options.inputs.size() > 1;
  const bool is_video = !several_clips && fs::is_regular_file(options.input, ec);
  if (!fs::exists(options.input, ec)) throw InputError(options.input, "no such file or folder");
  const bool several_videos = !is_video && !options.clips && !SynchronisedVideos(options.input).empty();
  RequireThatTheyGoTogether(options, is_video, several_videos);
  RequireUsableOutput(options);
  Capture photos = PhotosToUse(options, is_video, several_videos, sink);

  // Before the lock: later stages may be working in a scene that is up to date.
  Provenance wanted = WantedProvenance(options);
  const auto before = fs::exists(options.scene / "lumigraph.json", ec) &&
                              fs::exists(options.scene / kSummaryFile, ec) && IsUpToDate(options.scene, wanted)
                          ? JsonKeys::Parse(ReadText(options.scene / kSummaryFile))
                          : std::nullopt;
  if (before) {
    auto summary = before->As<ReconstructSummary>();
    summary.reused = {"everything"};
    summary.colmap_seconds = 0;
    summary.seconds = watch.Seconds();
    sink.Message("nothing to do: the scene is up to date");
    return summary;
  }

  const FolderLock lock(options.scene);
  fs::create_directories(options.scene / "provenance");
  const fs::path work_folder = options.scene / "colmap";
  fs::create_directories(work_folder);
  ColmapProgram colmap(work_folder / "colmap.log", sink);
  ReconstructSummary summary;
  MultiCapture cameras;
  if (several_videos) photos = (cameras = OpenMultiCapture(options, work_folder, sink)).moment;
  const bool every_frame = is_video && options.projective && options.all_frames;
  Capture capture = every_frame     ? ExtractEveryFrame(options, work_folder / "frames", sink)
                    : options.clips ? ExtractClips(options, work_folder, &summary.reused, sink)
                    : is_video      ? ExtractKeyframes(options, work_folder, &summary.reused, sink)
                                    : StageForColmap(photos, work_folder / "photos", sink);
  if (!is_video && !several_videos) RequireTwoPhotos(capture, options);
  if (!is_video && options.fps > 0) NumberFrames(capture, options.fps);
  if ((is_video && !every_frame) || options.clips) summary.keyframes = static_cast<int>(capture.photos.size());
  summary.images_total = capture.total();

  ReconstructOptions fitted = options;
  fitted.masks = MasksToUse(capture, options, several_videos, work_folder, sink);
  const GivenCamera given = FitGivenCamera(fitted, capture, work_folder, sink);
  fitted.camera_yaml = given.yaml;
  fitted.masks = given.masks;
  const ColmapJob job{fitted, work_folder, colmap, sink};
  std::map<std::string, Camera> skewed;
  Scene scene = options.backend == Backend::kFactorization
                    ? ReconstructByFactorization(given.capture, fitted, given, work_folder, summary, sink)
                : options.poses.empty() && options.rig == Rig::kNone ? Estimate(given.capture, given, job, summary)
                                                                     : Hold(given.capture, job, summary, &skewed);
  if (several_videos) {
    if (given.resampled)
      throw UsageError("several videos at once take a camera.yaml without skew and k3 only",
                       "undistort the videos before");
    if (options.offsets_frames.empty()) RefineWithCameras(cameras, scene, sink);
    ExpandFrames(scene, cameras, options, work_folder / "frames", summary, sink);
  }
  scene.period_s = PeriodOfScene(options);
  if (options.unit_m) scene.metres_per_unit = options.unit_m;
  if (options.step_m) scene.metres_per_unit = *options.step_m / StepOfCameras(scene);
  if (options.turntable) {
    const TurnAxis axis = PutIntoRoom(scene, *scene.period_s);
    sink.Message(
        fmt::format("the object turns about ({:.3f}, {:.3f}, {:.3f}); from photo to photo the camera moves by {:.2g} "
                    "in the room, by {:.2g} about the object",
                    axis.direction.x(), axis.direction.y(), axis.direction.z(), axis.room_step, axis.object_step));
  }
  const int photos_total = summary.images_total;
  if (scene.frame == Frame::kMetric)
    scene = FinishScene(std::move(scene), fitted, summary, sink);
  else
    scene = FinishProjectiveScene(std::move(scene), fitted, summary, sink);
  NoteHowPhotosWereTaken(scene, given, skewed);
  if (!summary.missing.empty())
    sink.Message(fmt::format("{} of {} photos got no camera; first: {}: {}", summary.missing.size(), photos_total,
                             summary.missing.front().name, summary.missing.front().reason));
  summary.colmap_seconds = colmap.seconds();
  summary.seconds = watch.Seconds();
  if (scene.frame == Frame::kMetric && options.poses.empty() && options.rig == Rig::kNone)
    summary.comparison = KeepAndCompare(scene, summary, wanted.inputs.begin()->second, options.scene);

  WriteTextAtomically(options.scene / kSummaryFile, JsonKeys(summary).Text(2) + "\n");
  RecordOutputs(options, summary, wanted);
  wanted.seconds = summary.seconds;
  WriteProvenance(options.scene, wanted);
  return summary;
}

}  // namespace lumi
