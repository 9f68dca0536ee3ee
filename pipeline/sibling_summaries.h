// What this program reads of the others' summaries: stage.summary.As<sibling::CamerasSummary>(). Keys that it does not
// read are in report.json all the same.
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"

namespace lumi::sibling {

// lumi-reconstruct, and an import.
struct MissingPhoto {
  std::string name, reason, hint;
};
inline void ListKeys(JsonKeys& j, MissingPhoto& m) { j("name", m.name, "reason", m.reason).IfAny("hint", m.hint); }
struct ComparedBackend {
  std::string backend;
  int views = 0;
  double centre_rms_percent = 0, rotation_rms_deg = 0, mean_reprojection_error_px = 0, seconds = 0;
};
inline void ListKeys(JsonKeys& j, ComparedBackend& c) {
  j("backend", c.backend, "views", c.views, "centre_rms_percent", c.centre_rms_percent, "rotation_rms_deg",
    c.rotation_rms_deg);
  j("mean_reprojection_error_px", c.mean_reprojection_error_px, "seconds", c.seconds);
}
struct StandingCamera {
  std::string name;
  int points = 0, offered = 0;
  double spread = 0, angle_deg = 0;
  std::optional<double> sigma_percent;
  bool placed_anew = false;
  std::string remark;
};
inline void ListKeys(JsonKeys& j, StandingCamera& s) {
  j("name", s.name, "points", s.points, "offered", s.offered, "spread", s.spread, "angle_deg", s.angle_deg);
  j("sigma_percent", s.sigma_percent);
  if (j.reading() ? j.Has("placed_anew") : s.placed_anew) j("placed_anew", s.placed_anew);
  j.IfAny("remark", s.remark);
}
struct CamerasSummary {
  int images_total = 0, images_registered = 0;
  double mean_reprojection_error_px = 0, colmap_seconds = 0, seconds = 0;
  std::string backend, structure = "points";
  std::optional<int> cut_frame;
  std::vector<MissingPhoto> missing;
  std::vector<StandingCamera> standings;
  std::vector<int> components;
  std::optional<ComparedBackend> compared_with;
};
inline void ListKeys(JsonKeys& j, CamerasSummary& s) {
  j("images_total", s.images_total, "images_registered", s.images_registered, "missing", s.missing, "components",
    s.components);
  j("mean_reprojection_error_px", s.mean_reprojection_error_px, "colmap_seconds", s.colmap_seconds, "seconds",
    s.seconds);
  j("backend", s.backend, "structure", s.structure)
      .IfAny("cut_frame", s.cut_frame)
      .IfAny("compared_with", s.compared_with)
      .IfAny("standings", s.standings);
}

// lumi-timeperiodic calibrate.
struct SamplingGap {
  std::string what_to_film;
};
inline void ListKeys(JsonKeys& j, SamplingGap& g) { j("what_to_film", g.what_to_film); }
struct SpaceTimeSampling {
  double samples_per_window = 0, window_least = 0, window_most = 0, uniformity = 0, covered = 0;
  std::vector<SamplingGap> gaps;
};
inline void ListKeys(JsonKeys& j, SpaceTimeSampling& s) {
  j("samples_per_window", s.samples_per_window, "window_least", s.window_least, "window_most", s.window_most);
  j("uniformity", s.uniformity, "covered", s.covered, "gaps", s.gaps);
}
struct FoundMasks {
  std::optional<double> moving_share;
};
inline void ListKeys(JsonKeys& j, FoundMasks& m) { j("moving_share", m.moving_share); }
struct TimedSummary {
  double period_frames = 0, period_sigma_frames = 0, period_s = 0, samples_per_window = 0;
  std::string period_from;
  FoundMasks masks;
  std::optional<SpaceTimeSampling> sampling;
  std::optional<CamerasSummary> reconstruct;
  std::vector<std::string> warnings;
};
inline void ListKeys(JsonKeys& j, TimedSummary& s) {
  j("period_frames", s.period_frames, "period_sigma_frames", s.period_sigma_frames, "period_s", s.period_s,
    "period_from", s.period_from);
  j("samples_per_window", s.samples_per_window, "masks", s.masks, "sampling", s.sampling, "reconstruct", s.reconstruct,
    "warnings", s.warnings);
}

struct CalibratedSummary {
  std::optional<double> fx;
  double sigma_fx = 0, cross_validated_rms_px = 0;
  int views_used = 0;
};
inline void ListKeys(JsonKeys& j, CalibratedSummary& s) {
  j("fx", s.fx, "sigma_fx", s.sigma_fx, "cross_validated_rms_px", s.cross_validated_rms_px, "views_used", s.views_used);
}

// lumi-proxy.
struct MadeProxySummary {
  std::string name;
  std::optional<int> faces;
};
inline void ListKeys(JsonKeys& j, MadeProxySummary& s) { j("name", s.name, "faces", s.faces); }

// lumi-proxy --shard.
struct PartSummary {
  std::filesystem::path folder;  // of the maps; empty: none are called for
  bool finished = false;
};
inline void ListKeys(JsonKeys& j, PartSummary& s) { j("folder", s.folder, "finished", s.finished); }

// lumi-export web.
struct WebPageSummary {
  double mb = 0;
  int photos = 0;
};
inline void ListKeys(JsonKeys& j, WebPageSummary& s) { j("mb", s.mb, "photos", s.photos); }

// lumi-render --holdout.
struct HeldOutView {
  std::string name, file;
  double psnr_db = 0, ssim = 0, coverage = 0;
  std::optional<double> psnr_seen_db, seen;
  std::optional<double> nearest_photo_psnr_db, nearest_photo_psnr_seen_db, nearest_photo_coverage;
};
inline void ListKeys(JsonKeys& j, HeldOutView& v) {
  j("name", v.name, "file", v.file, "psnr_db", v.psnr_db, "psnr_seen_db", v.psnr_seen_db, "seen", v.seen);
  j("ssim", v.ssim, "coverage", v.coverage, "nearest_photo_psnr_db", v.nearest_photo_psnr_db);
  j("nearest_photo_psnr_seen_db", v.nearest_photo_psnr_seen_db, "nearest_photo_coverage", v.nearest_photo_coverage);
}
struct HoldoutSummary {
  std::string proxy, proxy_evaluated;  // the latter: rendered over, and the same where none was made without the photos
  std::optional<double> psnr_mean_db, psnr_seen_mean_db, seen;
  std::optional<double> nearest_photo_psnr_mean_db, nearest_photo_psnr_seen_mean_db, nearest_photo_coverage_mean;
  double ssim_mean = 0, coverage = 0, psnr_object_mean_db = 0, nearest_photo_psnr_object_mean_db = 0;
  std::vector<HeldOutView> views;
};
inline void ListKeys(JsonKeys& j, HoldoutSummary& s) {
  j("proxy", s.proxy, "proxy_evaluated", s.proxy_evaluated);
  j("psnr_mean_db", s.psnr_mean_db, "psnr_seen_mean_db", s.psnr_seen_mean_db, "seen", s.seen);
  j("ssim_mean", s.ssim_mean, "coverage", s.coverage, "nearest_photo_psnr_mean_db", s.nearest_photo_psnr_mean_db);
  j("nearest_photo_psnr_seen_mean_db", s.nearest_photo_psnr_seen_mean_db, "nearest_photo_coverage_mean",
    s.nearest_photo_coverage_mean);
  j("psnr_object_mean_db", s.psnr_object_mean_db, "nearest_photo_psnr_object_mean_db",
    s.nearest_photo_psnr_object_mean_db, "views", s.views);
}

// lumi-render along a path.
struct FaithfulSettings {
  std::string name, why;
  std::optional<double> db;  // from a weight at every pixel; no value: that is what was taken
  double ms = 0, pixel_ms = 0;
};
inline void ListKeys(JsonKeys& j, FaithfulSettings& f) {
  j("name", f.name, "why", f.why, "db", f.db, "ms", f.ms, "pixel_ms", f.pixel_ms);
}
struct FramesSummary {
  int frames_reused = 0;
  double ms_per_frame = std::numeric_limits<double>::quiet_NaN();
  std::optional<FaithfulSettings> fidelity;
};
inline void ListKeys(JsonKeys& j, FramesSummary& s) {
  j("frames_reused", s.frames_reused, "ms_per_frame", s.ms_per_frame).IfAny("fidelity", s.fidelity);
}

// lumi-stabilize.
struct PathSummary {
  std::string model;
  double view_scale = 1, shake_before_px = 0, shake_after_px = 0, seconds = std::numeric_limits<double>::quiet_NaN();
  int followed_frames = 0;
  std::vector<std::string> shown;  // the first and the last frame
};
inline void ListKeys(JsonKeys& j, PathSummary& s) {
  j("model", s.model, "view_scale", s.view_scale, "shake_before_px", s.shake_before_px, "shake_after_px",
    s.shake_after_px, "seconds", s.seconds);
  j("followed_frames", s.followed_frames, "shown", s.shown);
}
// lumi-stabilize score. No value: the film has no such figure.
struct ScoredVideo {
  std::string file;
  std::optional<double> cropping_ratio, distortion, stability, jitter_px, kept_area;
};
inline void ListKeys(JsonKeys& j, ScoredVideo& v) {
  j("file", v.file, "cropping_ratio", v.cropping_ratio, "distortion", v.distortion, "stability", v.stability,
    "jitter_px", v.jitter_px, "kept_area", v.kept_area);
}
struct ScoreSummary {
  std::vector<ScoredVideo> videos;
  std::string remark;  // on a figure that surprises; empty: none does
};
inline void ListKeys(JsonKeys& j, ScoreSummary& s) { j("videos", s.videos).IfAny("remark", s.remark); }

}  // namespace lumi::sibling
