#include "reconstruct/factorization_backend.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "reconstruct/factorization/homographies.h"
#include "reconstruct/factorization/reconstruct_from_tracks.h"
#include "reconstruct/features.h"
#include "reconstruct/finish.h"
#include "reconstruct/video_frames.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/tracks/match_photos.h"
#include "scene/tracks/track_video.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kUnknownFocalFactor =
    1;  // only names a pixel's ray where nothing is known: any value gives the same projective frame
constexpr std::size_t kMaxMatchedWithAll = 100;  // photos; of more, each is matched with its best
constexpr int kPartners = 20;
constexpr double kMostExplained = 0.95;   // of the sights by homographies, to ...
constexpr double kLeastParallax = 0.001;  // ... this share of the width, rms: no structure
constexpr double kLeastPlaced = 0.9;  // of a shot's frames that are to have structure, else homographies serve them all
constexpr int kVideoTrackLength = 3;  // factorised frames that a track must be seen in
// A patch is followed as if it were flat and far. A wall passed close by bends within it, which is a bias: on a drive
// 320 pixels wide the true cameras themselves drift by 0.77 % of the path on tracks of 21 px, by 0.16 % on 15, by 0.04
// % on 11.
constexpr int kPatchesAcross = 30, kLeastPatchPx = 11;
// Frames between the keyframes are factorised too: the more of a track is seen the less its noise counts.
constexpr int kFramesBetween = 3, kFramesWanted = 96;

std::vector<std::string> Names(const Capture& capture) {
  std::vector<std::string> names;
  for (const InputPhoto& photo : capture.photos) names.push_back(photo.name);
  return names;
}

std::optional<std::pair<int, int>> OneSize(const Capture& capture) {
  std::set<std::pair<int, int>> sizes;
  for (const InputPhoto& photo : capture.photos) sizes.insert({photo.width_px, photo.height_px});
  if (sizes.size() != 1) return std::nullopt;
  return *sizes.begin();
}

// The tracks as only some of the frames see them.
Tracks Among(const Tracks& all, const std::set<std::string>& names, int min_length) {
  Tracks some;
  std::vector<int> renumbered(all.frames.size(), -1);
  for (std::size_t f = 0; f < all.frames.size(); ++f)
    if (names.count(all.frames[f].name) > 0) {
      renumbered[f] = static_cast<int>(some.frames.size());
      some.frames.push_back(all.frames[f]);
    }
  for (const Track& track : all.tracks) {
    Track kept;
    kept.color = track.color;
    for (const TrackObservation& o : track.observations)
      if (const int frame = renumbered[static_cast<std::size_t>(o.frame)]; frame >= 0)
        kept.observations.push_back({frame, o.x_px});
    if (static_cast<int>(kept.observations.size()) >= min_length) some.tracks.push_back(std::move(kept));
  }
  return some;
}

int PatchPx(int width_px, int most_px) {
  return std::clamp(2 * (width_px / (2 * kPatchesAcross)) + 1, kLeastPatchPx, most_px);
}

// The keyframes, and where they are few, frames evenly between them.
std::set<std::string> FramesToFactorise(const Capture& keyframes, const Capture& all) {
  std::set<std::string> names;
  const int n = keyframes.total();
  const int between = n < 2 ? 0 : std::clamp((kFramesWanted - n) / (n - 1), 0, kFramesBetween);
  std::size_t last = all.photos.size();
  for (std::size_t i = 0; i < all.photos.size(); ++i) {
    const bool key = std::ranges::binary_search(
        keyframes.photos, all.photos[i], [](const InputPhoto& a, const InputPhoto& b) { return a.name < b.name; });
    if (!key) continue;
    names.insert(all.photos[i].name);
    for (std::size_t k = 1; last < i && k <= static_cast<std::size_t>(between); ++k)
      names.insert(all.photos[last + (i - last) * k / static_cast<std::size_t>(between + 1)].name);
    last = i;
  }
  return names;
}

// The scene as only some of its photos see it.
Scene Among(const Scene& all, const std::set<std::string>& names) {
  Scene some = all;
  some.views.clear();
  some.points.clear();
  std::vector<int> renumbered(all.views.size(), -1);
  for (std::size_t v = 0; v < all.views.size(); ++v)
    if (names.count(all.views[v].name) > 0) {
      renumbered[v] = static_cast<int>(some.views.size());
      some.views.push_back(all.views[v]);
    }
  for (const Point& point : all.points) {
    Point kept = point;
    kept.track.clear();
    for (const Observation& o : point.track)
      if (const int view = renumbered[static_cast<std::size_t>(o.view.value)]; view >= 0)
        kept.track.push_back({ViewId{view}, o.x_px});
    if (kept.track.size() >= 2) some.points.push_back(std::move(kept));
  }
  UpdateFrameOfReference(some);
  return some;
}

FactorizationOptions FactorizationOptionsFor(const Capture& capture, const ReconstructOptions& options,
                                             const KnownIntrinsics& known) {
  FactorizationOptions factorization;
  factorization.windows.ordered = capture.is_video || options.matching == Matching::kSequential;
  if (options.window_frames > 0) {
    factorization.windows.length = options.window_frames;
    factorization.windows.overlap = std::clamp(options.window_frames / 2, 1, options.window_frames - 1);
  }
  factorization.adjust = options.adjust;
  factorization.projective_only = options.projective;
  factorization.seed = options.seed;
  if (options.refine == Refine::kFocal || (options.refine == Refine::kAuto && known.approximate))
    factorization.intrinsics = FreeIntrinsics::kFocal;
  else if (options.refine == Refine::kCentre)
    factorization.intrinsics = FreeIntrinsics::kFocalAndCentre;
  return factorization;
}

}  // namespace

KnownIntrinsics FindIntrinsics(const Capture& capture, const ReconstructOptions& options) {
  KnownIntrinsics known;
  const auto size = OneSize(capture);
  if (!size)
    throw DataError("the photos have different sizes: factorisation takes them for one camera's",
                    "leave out the photos of other sizes, or use --backend colmap");
  const auto [width, height] = *size;
  const double cx = width / 2.0, cy = height / 2.0;
  if (!options.camera_yaml.empty()) {
    known.camera = PlanCameras(capture, options).known;
    known.source = "camera.yaml";
  } else if (!options.intrinsics.empty()) {
    const auto& k = options.intrinsics;
    const double half = options.pixel_origin == PixelOrigin::kCentre ? 0.5 : 0.0;
    known.camera = Camera::Pinhole(width, height, k[0], k[1], k[2] + half, k[3] + half);
    known.source = "--intrinsics";
  } else if (options.focal_px) {
    known.camera = Camera::Pinhole(width, height, *options.focal_px, *options.focal_px, cx, cy);
    known.source = "--focal-px";
  } else {
    std::set<double> focals;
    for (const InputPhoto& photo : capture.photos) focals.insert(photo.focal_35mm.value_or(0));
    if (focals.size() == 1 && *focals.begin() > 0) {
      const double f = std::max(width, height) * *focals.begin() / kFilm35WidthMm;
      known.camera = Camera::Pinhole(width, height, f, f, cx, cy);
      known.approximate = true;
      known.source = "EXIF";
    }
  }
  return known;
}

FoundTracks FindTracks(const Capture& capture, const ReconstructOptions& options, const GivenCamera& given,
                       const fs::path& work_folder, ProgressSink& sink) {
  FoundTracks found{{}, capture, {}};
  const bool follow = capture.is_video || options.matching == Matching::kSequential;
  if (!follow) {
    MatchPhotosOptions match;
    match.seed = options.seed;
    if (options.features > 0) match.max_features = options.features;
    if (options.max_image_size_px > 0) match.max_size_px = options.max_image_size_px;
    if (options.matching == Matching::kSimilar ||
        (options.matching == Matching::kAuto && capture.photos.size() > kMaxMatchedWithAll))
      match.partners = options.partners > 0 ? options.partners : kPartners;
    found.tracks = MatchPhotos(PhotoSource(capture.folder, Names(capture), options.masks), match, sink);
    return found;
  }
  TrackVideoOptions track;
  if (options.features > 0) track.features = options.features;
  Capture all = capture;
  if (capture.is_video && !capture.every_frame) {
    Capture keyframes = capture;
    keyframes.folder = given.originals;
    all = ExtractAllFrames(options, keyframes, work_folder / "frames", sink);
    if (given.resampled) all = Resampled(all, *given.resampled, work_folder / "straight-frames", sink);
  } else if (!capture.is_video) {
    track.min_length = std::min(track.min_length, static_cast<int>(capture.photos.size()));
  }
  if (!all.photos.empty()) track.patch_px = PatchPx(all.photos.front().width_px, track.patch_px);
  TrackVideoSummary followed;
  Tracks& tracks = found.tracks;
  tracks = TrackVideo(PhotoSource(all.folder, Names(all), options.masks), track, sink, &followed);
  if (options.projective && (!capture.is_video || options.all_frames) && !followed.cuts.empty()) {
    // No track crosses a cut: what comes after it is another scene.
    const auto cut = static_cast<std::size_t>(followed.cuts.front());
    found.cut_frame = all.photos[cut].frame_index.value_or(followed.cuts.front());
    std::set<std::string> shot;
    for (std::size_t f = 0; f < cut; ++f) shot.insert(tracks.frames[f].name);
    tracks = Among(tracks, shot, 2);
    all.photos.resize(cut);
    sink.Message(fmt::format("a cut before {}: the scene ends there", capture.photos[cut].name));
  }
  if (!capture.is_video || options.all_frames) {
    found.used = all;
    return found;
  }
  const auto names = FramesToFactorise(capture, all);
  tracks = Among(tracks, names, std::min(kVideoTrackLength, static_cast<int>(names.size())));
  return found;
}

Scene ReconstructByFactorization(const Capture& capture, const ReconstructOptions& options, const GivenCamera& given,
                                 const fs::path& work_folder, ReconstructSummary& summary, ProgressSink& sink) {
  const KnownIntrinsics known = FindIntrinsics(capture, options);
  sink.Message(known.camera ? fmt::format("intrinsics by {}: f = {:.1f} px", known.source, known.camera->FocalPx().x())
                            : "no intrinsics are known (--camera, --focal-px or EXIF): the scene will be quasi-affine");
  if (options.require_metric && !known.camera)
    throw DataError("a metric scene needs known intrinsics",
                    "calibrate the camera (lumi-calibrate) and give --camera camera.yaml, or --focal-px F");

  FoundTracks found = FindTracks(capture, options, given, work_folder, sink);
  Tracks& tracks = found.tracks;
  const Capture& used = found.used;
  summary.cut_frame = found.cut_frame;
  summary.images_total = used.total();

  const FactorizationOptions factorization = FactorizationOptionsFor(capture, options, known);
  FactorizationResult result;
  const bool homographies =
      options.projective && factorization.windows.ordered && options.homographies != Homographies::kNever;
  bool relate = homographies && options.homographies == Homographies::kAlways;
  std::optional<FactorizationResult> turned;
  if (homographies && !relate) {
    // Structure whose parallax is no larger than the tracks' error is not used: frames that it cannot place would be
    // bent by it.
    turned = ReconstructByHomographies(tracks, {}, sink);
    const double seen =
        static_cast<double>(turned->sights) / std::max(1.0, static_cast<double>(turned->sights + turned->culled));
    if (seen > kMostExplained && turned->rms_px < kLeastParallax * tracks.frames.front().size_px.maxCoeff()) {
      sink.Message(
          fmt::format("homographies explain {:.0f} % of the sights to {:.2f} px: the frames are related by them",
                      100 * seen, turned->rms_px));
      relate = true;
    }
  }
  if (!relate) try {
      result = ReconstructFromTracks(tracks, known.camera, factorization, sink);
    } catch (const FactorizationRefused& refused) {
      if (!homographies) throw;
      sink.Message(fmt::format("{}: the frames are related by homographies", refused.what()));
      relate = true;
    }
  if (homographies && !relate) {
    const auto placed = static_cast<double>(std::ranges::count(result.placed, char{1}));
    if (result.upgrade == UpgradeKind::kNone || placed < kLeastPlaced * static_cast<double>(tracks.frames.size())) {
      sink.Message(
          fmt::format("{}: the frames are related by homographies",
                      result.upgrade == UpgradeKind::kNone
                          ? "the structure is on both sides of every plane at infinity"
                          : fmt::format("only {:.0f} of {} frames have structure", placed, tracks.frames.size())));
      relate = true;
    }
  }
  if (relate) {
    result = turned ? std::move(*turned) : ReconstructByHomographies(tracks, {}, sink);
    if (AddDirectionsWhereBlank(result, tracks) > 0)
      sink.Message("frames without features: they are taken to be a plain picture that does not move by itself");
    summary.structure = "homographies";
  } else if (homographies) {
    summary.homography_frames = PlaceByHomography(result, tracks, {});
  }

  summary.backend = Backend::kFactorization;
  summary.upgrade = std::string(Name(result.upgrade));
  summary.upgrade_reason = result.upgrade_reason;
  summary.warnings = result.warnings;
  if (options.require_metric && result.upgrade != UpgradeKind::kMetric)
    throw DataError("the scene is not metric: " + result.upgrade_reason,
                    "move the camera farther, check the intrinsics, or leave out --require metric");
  if (result.upgrade != UpgradeKind::kMetric && !options.projective)
    sink.Message(fmt::format("warning: the scene is {} only: {}", summary.upgrade, result.upgrade_reason));
  for (const std::string& warning : result.warnings) sink.Message("warning: " + warning);

  Scene scene = ToScene(result, tracks);
  const std::vector<std::string> asked_for = Names(used);
  const std::set<std::string> photos(asked_for.begin(), asked_for.end());
  if (tracks.frames.size() > photos.size()) scene = Among(scene, photos);
  // Tracks were followed in the photos as they are, through the lens as it was given.
  const auto [width, height] = *OneSize(used);
  const double f = kUnknownFocalFactor * std::max(width, height);
  if (!known.camera)
    scene.cameras = {Camera::Pinhole(width, height, f, f, width / 2.0, height / 2.0)};
  else if (scene.frame != Frame::kMetric)
    scene.cameras = {*known.camera};
  else if (!known.camera->IsPinhole())
    scene.cameras = {
        known.camera->WithPinhole(scene.cameras.front().FocalPx(), scene.cameras.front().PrincipalPointPx())};
  for (View& view : scene.views) view.camera = CameraId{0};
  scene.image_folder = used.folder;
  CopyPhotoFacts(used, scene);
  for (const MissingFrame& missing : result.missing)
    if (const std::string& name = tracks.frames[static_cast<std::size_t>(missing.frame)].name; photos.count(name) > 0)
      summary.missing.push_back({name, missing.reason, "photos that overlap more, or --backend colmap"});
  for (const MissingPhoto& photo : used.unreadable) summary.missing.push_back(photo);
  const double fraction = static_cast<double>(scene.views.size()) / std::max(1, used.total());
  if (fraction < options.min_registered)
    throw DataError(fmt::format("only {} of {} photos got a camera, {:.0f} % were asked for", scene.views.size(),
                                used.total(), 100 * options.min_registered));
  summary.components = {static_cast<int>(scene.views.size())};
  return scene;
}

Scene FinishProjectiveScene(Scene scene, const ReconstructOptions& options, ReconstructSummary& summary,
                            ProgressSink& sink) {
  // The photos lose their distortion as a metric scene's do; P then maps to the new pixels.
  const fs::path fresh = options.scene / "images.part";
  fs::remove_all(fresh);
  Scene bent = scene;
  bent.frame = Frame::kMetric;
  summary.camera_model = Name(bent.cameras.front().model);
  const Scene straight = UndistortPhotos(bent, fresh, sink);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const Camera &before = scene.CameraOf(scene.views[v]), &after = straight.CameraOf(straight.views[v]);
    const Camera lens = Camera::Pinhole(before.width_px, before.height_px, before.FocalPx().x(), before.FocalPx().y(),
                                        before.PrincipalPointPx().x(), before.PrincipalPointPx().y());
    scene.views[v].P = after.K() * lens.K().inverse() * scene.views[v].P;
    scene.views[v].size_px = {after.width_px, after.height_px};
    scene.views[v].camera = {};
  }
  double error_px = 0;
  long sights = 0;
  for (std::size_t p = 0; p < scene.points.size(); ++p) {
    Point& point = scene.points[p];
    point.track = straight.points[p].track;
    double sum = 0;
    for (const Observation& o : point.track) {
      const Eigen::Vector3d x = scene.views[static_cast<std::size_t>(o.view.value)].P * point.X_in_world;
      sum += (x.hnormalized() - o.x_px).norm();
    }
    error_px += sum;
    sights += static_cast<long>(point.track.size());
    point.error_px = point.track.empty() ? 0 : sum / static_cast<double>(point.track.size());
  }
  scene.cameras.clear();
  summary.mean_reprojection_error_px = sights > 0 ? error_px / static_cast<double>(sights) : 0;
  summary.points = static_cast<int>(scene.points.size());
  summary.images_registered = static_cast<int>(scene.views.size());
  UpdateFrameOfReference(scene);

  CheckInterrupted();
  fs::remove(options.scene / "lumigraph.json");
  ReplaceFolder(fresh, options.scene / "images");
  RemoveMasksOfEarlierRun(options.scene);
  scene.folder = options.scene;
  scene.image_folder = options.scene / "images";
  WriteScene(scene, options.scene);
  return scene;
}

}  // namespace lumi
