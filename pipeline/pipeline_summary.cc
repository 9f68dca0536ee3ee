// What lumi-pipeline says at its end: --json's keys, and a text for people.
#include <fmt/format.h>

#include "pipeline/pipeline.h"
#include "pipeline/report/report.h"
#include "pipeline/sibling_summaries.h"
#include "scene/program/with_error.h"

namespace lumi {
namespace fs = std::filesystem;

static void ListKeys(JsonKeys& j, StageResult& s) {
  j("name", s.name, "seconds", s.seconds, "reused", s.reused, "computed_seconds", s.computed_seconds);
  if (s.name != "report") j("summary", s.summary);
  if (!s.command.empty()) j("command", s.command);
}

static void ListKeys(JsonKeys& j, KeptMinutes& m) {
  j("asked", m.asked, "took", m.took, "quality", m.quality, "expected_camera_minutes", m.expected_camera_minutes);
  j("left_out", m.left_out, "met", m.met);
}

void ListKeys(JsonKeys& j, PipelineSummary& s) {
  const auto written = [](const fs::path& file) { return file.empty() ? std::nullopt : std::optional(file); };
  j("scene", s.scene, "report", s.report, "stages", s.stages)
      .Say("video", written(s.video))
      .Say("web", written(s.web))
      .Say("contact_sheet", written(s.contact_sheet));
  j("colmap_seconds", s.colmap_seconds, "around_colmap_seconds", s.around_colmap_seconds);
  j.Say("around_colmap_percent",
        s.colmap_seconds > 0 ? std::optional(100 * s.around_colmap_seconds / s.colmap_seconds) : std::nullopt);
  j("seconds", s.seconds).IfAny("minutes", s.minutes);
}

// The mean of fewer photos is no figure to go by.
static constexpr std::size_t kFewHeldOut = 3;

// A line for people below a stage's own, where its summary has something for them.
static std::string LineOf(const StageResult& stage) {
  constexpr const char* kIndent = "             ";
  if (stage.name == "holdout") {
    const auto s = stage.summary.As<sibling::HoldoutSummary>();
    std::string text = fmt::format("{}PSNR {:.2f} dB, SSIM {:.3f}, coverage {:.1f} % (nearest photo {:.2f} dB", kIndent,
                                   s.psnr_mean_db.value_or(0), s.ssim_mean, 100 * s.coverage,
                                   s.nearest_photo_psnr_mean_db.value_or(0));
    if (s.nearest_photo_coverage_mean) text += fmt::format(", coverage {:.1f} %", 100 * *s.nearest_photo_coverage_mean);
    text += ")\n";
    if (s.psnr_seen_mean_db)
      text += fmt::format(
          "{}over the {:.1f} % of the pixels that two other photos see {:.2f} dB (nearest photo {:.2f} dB)\n", kIndent,
          100 * s.seen.value_or(0), *s.psnr_seen_mean_db, s.nearest_photo_psnr_seen_mean_db.value_or(0));
    if (s.psnr_object_mean_db > 0)
      text += fmt::format("{}over the object's pixels {:.2f} dB (nearest photo {:.2f} dB)\n", kIndent,
                          s.psnr_object_mean_db, s.nearest_photo_psnr_object_mean_db);
    if (!s.views.empty() && s.views.size() < kFewHeldOut)
      text += fmt::format("{}that is {} photo{} only: --holdout each leaves every photo out in turn\n", kIndent,
                          s.views.size(), s.views.size() == 1 ? "" : "s");
    return text;
  }
  if (stage.name == "calibrate") {
    const auto s = stage.summary.As<sibling::CalibratedSummary>();
    return fmt::format("{}focal length {:.2f} +- {:.2f} px, {} views, cross-validated error {:.3f} px\n", kIndent,
                       s.fx.value_or(0), s.sigma_fx, s.views_used, s.cross_validated_rms_px);
  }
  if (stage.name == "timeperiodic") {
    const auto s = stage.summary.As<sibling::TimedSummary>();
    return fmt::format("{}period {} frames, {:.1f} samples a window\n", kIndent,
                       WithError(s.period_frames, s.period_sigma_frames), s.samples_per_window);
  }
  if (stage.name == "web") {
    const auto s = stage.summary.As<sibling::WebPageSummary>();
    return fmt::format("{}{:.1f} MB, {} photos\n", kIndent, s.mb, s.photos);
  }
  if (stage.name == "video")
    if (const std::string how = DescribeFrames(stage.summary.As<sibling::FramesSummary>()); !how.empty())
      return kIndent + how + "\n";
  if (stage.name == "simplify")
    return fmt::format("{}{} faces\n", kIndent, stage.summary.As<sibling::MadeProxySummary>().faces.value_or(0));
  if (stage.name == "reconstruct") {
    const auto s = stage.summary.As<sibling::CamerasSummary>();
    return fmt::format("{}{} of {} photos have a camera, reprojection error {:.2f} px\n", kIndent, s.images_registered,
                       s.images_total, s.mean_reprojection_error_px);
  }
  return {};
}

std::string DescribeCommands(const PipelineSummary& summary) {
  std::string text;
  for (const StageResult& s : summary.stages)
    text += s.command.empty() ? fmt::format("# {}: lumi-pipeline itself\n", s.name) : s.command + "\n";
  return text.substr(0, text.size() - 1);
}

std::string Describe(const PipelineSummary& summary) {
  std::string text;
  for (const StageResult& s : summary.stages)
    text +=
        fmt::format("{:<12} {:8.1f} s{}\n", s.name, s.seconds, s.reused ? "  (nothing had changed)" : "") + LineOf(s);
  if (summary.colmap_seconds > 0)
    text += fmt::format("COLMAP took {:.1f} s, everything around it (preparation, proxy, report) {:.1f} s.\n",
                        summary.colmap_seconds, summary.around_colmap_seconds);
  if (summary.minutes)
    text += fmt::format("minutes: {:.1f} of {:g}, quality {}{}\n", summary.minutes->took, summary.minutes->asked,
                        summary.minutes->quality, summary.minutes->met ? "" : ": not kept");
  text += "scene:   " + summary.scene.string() + "\nreport:  " + summary.report.string() + "\n";
  if (!summary.video.empty()) text += "video:   " + summary.video.string() + "\n";
  if (!summary.web.empty()) text += "page:    " + summary.web.string() + "\n";
  if (!summary.contact_sheet.empty()) text += "sheet:   " + summary.contact_sheet.string() + "\n";
  return text + "walk:    lumi-view " + summary.scene.string();
}

}  // namespace lumi
