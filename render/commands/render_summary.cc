#include "render/commands/render_summary.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "render/picture/output_name.h"
#include "render/settings_json.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

void Put(Json& j, const char* key, const std::optional<double>& value) {
  if (value) j[key] = *value;
}

void Put(Json& j, const PathFigures& p, const RenderSummary& s) {
  j = {{"frames", s.frames},     {"frames_reused", p.reused}, {"ms_per_frame", OrNull(s.ms_per_frame)},
       {"width", p.size_px.x()}, {"height", p.size_px.y()},   {"coverage", OrNull(s.coverage)}};
  if (p.filled) {
    j["coverage_window"] = OrNull(p.coverage_window);
    j["coverage_wider"] = OrNull(p.coverage_wider);
  }
  if (!p.video.empty()) j["video"] = p.video;
}

void Put(Json& j, const ViewFigures& v, const RenderSummary& s) {
  Json figures = {{"name", v.name}, {"coverage", *s.coverage}};
  Put(figures, "time_s", v.time_s);
  Put(figures, "psnr_db", v.psnr_db);
  Put(figures, "ssim", v.ssim);
  Put(figures, "mean_absolute_difference", v.mean_absolute_difference);
  Put(figures, "mean_absolute_difference_seen", v.mean_absolute_difference_seen);
  j = {{"frames", s.frames},
       {"ms_per_frame", *s.ms_per_frame},
       {"coverage", *s.coverage},
       {"views", Json::array({figures})}};
}

void Put(Json& j, const HoldoutFigures& h, const RenderSummary& s) {
  Json views = Json::array();
  for (const HoldoutView& v : h.errors.views) {
    views.push_back({{"name", v.name},
                     {"psnr_db", v.psnr_db},
                     {"ssim", v.ssim},
                     {"coverage", v.coverage},
                     {"nearest_photo", v.nearest_name},
                     {"nearest_photo_psnr_db", v.nearest_psnr_db},
                     {"nearest_photo_ssim", v.nearest_ssim},
                     {"nearest_photo_coverage", v.nearest_coverage},
                     {"ms", v.ms},
                     {"file", OutputName(v.name)}});
    Put(views.back(), "psnr_object_db", v.psnr_object_db);
    Put(views.back(), "nearest_photo_psnr_object_db", v.nearest_psnr_object_db);
  }
  const HoldoutSummary& e = h.errors;
  j = {{"frames", s.frames},
       {"ms_per_frame", *s.ms_per_frame},
       {"coverage", *s.coverage},
       {"holdout", h.n},
       {"fold", h.fold},
       {"psnr_mean_db", e.psnr_mean_db},
       {"ssim_mean", e.ssim_mean},
       {"nearest_photo_psnr_mean_db", e.nearest_psnr_mean_db},
       {"nearest_photo_ssim_mean", e.nearest_ssim_mean},
       {"nearest_photo_coverage_mean", e.nearest_coverage_mean},
       {"views", views}};
  Put(j, "psnr_object_mean_db", e.psnr_object_mean_db);
  Put(j, "nearest_photo_psnr_object_mean_db", e.nearest_psnr_object_mean_db);
}

Json ToJson(const OptimumCounts& o) {
  return {
      {"samples", o.samples},       {"cameras_mean", static_cast<double>(o.cameras) / static_cast<double>(o.samples)},
      {"dense", o.dense},           {"nugget_raised", o.nugget_raised},
      {"indefinite", o.indefinite}, {"small_sums", o.small_sums}};
}

std::string DescribeHoldout(const HoldoutSummary& s) {
  const auto line = [](const std::string& name, double psnr_db, double ssim, double coverage, double nearest_db) {
    return fmt::format("{:<28} {:>9.2f} {:>7.4f} {:>8.1f}% {:>10.2f} dB\n", name, psnr_db, ssim, 100 * coverage,
                       nearest_db);
  };
  std::string text = fmt::format("{:<28} {:>9} {:>7} {:>9} {:>13}\n", "held-out photo", "PSNR dB", "SSIM", "coverage",
                                 "nearest photo");
  for (const HoldoutView& v : s.views) text += line(v.name, v.psnr_db, v.ssim, v.coverage, v.nearest_psnr_db);
  text += line("mean", s.psnr_mean_db, s.ssim_mean, s.coverage_mean, s.nearest_psnr_mean_db);
  if (s.psnr_object_mean_db)
    text += fmt::format("{:<28} {:>9.2f} {:>7} {:>9} {:>10.2f} dB\n", "mean over the object", *s.psnr_object_mean_db,
                        "", "", s.nearest_psnr_object_mean_db.value_or(0));
  return text;
}

}  // namespace

Json ToJson(const RenderSummary& s) {
  Json j;
  if (s.path) Put(j, *s.path, s);
  if (s.view) Put(j, *s.view, s);
  if (s.holdout) Put(j, *s.holdout, s);
  j["proxy"] = s.proxy;
  if (!s.frame.empty()) j["frame"] = s.frame;
  if (s.window_frames >= 0) j["window_frames"] = s.window_frames;
  j["device"] = s.device;
  j["settings"] = ToJson(s.settings);
  if (s.own_times) j["settings"].erase("time-s");
  j["settings"]["backend"] = s.backend;
  if (s.budget) {
    j["budget"] = {{"budget_ms", s.budget_ms}};
    j["budget"].update(ToJson(*s.budget));
  }
  if (s.scale)
    j["scale"] = {
        {"measure", s.scale->measure}, {"low", s.scale->low}, {"high", s.scale->high}, {"unit", s.scale->unit}};
  j["effects"] = Json::array();
  for (const Effect& e : s.effects)
    j["effects"].push_back({{"name", e.name}, {"on", e.on}, {"evidence", Reason(e)}, {"cost_ms", e.cost_ms}});
  if (s.samples > 0) j["samples"] = s.samples;
  if (s.optimum.samples > 0) j["optimum"] = ToJson(s.optimum);
  return j;
}

std::string JsonText(const RenderSummary& summary, int indent) { return ToJson(summary).dump(indent); }

std::string SettingsText(const RadianceSettings& settings) { return ToJson(settings).dump(); }

std::string Describe(const RenderSummary& s) {
  std::string text;
  if (s.holdout) text += DescribeHoldout(s.holdout->errors);
  if (s.view) {
    text += s.view->name + ": ";
    if (s.view->psnr_db) text += fmt::format("PSNR {:.2f} dB, SSIM {:.4f}, ", *s.view->psnr_db, *s.view->ssim);
    text += fmt::format("coverage {:.1f}%\n", 100 * *s.coverage);
  }
  if (s.budget)
    text += fmt::format("{:g} ms a frame: {}, {:.1f} ms expected{}; {}\n", s.budget_ms, s.budget->name,
                        s.budget->expected_ms, s.budget->fits ? "" : " (the fastest there is)", s.budget->why);
  for (const Effect& e : s.effects)
    text += fmt::format("{:<11} {:<4} {}{}\n", e.name, e.on ? "on" : "off", Reason(e),
                        e.on ? fmt::format(" ({:.1f} ms)", e.cost_ms) : "");
  const std::string each = s.ms_per_frame ? fmt::format("{:.1f} ms each", *s.ms_per_frame) : "all there already";
  return text + fmt::format("{} frames, {}, proxy {}, {}", s.frames, each, s.proxy, s.device);
}

}  // namespace lumi
