#include "reconstruct/options.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/files/provenance.h"

namespace lumi {

std::string Name(Backend backend) { return backend == Backend::kColmap ? "colmap" : "factorization"; }

std::string Name(Matching matching) {
  switch (matching) {
    case Matching::kAuto: break;
    case Matching::kExhaustive: return "exhaustive";
    case Matching::kSimilar: return "similar";
    case Matching::kSequential: return "sequential";
  }
  return "auto";
}

std::string Name(Mapper mapper) {
  switch (mapper) {
    case Mapper::kHierarchical: return "hierarchical";
    case Mapper::kQuick: break;
    case Mapper::kCareful: return "careful";
  }
  return "quick";
}

std::string Validate(const ReconstructOptions& o) {
  if (o.input.empty()) return "an input is needed: a folder of photos, or a video";
  if (o.scene.empty()) return "an output folder is needed: -o SCENE";
  if (o.component < 0) return "--component counts from 0";
  if (o.frame_step < 1) return "--frame-step is 1 or more";
  if (!(o.min_registered >= 0 && o.min_registered <= 1)) return "--min-registered is a fraction from 0 to 1";
  if (o.max_image_size_px < 0 || o.max_features < 0) return "--max-image-size and --max-features are positive";
  if (o.partners < 0) return "--partners is positive";
  if (o.partners > 0 && (o.matching == Matching::kExhaustive || o.matching == Matching::kSequential))
    return "--partners goes with --matching similar";
  if (o.mapper != Mapper::kQuick && (o.backend != Backend::kColmap || !o.poses.empty() || o.rig != Rig::kNone))
    return "--mapper goes with cameras that COLMAP estimates";
  if (o.keyframes < 0 || o.keyframes == 1) return "--keyframes needs two or more";
  if (!o.intrinsics.empty() && o.intrinsics.size() != 4)
    return "--intrinsics takes four numbers: fx,fy,cx,cy in pixels";
  for (std::size_t i = 0; i < o.intrinsics.size(); ++i)
    if (!(o.intrinsics[i] > 0)) return "--intrinsics: all four are positive";
  if (o.focal_px && !(*o.focal_px > 0)) return "--focal-px is positive";
  const int sources =
      (o.focal_px || o.search_focal ? 1 : 0) + (o.intrinsics.empty() ? 0 : 1) + (o.camera_yaml.empty() ? 0 : 1);
  if (sources > 1) return "give one of --camera, --intrinsics and --focal-px";
  if (!o.poses.empty() && o.rig != Rig::kNone)
    return "--poses and --rig exclude each other: known cameras need not be assumed";
  if (o.poses.empty() && o.poses_format != PosesFormat::kUnset) return "--poses-format goes with --poses FILE";
  if (o.search_focal && o.rig == Rig::kNone) return "--focal-px search goes with --rig";
  if (o.backend == Backend::kFactorization) {
    if (!o.poses.empty() || o.rig != Rig::kNone)
      return "--backend factorization finds the cameras itself: leave out --poses and --rig";
    if (!o.database.empty()) return "--database holds COLMAP's features: it goes with --backend colmap";
    if (o.component != 0) return "--component goes with --backend colmap";
    if (o.projective && o.require_metric)
      return "--projective stops before the metric frame that --require metric asks for";
    if (o.finder != FeatureFinder::kAuto) return "--features own and --features colmap go with --backend colmap";
    if (o.homographies != Homographies::kAuto && !o.projective) return "--homographies goes with --projective";
    if (o.features < 0 || (o.features > 0 && o.features < 50)) return "--features is 50 or more";
    if (o.window_frames < 0 || o.window_frames == 1 || o.window_frames == 2) return "--window is 3 frames or more";
  } else {
    if (o.projective || o.homographies != Homographies::kAuto)
      return "--projective and --homographies go with --backend factorization";
    if (o.features != 0 || o.window_frames != 0 || !o.adjust || o.refine != Refine::kAuto)
      return "--features N, --window, --refine and --no-adjust go with --backend factorization";
  }
  if (o.backend == Backend::kColmap && o.poses.empty() && o.rig == Rig::kNone && (o.focal_px || !o.intrinsics.empty()))
    return "--focal-px and --intrinsics go with --poses, --rig or --backend factorization; known intrinsics are given "
           "with --camera camera.yaml";
  if (!o.reference.empty() && !o.tradeoff) return "--reference goes with --tradeoff";
  if (o.tradeoff) {
    if (!o.poses.empty() || o.rig != Rig::kNone)
      return "--tradeoff measures cameras that are estimated: leave out --poses and --rig";
    if (!o.database.empty()) return "--tradeoff finds the features anew under each setting: leave out --database";
    if (!o.reference.empty() && o.projective)
      return "--reference is compared with metric cameras, which --projective stops before";
  }
  if (!(o.fps >= 0)) return "--fps is positive";
  if (o.period_s && !(*o.period_s > 0 && std::isfinite(*o.period_s))) return "--period-s is above 0";
  if (o.turntable && (o.poses.empty() || o.times.empty()))
    return "--turntable goes with --poses and --times: cameras in the turning object's frame, and when they saw it";
  if (!o.grid_size.empty() && !o.grid_positions.empty()) return "give one of --grid-size and --grid-positions";
  if (o.rig != Rig::kGrid && (!o.grid_size.empty() || !o.grid_positions.empty() || o.grid_plane))
    return "--grid-size, --grid-positions and --grid-plane go with --rig grid";
  if (o.grid_plane && !(*o.grid_plane >= 0)) return "--grid-plane is a distance";
  for (const auto& [length, name] : {std::pair(o.unit_m, "--unit-m"), std::pair(o.step_m, "--step-m")})
    if (length && !(*length > 0 && std::isfinite(*length))) return std::string(name) + " is metres, above 0";
  if (o.unit_m && o.poses.empty() && o.grid_positions.empty())
    return "--unit-m goes with --poses or --grid-positions: what their unit is";
  if (o.step_m && o.rig == Rig::kNone) return "--step-m goes with --rig: how far neighbouring cameras are apart";
  if (o.unit_m && o.step_m) return "give one of --unit-m and --step-m";
  if (o.clips && o.backend == Backend::kFactorization) return "--clips goes with --backend colmap";
  if (o.clips && (!o.poses.empty() || o.rig != Rig::kNone))
    return "--clips goes with cameras that COLMAP estimates, not with --poses or --rig";
  if (o.clips && (o.all_frames || !o.times.empty() || o.fps > 0))
    return "--clips makes photos of the videos' keyframes: --all-frames, --times and --fps do not go with it";
  if (o.all_frames && (!o.poses.empty() || o.rig != Rig::kNone))
    return "--all-frames goes with cameras that COLMAP estimates, not with --poses or --rig";
  return {};
}

std::map<std::string, std::string> OptionsAsText(const ReconstructOptions& o) {
  std::map<std::string, std::string> text;
  text["backend"] = Name(o.backend);
  text["projective"] = std::to_string(o.projective ? 1 : 0);
  text["homographies"] = std::to_string(static_cast<int>(o.homographies));
  text["fps"] = fmt::format("{}", o.fps);
  text["require_metric"] = std::to_string(o.require_metric ? 1 : 0);
  text["refine"] = std::to_string(static_cast<int>(o.refine));
  text["features"] = std::to_string(o.features);
  text["window_frames"] = std::to_string(o.window_frames);
  text["adjust"] = std::to_string(o.adjust ? 1 : 0);
  text["camera"] = o.camera_yaml.empty() ? "" : Fingerprint(o.camera_yaml);
  text["masks"] = o.masks.empty() ? "" : Fingerprint(o.masks);
  text["database"] = o.database.empty() ? "" : Fingerprint(o.database);
  text["component"] = std::to_string(o.component);
  if (o.finder != FeatureFinder::kAuto) text["finder"] = std::to_string(static_cast<int>(o.finder));
  text["matching"] = std::to_string(static_cast<int>(o.matching));
  if (o.partners > 0) text["partners"] = std::to_string(o.partners);
  if (o.mapper != Mapper::kQuick) text["mapper"] = std::to_string(static_cast<int>(o.mapper));
  text["quality"] = std::to_string(static_cast<int>(o.quality));
  text["max_image_size_px"] = std::to_string(o.max_image_size_px);
  text["max_features"] = std::to_string(o.max_features);
  text["single_camera"] = std::to_string(static_cast<int>(o.single_camera));
  text["min_registered"] = fmt::format("{}", o.min_registered);
  text["seed"] = std::to_string(o.seed);
  text["keyframes"] = std::to_string(o.keyframes);
  if (o.clips) text["clips"] = "1";
  text["all_frames"] = std::to_string(o.all_frames ? 1 : 0);
  text["poses"] = o.poses.empty() ? "" : Fingerprint(o.poses);
  text["poses_format"] = std::to_string(static_cast<int>(o.poses_format));
  text["pixel_origin"] = std::to_string(static_cast<int>(o.pixel_origin));
  text["focal_px"] = o.focal_px ? fmt::format("{}", *o.focal_px) : o.search_focal ? "search" : "";
  for (std::size_t i = 0; i < o.intrinsics.size(); ++i)
    text["intrinsics"] += fmt::format("{}{}", i ? "," : "", o.intrinsics[i]);
  text["rescale_cameras"] = std::to_string(o.rescale_cameras ? 1 : 0);
  text["times"] = o.times.empty() ? "" : Fingerprint(o.times);
  text["period_s"] = o.period_s ? fmt::format("{}", *o.period_s) : "";
  text["turntable"] = std::to_string(o.turntable ? 1 : 0);
  for (const int offset : o.offsets_frames) text["offsets_frames"] += fmt::format("{} ", offset);
  text["frame_step"] = std::to_string(o.frame_step);
  text["rig"] = std::to_string(static_cast<int>(o.rig));
  text["grid_size"] = o.grid_size;
  text["grid_positions"] = o.grid_positions.empty() ? "" : Fingerprint(o.grid_positions);
  if (o.unit_m) text["unit_m"] = fmt::format("{}", *o.unit_m);
  if (o.step_m) text["step_m"] = fmt::format("{}", *o.step_m);
  text["grid_plane"] = o.grid_plane ? fmt::format("{}", *o.grid_plane) : "";
  return text;
}

static Backend BackendNamed(const std::string& name) {
  return name == Name(Backend::kFactorization) ? Backend::kFactorization : Backend::kColmap;
}

static void ListKeys(JsonKeys& j, Backend& backend) {
  std::string name = Name(backend);
  j("backend", name);
  if (j.reading()) backend = BackendNamed(name);
}
static void ListKeys(JsonKeys& j, MissingPhoto& m) { j("name", m.name, "reason", m.reason, "hint", m.hint); }
static void ListKeys(JsonKeys& j, CameraStanding& s) {
  j("name", s.name, "points", s.points, "offered", s.offered, "spread", s.spread, "angle_deg", s.angle_deg);
  j("sigma_percent", s.sigma_percent);
  if (j.reading() ? j.Has("placed_anew") : s.placed_anew) j("placed_anew", s.placed_anew);
  j.IfAny("remark", s.remark);
}
static void ListKeys(JsonKeys& j, BackendComparison& c) {
  ListKeys(j, c.backend);
  j("views", c.views, "centre_rms_percent", c.centre_rms_percent, "rotation_rms_deg", c.rotation_rms_deg);
  j("mean_reprojection_error_px", c.mean_reprojection_error_px, "seconds", c.seconds);
}
void ListKeys(JsonKeys& j, ReconstructSummary& s) {
  j("images_total", s.images_total, "images_registered", s.images_registered, "missing", s.missing,
    "mean_reprojection_error_px", s.mean_reprojection_error_px);
  ListKeys(j, s.backend);
  j("upgrade", s.upgrade).IfAny("upgrade_reason", s.upgrade_reason);
  if (s.upgrade != "metric") j("structure", s.structure);
  if (j.reading() ? j.Has("homography_frames") : s.homography_frames > 0) j("homography_frames", s.homography_frames);
  j.IfAny("cut_frame", s.cut_frame)
      .IfAny("warnings", s.warnings)
      .IfAny("compared_with", s.comparison)
      .IfAny("standings", s.standings);
  j("points", s.points, "cameras", s.cameras, "camera_model", s.camera_model, "components", s.components, "component",
    s.component);
  if (j.reading() ? j.Has("keyframes") : s.keyframes > 0) j("keyframes", s.keyframes);
  j.IfAny("focal_px", s.focal_px);
  j.IfAny("steps", s.steps);
  j("reused", s.reused, "colmap_seconds", s.colmap_seconds, "seconds", s.seconds);
}

std::string Describe(const ReconstructSummary& s) {
  std::string lines =
      fmt::format("{} of {} photos, {} points, {:.2f} px mean reprojection error; {:.1f} s", s.images_registered,
                  s.images_total, s.points, s.mean_reprojection_error_px, s.seconds);
  if (s.backend == Backend::kColmap) lines += fmt::format(", of which COLMAP {:.1f} s", s.colmap_seconds);
  if (s.upgrade != "metric") lines += fmt::format("\n  {}: {}", s.upgrade, s.upgrade_reason);
  if (s.cut_frame) lines += fmt::format("\n  a cut: the scene ends before frame {}", *s.cut_frame);
  if (s.homography_frames > 0)
    lines += fmt::format("\n  {} frames are placed by a homography against their neighbour", s.homography_frames);
  for (const std::string& w : s.warnings) lines += "\n  warning: " + w;
  if (s.comparison) {
    const BackendComparison& c = *s.comparison;
    lines += fmt::format(
        "\n  against {} ({} photos, aligned): centres {:.3f} % rms, rotations {:.3f} degree rms; {:.2f} px and {:.1f} "
        "s there",
        Name(c.backend), c.views, c.centre_rms_percent, c.rotation_rms_deg, c.mean_reprojection_error_px, c.seconds);
  }
  for (const CameraStanding& c : s.standings)
    if (c.placed_anew || !c.remark.empty())
      lines += fmt::format("\n  camera {}{}{}{}", c.name, c.placed_anew ? ": placed anew" : "",
                           c.remark.empty() ? "" : ": ", c.remark);
  for (const MissingPhoto& m : s.missing)
    lines += fmt::format("\n  without camera: {}: {} -> {}", m.name, m.reason, m.hint);
  if (s.components.size() > 1)
    lines += fmt::format("\n  COLMAP split the scene into parts of {} photos; number {} was taken (--component picks)",
                         fmt::join(s.components, " "), s.component);
  return lines;
}

}  // namespace lumi
