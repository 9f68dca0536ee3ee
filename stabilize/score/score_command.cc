#include "stabilize/score/score_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "scene/files/atomic_file.h"
#include "scene/files/svg_file.h"
#include "scene/geometry/angle.h"
#include "scene/plot/plot.h"

namespace lumi::score {

static void ListKeys(JsonKeys& j, VideoScore& v) {
  const auto frame = v.distortion_frame < 0 ? std::nullopt : std::optional(v.distortion_frame);
  j("file", v.file, "cropping_ratio", v.cropping_ratio, "distortion", v.distortion, "stability", v.stability,
    "jitter_px", v.jitter.jitter_px);
  j("kept_area", v.kept_area, "distortion_mean", v.distortion_mean).Say("distortion_frame", frame);
  j("stability_x", v.stability_x, "stability_y", v.stability_y);
  j("stability_rotation", v.stability_rotation, "stability_detrended", v.stability_detrended, "jitter_all_px",
    v.jitter.all_px, "jitter_step_px", v.jitter.step_px);
  j("jitter_frames", v.jitter.frames, "width", v.width_px, "height", v.height_px, "fps", v.fps, "cuts", v.cuts,
    "failed_steps", v.failed_steps);
  j("failed_matches", v.failed_matches, "uneven_times", v.uneven_times);
}
// Explains a result with less stability than the input (the first video) and less jitter; empty: there is none.
static std::string StabilityRemark(const ScoreResult& result) {
  for (const VideoScore& v : result.videos) {
    const VideoScore& input = result.videos.front();
    if (!(v.stability && input.stability && v.jitter.jitter_px && input.jitter.jitter_px)) continue;
    if (*v.stability < *input.stability && *v.jitter.jitter_px < *input.jitter.jitter_px)
      return "Stability is the share that slow frequencies have in a path's motion: where hardly any motion is left, "
             "what is left counts more, and less shake may score less. Jitter is the shake itself.";
  }
  return {};
}

void ListKeys(JsonKeys& j, ScoreResult& r) {
  j("frames", r.frames, "videos", r.videos, "warnings", r.warnings, "seconds", r.seconds);
  if (const std::string remark = StabilityRemark(r); !remark.empty()) j.Say("remark", remark);
}

ScoreResult RunScore(const ScoreCommandOptions& options, ProgressSink& progress) {
  RequireSvgFile(options.plot);
  ScoreResult result = Score(options.score, progress);
  if (!options.plot.empty()) WriteTextAtomically(options.plot, ScorePlot(result));
  return result;
}

std::string Describe(const ScoreResult& result) {
  std::size_t width = 5;
  for (const VideoScore& v : result.videos) width = std::max(width, v.file.filename().string().size());
  std::string table = fmt::format("{:<{}}", "video", width);
  for (const char* title : {"cropping", "distortion", "stability", "jitter px", "kept area", "stab. x", "stab. y",
                            "stab. rot.", "detrended"})
    table += fmt::format("  {:>10}", title);
  for (const VideoScore& v : result.videos) {
    table += fmt::format("\n{:<{}}", v.file.filename().string(), width);
    for (const auto& x : {v.cropping_ratio, v.distortion, v.stability, v.jitter.jitter_px, v.kept_area, v.stability_x,
                          v.stability_y, v.stability_rotation, v.stability_detrended})
      table += fmt::format("  {:>10}", x && std::isfinite(*x) ? fmt::format("{:.3f}", *x) : "-");
  }
  if (const std::string remark = StabilityRemark(result); !remark.empty()) table += "\n" + remark;
  return table;
}

std::string ScorePlot(const ScoreResult& result) {
  constexpr const char* kColors[] = {"#888888", "#1f6fb4", "#d1495b", "#2e8b57", "#e08e0b", "#7b4ea3"};
  Plot x, y, rotation, spectrum, jitter;
  x.title = "Path: right";
  y.title = "Path: down";
  rotation.title = "Path: rotation";
  spectrum.title = "Spectrum of the path";
  spectrum.subtitle = "right and down; the score's slow part is the five lowest frequencies";
  jitter.title = "Jitter above 1 Hz";
  for (Plot* p : {&x, &y, &rotation, &jitter}) p->x.label = "time, s";
  x.y.label = y.y.label = "px";
  rotation.y.label = "degrees";
  spectrum.x = {"frequency, Hz", true, false};
  spectrum.y = {"amplitude, px", true, false};
  jitter.y = {"px", false, true};
  for (std::size_t i = 0; i < result.videos.size(); ++i) {
    const VideoScore& v = result.videos[i];
    const auto series = [&] {
      PlotSeries s;
      s.name = v.file.filename().string();
      s.color = kColors[i % std::size(kColors)];
      s.marker = Marker::kNone;
      s.line = true;
      return s;
    };
    const auto plot_path = [&](Plot& plot, const std::vector<double>& values, double unit) {
      PlotSeries s = series();
      for (std::size_t k = 0; k < values.size(); ++k)
        s.points.push_back({static_cast<double>(k) * v.path.interval_s, unit * values[k], {}, {}});
      plot.series.push_back(std::move(s));
    };
    plot_path(x, v.path.x_px, 1);
    plot_path(y, v.path.y_px, 1);
    plot_path(rotation, v.path.rotation_rad, kDegPerRad);
    plot_path(jitter, v.jitter.of_frame_px, 1);
    const std::vector<double> across = PathEnergies(v.path.x_px), down = PathEnergies(v.path.y_px);
    const double n = static_cast<double>(v.path.x_px.size());
    PlotSeries s = series();
    for (std::size_t k = 0; k < across.size(); ++k)
      s.points.push_back(
          {static_cast<double>(k + 1) / (n * v.path.interval_s), 2 / n * std::sqrt(across[k] + down[k]), {}, {}});
    spectrum.series.push_back(std::move(s));
  }
  const VideoScore& input = result.videos[0];
  if (input.path.interval_s > 0 && !input.path.x_px.empty())
    spectrum.marks.push_back(
        {5.5 / (static_cast<double>(input.path.x_px.size()) * input.path.interval_s), "slow | fast"});
  spectrum.marks.push_back({1, "1 Hz"});
  return SvgOf({x, y, rotation, spectrum, jitter});
}

}  // namespace lumi::score
