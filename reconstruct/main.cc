#include <fmt/format.h>

#include <charconv>

#include "reconstruct/export_scene.h"
#include "reconstruct/measure_scene.h"
#include "reconstruct/reconstruct.h"
#include "reconstruct/tradeoff.h"
#include "scene/program/main_program.h"

namespace lumi {
namespace {

// --focal-px takes a number or "search".
void SetFocal(ReconstructOptions& options, const std::string& text) {
  if (text == "search") {
    options.search_focal = true;
    return;
  }
  try {
    std::size_t used = 0;
    options.focal_px = std::stod(text, &used);
    if (used != text.size()) throw std::invalid_argument(text);
  } catch (const std::exception&) {
    throw UsageError("takes a number of pixels or 'search'");
  }
}

// --features takes a number (factorization) or a name (colmap).
void SetFeatures(ReconstructOptions& options, const std::string& text) {
  options.finder = text == "own"      ? FeatureFinder::kOwn
                   : text == "colmap" ? FeatureFinder::kColmap
                                      : FeatureFinder::kAuto;
  if (text == "auto" || options.finder != FeatureFinder::kAuto) return;
  try {
    std::size_t used = 0;
    options.features = std::stoi(text, &used);
    if (used != text.size()) throw std::invalid_argument(text);
  } catch (const std::exception&) {
    throw UsageError("takes auto, own, colmap, or a number of features");
  }
}

MeasureOptions MeasureRequest(const ReconstructOptions& o, const std::vector<std::string>& measured) {
  if (o.inputs.size() != 1 || !o.scene.empty())
    throw UsageError("--measure wants one scene and no output", "lumi-reconstruct SCENE --measure A B 1.20");
  MeasureOptions request{o.input, measured[0], measured[1], 0};
  const char* end = measured[2].data() + measured[2].size();
  if (const auto [last, error] = std::from_chars(measured[2].data(), end, request.metres);
      error != std::errc() || last != end)
    throw UsageError(fmt::format("--measure: \"{}\" is no number of metres", measured[2]));
  return request;
}

// What is estimated, and how.
void AddEstimation(Options& app, ReconstructOptions& o) {
  app.Add("INPUT", o.inputs,
          "Folder of photos (searched recursively), a video, a folder of videos that fixed cameras took at once, a "
          "transforms.json, or a folder with one or a COLMAP model beside its photos. Several videos: hand-held clips "
          "of one place, as --clips");
  app.Add("-o,--output", o.scene, "Scene folder to write");
  app.Add(
      "--backend", o.backend,
      "Who places the cameras: colmap, or factorization of feature tracks (without COLMAP; one camera took all photos)",
      {{"colmap", Backend::kColmap}, {"factorization", Backend::kFactorization}});
  app.Flag("--projective", o.projective,
           "factorization: stop at the quasi-affine frame, even where the intrinsics are known");
  app.Add("--homographies", o.homographies,
          "--projective: frames without structure (a camera that only turns, a plane, a tripod) are related by "
          "homographies. auto: where the factorisation refuses them; always; never",
          {{"auto", Homographies::kAuto}, {"always", Homographies::kAlways}, {"never", Homographies::kNever}});
  app.Add("--fps", o.fps, "Folder of photos frame_000000.jpg ...: they are a video's, so many a second, > 0");
  app.Call(
         "--require", [&](const std::string&) { o.require_metric = true; },
         "metric: fail (exit code 1) where the data allow no more than a quasi-affine scene")
      .OneOf({"metric"});
  app.Add("--refine", o.refine,
          "factorization: intrinsics that the last adjustment may move: none, focal, or centre (and focal). auto: "
          "focal where EXIF gave it, else none",
          {{"auto", Refine::kAuto}, {"none", Refine::kNone}, {"focal", Refine::kFocal}, {"centre", Refine::kCentre}});
  app.Call(
      "--features", [&](const std::string& text) { SetFeatures(o, text); },
      "colmap: who finds and matches features: own (lumi-reconstruct) or colmap; auto: own, and colmap where a "
      "--database of yours lacks photos. factorization: a number, "
      "of tracks aimed at in a frame of a video (0: 800), or of features a photo (0: 2048)");
  app.Add("--window", o.window_frames, "factorization: frames that are factorised at once; 0: 20").Default();
  app.Flag("!--no-adjust", o.adjust, "factorization: without bundle adjustment");
  app.Add("--camera", o.camera_yaml, "camera.yaml (OpenCV/ROS): known intrinsics, held fixed");
  app.Add("--masks", o.masks, "Folder of masks NAME.png (COLMAP's naming: photo.jpg.png), black = ignore");
  app.Add("--database", o.database,
          "COLMAP database whose features and matches are reused (copied). Default: database.db beside the folder of "
          "photos");
  app.Add("--component", o.component, "Which part of a split scene to take, by size from 0").Default();
  app.Add(
      "--matching", o.matching,
      "Which photos are matched with which: exhaustive (each with each), similar (those that look alike) or sequential "
      "(neighbours in the order of names). auto: exhaustive up to 100 photos or 60 keyframes, beyond that similar",
      {{"auto", Matching::kAuto},
       {"exhaustive", Matching::kExhaustive},
       {"similar", Matching::kSimilar},
       {"sequential", Matching::kSequential}});
  app.Add("--partners", o.partners,
          "similar: each photo is matched first with so many that look most like it; 0: 40, keyframes of a video 10, "
          "with "
          "factorization 20")
      .Default();
  app.Add(
      "--mapper", o.mapper,
      "colmap: quick (its incremental mapper, adjustments between photos end early; the default), careful (by its own "
      "bounds) or hierarchical (parts of about 100 photos placed by themselves, then joined)",
      {{"quick", Mapper::kQuick}, {"careful", Mapper::kCareful}, {"hierarchical", Mapper::kHierarchical}});
  app.Add("--quality", o.quality,
          "auto, low (1200 px, 2048 features), medium (2000 px, 4096) or high (3200 px, 8192). auto: by the number of "
          "photos",
          {{"auto", Quality::kAuto}, {"low", Quality::kLow}, {"medium", Quality::kMedium}, {"high", Quality::kHigh}});
  app.Add("--max-image-size", o.max_image_size_px,
          "Features are searched in photos shrunk to this, px; 0 = by --quality")
      .Default();
  app.Add("--max-features", o.max_features, "Features a photo; 0 = by --quality").Default();
  app.Add("--single-camera", o.single_camera,
          "auto, yes or no: whether all photos share one camera. auto: same size and EXIF focal length",
          {{"auto", SingleCamera::kAuto}, {"yes", SingleCamera::kYes}, {"no", SingleCamera::kNo}});
  app.Add("--min-registered", o.min_registered, "Fail unless this fraction of the photos gets a camera, 0..1")
      .Default();
  app.Add("--keyframes", o.keyframes, "Video: how many keyframes; 0 = by parallax").Default();
  app.Flag("--clips", o.clips,
           "INPUT is a folder of hand-held videos of one place, not taken at once: their keyframes become one capture");
  app.Flag("--all-frames", o.all_frames, "Video: also every other frame gets a camera, against the fixed keyframes");
}

// What is known or assumed of cameras and times.
void AddKnown(Options& app, ReconstructOptions& o) {
  app.Add("--poses", o.poses,
          "Known cameras: COLMAP model, transforms.json, Middlebury *_par.txt, or 12 numbers a line (with or without a "
          "name). none: those beside the photos are not used");
  app.Add("--poses-format", o.poses_format, "What 12 numbers mean: projection, cam_from_world or world_from_cam",
          {{"projection", PosesFormat::kProjection},
           {"cam_from_world", PosesFormat::kCamFromWorld},
           {"world_from_cam", PosesFormat::kWorldFromCam}});
  app.Add("--pixel-origin", o.pixel_origin,
          "Where (0, 0) lies in the upper-left pixel, for --poses and --intrinsics: corner or centre",
          {{"corner", PixelOrigin::kCorner}, {"centre", PixelOrigin::kCentre}});
  app.Call(
      "--focal-px", [&](const std::string& text) { SetFocal(o, text); },
      "Focal length in px, or 'search' (--rig); principal point in the middle");
  app.Add("--intrinsics", o.intrinsics, "fx,fy,cx,cy in px, for --poses and --rig").Commas().Values(4);
  app.Flag("--rescale-cameras", o.rescale_cameras,
           "Known cameras of another size than the photos: scale them instead of refusing");
  app.Add("--offsets-frames", o.offsets_frames,
          "Several videos of one scene: when each starts, in frames, in the order of their names; default: found")
      .Commas();
  app.Add("--frame-step", o.frame_step, "Several videos of one scene: every so many frames become views, >= 1")
      .Default();
  app.Add("--times", o.times,
          "CSV of the photos' times, its first line naming the columns: image; time_s, or phase_deg or phase (and "
          "period: whole turns before); frame. "
          "Photos that it does not name are left out");
  app.Add("--period-s", o.period_s,
          "The scene repeats itself after so many seconds; default: 1 where --times has phases, else it does not");
  app.Flag("--turntable", o.turntable,
           "--poses are in the frame of an object that turns once a period: the scene gets the room's, in which the "
           "object turns");
  app.Add("--unit-m", o.unit_m, "--poses, --grid-positions: how many metres their unit is; the scene gets that scale");
  app.Add("--step-m", o.step_m, "--rig: how many metres neighbouring cameras are apart; the scene gets that scale");
  app.Add("--rig", o.rig, "Assumed cameras: ring (a turntable, evenly spaced in the order of names) or grid",
          {{"ring", Rig::kRing}, {"grid", Rig::kGrid}});
  app.Add("--grid-size", o.grid_size,
          "ROWSxCOLUMNS, photos row by row in the order of names; default: positions from names such as "
          "out_ROW_COLUMN_VERTICAL_HORIZONTAL.jpg");
  app.Add("--grid-positions", o.grid_positions, "CSV: file,row,column,vertical,horizontal (any unit)");
  app.Add("--grid-plane", o.grid_plane,
          "Distance of the plane on which all photos coincide, in the positions' unit; 0: parallel, unshifted cameras; "
          "default: by the matches");
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  using namespace lumi;
  Program program("lumi-reconstruct",
                  "Photos or a video -> a scene folder: cameras, sparse points, undistorted photos");
  ReconstructOptions o;
  Options& app = program.options();
  AddEstimation(app, o);
  AddKnown(app, o);
  app.Flag("--tradeoff", o.tradeoff,
           "Also accuracy against seconds over the backend's dials (factorization: features, window, adjustment; "
           "colmap: image size, features, pairs, mapper, who finds the features): "
           "table, SCENE/tradeoff/BACKEND.json, .csv and .svg. Takes ten to twenty times as long");
  app.Add("--reference", o.reference,
          "--tradeoff: scene, COLMAP model or truth/ of a simulated capture to compare with. Default: truth/ beside "
          "the photos, else the dearest setting's cameras");
  std::vector<std::string> measured;
  app.Add("--measure", measured,
          "INPUT is a scene, which gets a scale: two places and the metres between them, A B 1.20. A place is a photo "
          "(its camera), a pixel of one (a.jpg:412,233: what it shows, by the proxy), the same thing in several "
          "(a.jpg:412,233+b.jpg:98,240), or x,y,z of the world")
      .Values(3);
  ExportOptions exported;
  Options command =
      program.Command("export", "A scene as transforms.json (nerfstudio, instant-ngp) or COLMAP workspace", [&] {
        Answer answer = ExportScene(exported, program.progress());
        FinishExport(exported);
        return answer;
      });
  command.Add("scene", exported.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  command.Add("-o,--output", exported.output, "FILE.json, or the folder of a workspace").Required();
  app.Common({"--output", "--backend", "--quality", "--matching", "--single-camera", "--camera", "--masks",
              "--min-registered", "--keyframes", "--all-frames", "--poses", "--poses-format", "--focal-px", "--rig",
              "--tradeoff"});
  app.Examples(
      "lumi-reconstruct photos -o scene                          cameras by COLMAP\n"
      "lumi-reconstruct walk.mp4 -o scene                        keyframes of a video\n"
      "lumi-reconstruct photos -o scene --camera camera.yaml     with the intrinsics that lumi-calibrate found\n"
      "lumi-reconstruct photos -o scene --poses transforms.json  with cameras that you have\n"
      "lumi-reconstruct export scene -o transforms.json          for other tools");
  program.RunAndExit(argc, argv, [&]() -> Answer {
    o.seed = program.seed();
    o.threads = program.threads();
    if (!o.inputs.empty()) o.input = o.inputs.front();
    if (!measured.empty()) return MeasureScene(MeasureRequest(o, measured), program.progress());
    if (!o.tradeoff) return Reconstruct(o, program.progress());
    return ReconstructWithTradeoff(o, program.progress());
  });
}
