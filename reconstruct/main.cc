#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "reconstruct/reconstruct.h"
#include "reconstruct/tradeoff.h"
#include "scene/program/main_program.h"

namespace {

// --focal-px takes a number or "search".
void SetFocal(lumi::ReconstructOptions& options, const std::string& text) {
  if (text == "search") {
    options.search_focal = true;
    return;
  }
  try {
    std::size_t used = 0;
    options.focal_px = std::stod(text, &used);
    if (used != text.size()) throw std::invalid_argument(text);
  } catch (const std::exception&) {
    throw CLI::ValidationError("--focal-px", "takes a number of pixels or 'search'");
  }
}

std::string ForPeople(const std::string& text) {
  const auto j = nlohmann::json::parse(text);
  std::string lines = fmt::format("{} of {} photos, {} points, {:.2f} px mean reprojection error; {:.1f} s", j["images_registered"].get<int>(),
                                  j["images_total"].get<int>(), j["points"].get<int>(), j["mean_reprojection_error_px"].get<double>(), j["seconds"].get<double>());
  if (j["backend"] == "colmap") lines += fmt::format(", of which COLMAP {:.1f} s", j["colmap_seconds"].get<double>());
  if (j["upgrade"] != "metric") lines += fmt::format("\n  {}: {}", j["upgrade"].get<std::string>(), j["upgrade_reason"].get<std::string>());
  if (j.contains("cut_frame")) lines += fmt::format("\n  a cut: the scene ends before frame {}", j["cut_frame"].get<int>());
  if (const int n = j.value("homography_frames", 0); n > 0) lines += fmt::format("\n  {} frames are placed by a homography against their neighbour", n);
  if (j.contains("warnings"))
    for (const auto& w : j["warnings"]) lines += "\n  warning: " + w.get<std::string>();
  if (j.contains("compared_with")) {
    const auto& c = j["compared_with"];
    lines += fmt::format("\n  against {} ({} photos, aligned): centres {:.3f} % rms, rotations {:.3f} degree rms; {:.2f} px and {:.1f} s there",
                         c["backend"].get<std::string>(), c["views"].get<int>(), c["centre_rms_percent"].get<double>(), c["rotation_rms_deg"].get<double>(),
                         c["mean_reprojection_error_px"].get<double>(), c["seconds"].get<double>());
  }
  for (const auto& m : j["missing"])
    lines += fmt::format("\n  without camera: {}: {} -> {}", m["name"].get<std::string>(), m["reason"].get<std::string>(), m["hint"].get<std::string>());
  if (j["components"].size() > 1) {
    lines += fmt::format("\n  COLMAP split the scene into parts of");
    for (const auto& n : j["components"]) lines += fmt::format(" {}", n.get<int>());
    lines += fmt::format(" photos; number {} was taken (--component picks)", j["component"].get<int>());
  }
  return lines;
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-reconstruct", "Photos or a video -> a scene folder: cameras, sparse points, undistorted photos");
  lumi::ReconstructOptions o;
  CLI::App& app = program.app();
  app.add_option("INPUT", o.input, "Folder of photos (searched recursively), a video, or a folder of videos that fixed cameras took at once")->required();
  app.add_option("-o,--output", o.scene, "Scene folder to write")->required();
  app.add_option("--backend", o.backend, "Who places the cameras: colmap, or factorization of feature tracks (without COLMAP; one camera took all photos)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Backend>{{"colmap", lumi::Backend::kColmap}, {"factorization", lumi::Backend::kFactorization}}));
  app.add_flag("--projective", o.projective, "factorization: stop at the quasi-affine frame, even where the intrinsics are known");
  app.add_option("--homographies", o.homographies, "--projective: frames without structure (a camera that only turns, a plane, a tripod) are related by homographies. auto: where the factorisation refuses them; always; never")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Homographies>{{"auto", lumi::Homographies::kAuto}, {"always", lumi::Homographies::kAlways}, {"never", lumi::Homographies::kNever}}));
  app.add_option("--fps", o.fps, "Folder of photos frame_000000.jpg ...: they are a video's, so many a second, > 0");
  app.add_option_function<std::string>("--require", [&](const std::string&) { o.require_metric = true; }, "metric: fail (exit code 1) where the data allow no more than a quasi-affine scene")
      ->check(CLI::IsMember({"metric"}));
  app.add_option("--refine", o.refine, "factorization: intrinsics that the last adjustment may move: none, focal, or centre (and focal). auto: focal where EXIF gave it, else none")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Refine>{{"auto", lumi::Refine::kAuto}, {"none", lumi::Refine::kNone}, {"focal", lumi::Refine::kFocal}, {"centre", lumi::Refine::kCentre}}));
  app.add_option("--features", o.features, "factorization: tracks aimed at in a frame of a video (0: 800), or features a photo (0: 2048)")->capture_default_str();
  app.add_option("--window", o.window_frames, "factorization: frames that are factorised at once; 0: 20")->capture_default_str();
  app.add_flag("!--no-adjust", o.adjust, "factorization: without bundle adjustment");
  app.add_option("--camera", o.camera_yaml, "camera.yaml (OpenCV/ROS): known intrinsics, held fixed");
  app.add_option("--masks", o.masks, "Folder of masks NAME.png (COLMAP's naming: photo.jpg.png), black = ignore");
  app.add_option("--database", o.database, "COLMAP database whose features and matches are reused (copied). Default: database.db beside the folder of photos");
  app.add_option("--component", o.component, "Which part of a split scene to take, by size from 0")->capture_default_str();
  app.add_option("--matching", o.matching, "auto, exhaustive or sequential. auto: exhaustive up to 200 photos or 60 keyframes (factorization: 100 photos)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Matching>{{"auto", lumi::Matching::kAuto}, {"exhaustive", lumi::Matching::kExhaustive}, {"sequential", lumi::Matching::kSequential}}));
  app.add_option("--quality", o.quality, "auto, low (1200 px, 2048 features), medium (2000 px, 4096) or high (3200 px, 8192). auto: by the number of photos")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Quality>{{"auto", lumi::Quality::kAuto}, {"low", lumi::Quality::kLow}, {"medium", lumi::Quality::kMedium}, {"high", lumi::Quality::kHigh}}));
  app.add_option("--max-image-size", o.max_image_size_px, "Features are searched in photos shrunk to this, px; 0 = by --quality")->capture_default_str();
  app.add_option("--max-features", o.max_features, "Features a photo; 0 = by --quality")->capture_default_str();
  app.add_option("--single-camera", o.single_camera, "auto, yes or no: whether all photos share one camera. auto: same size and EXIF focal length")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::SingleCamera>{{"auto", lumi::SingleCamera::kAuto}, {"yes", lumi::SingleCamera::kYes}, {"no", lumi::SingleCamera::kNo}}));
  app.add_option("--min-registered", o.min_registered, "Fail unless this fraction of the photos gets a camera, 0..1")->capture_default_str();
  app.add_option("--keyframes", o.keyframes, "Video: how many keyframes; 0 = by parallax")->capture_default_str();
  app.add_flag("--all-frames", o.all_frames, "Video: also every other frame gets a camera, against the fixed keyframes");
  app.add_option("--poses", o.poses, "Known cameras: COLMAP model, transforms.json, Middlebury *_par.txt, or 12 numbers a line (with or without a name)");
  app.add_option("--poses-format", o.poses_format, "What 12 numbers mean: projection, cam_from_world or world_from_cam")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::PosesFormat>{{"projection", lumi::PosesFormat::kProjection}, {"cam_from_world", lumi::PosesFormat::kCamFromWorld}, {"world_from_cam", lumi::PosesFormat::kWorldFromCam}}));
  app.add_option("--pixel-origin", o.pixel_origin, "Where (0, 0) lies in the upper-left pixel, for --poses and --intrinsics: corner or centre")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::PixelOrigin>{{"corner", lumi::PixelOrigin::kCorner}, {"centre", lumi::PixelOrigin::kCentre}}));
  app.add_option_function<std::string>("--focal-px", [&](const std::string& text) { SetFocal(o, text); }, "Focal length in px, or 'search' (--rig); principal point in the middle");
  app.add_option("--intrinsics", o.intrinsics, "fx,fy,cx,cy in px, for --poses and --rig")->delimiter(',')->expected(4);
  app.add_flag("--rescale-cameras", o.rescale_cameras, "Known cameras of another size than the photos: scale them instead of refusing");
  app.add_option("--offsets-frames", o.offsets_frames, "Several videos of one scene: when each starts, in frames, in the order of their names; default: found")->delimiter(',');
  app.add_option("--frame-step", o.frame_step, "Several videos of one scene: every so many frames become views, >= 1")->capture_default_str();
  app.add_option("--times", o.times, "CSV of the photos' times, its first line naming the columns: image; time_s, or phase_deg or phase (and period: whole turns before); frame. "
                                     "Photos that it does not name are left out");
  app.add_option("--period-s", o.period_s, "The scene repeats itself after so many seconds; default: 1 where --times has phases, else it does not");
  app.add_flag("--turntable", o.turntable, "--poses are in the frame of an object that turns once a period: the scene gets the room's, in which the object turns");
  app.add_option("--rig", o.rig, "Assumed cameras: ring (a turntable, evenly spaced in the order of names) or grid")
      ->transform(CLI::CheckedTransformer(std::map<std::string, lumi::Rig>{{"ring", lumi::Rig::kRing}, {"grid", lumi::Rig::kGrid}}));
  app.add_option("--grid-size", o.grid_size, "ROWSxCOLUMNS, photos row by row in the order of names; default: positions from names such as out_ROW_COLUMN_VERTICAL_HORIZONTAL.jpg");
  app.add_option("--grid-positions", o.grid_positions, "CSV: file,row,column,vertical,horizontal (any unit)");
  app.add_option("--grid-plane", o.grid_plane, "Distance of the plane on which all photos coincide, in the positions' unit; 0: parallel, unshifted cameras; default: by the matches");
  app.add_flag("--tradeoff", o.tradeoff, "Also accuracy against seconds over the backend's dials (factorization: features, window, adjustment; colmap: image size, features): "
                                         "table, SCENE/tradeoff/BACKEND.json, .csv and .svg. Takes about ten times as long");
  app.add_option("--reference", o.reference, "--tradeoff: scene, COLMAP model or truth/ of a simulated capture to compare with. Default: truth/ beside the photos, else the dearest setting's cameras");
  std::string table;  // of --tradeoff, for people
  return program.Run(
      argc, argv,
      [&] {
        o.seed = program.seed();
        o.threads = program.threads();
        if (!o.tradeoff) return lumi::ToJson(lumi::Reconstruct(o, program.progress()));
        const lumi::MeasuredReconstruction measured = lumi::ReconstructWithTradeoff(o, program.progress());
        table = "\n\n" + lumi::Describe(measured.tradeoff);
        return lumi::ToJson(measured);
      },
      [&](const std::string& json) { return ForPeople(json) + table; });
}
