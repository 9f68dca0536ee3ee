#include "stabilize/score/score_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/geometry/angle.h"
#include "scene/plot/plot.h"

namespace lumi::score {
namespace {

using Json = nlohmann::ordered_json;

Json Maybe(const std::optional<double>& value) { return value && std::isfinite(*value) ? Json(*value) : Json(nullptr); }

Json VideoJson(const VideoScore& v) {
  Json j;
  j["file"] = v.file.string();
  j["cropping_ratio"] = Maybe(v.cropping_ratio);
  j["distortion"] = Maybe(v.distortion);
  j["stability"] = Maybe(v.stability);
  j["jitter_px"] = Maybe(v.jitter.jitter_px);
  j["kept_area"] = Maybe(v.kept_area);
  j["distortion_mean"] = Maybe(v.distortion_mean);
  j["distortion_frame"] = v.distortion_frame < 0 ? Json(nullptr) : Json(v.distortion_frame);
  j["stability_x"] = Maybe(v.stability_x);
  j["stability_y"] = Maybe(v.stability_y);
  j["stability_rotation"] = Maybe(v.stability_rotation);
  j["stability_detrended"] = Maybe(v.stability_detrended);
  j["jitter_all_px"] = Maybe(v.jitter.all_px);
  j["jitter_step_px"] = Maybe(v.jitter.step_px);
  j["jitter_frames"] = v.jitter.frames;
  j["width"] = v.width_px;
  j["height"] = v.height_px;
  j["fps"] = v.fps;
  j["cuts"] = v.cuts;
  j["failed_steps"] = v.failed_steps;
  j["failed_matches"] = v.failed_matches;
  j["uneven_times"] = v.uneven_times;
  return j;
}

std::string Cell(const Json& value) { return value.is_null() ? "-" : fmt::format("{:.3f}", value.get<double>()); }

}  // namespace

std::string ScoreJson(const ScoreResult& result) {
  Json j;
  j["frames"] = result.frames;
  j["videos"] = Json::array();
  for (const VideoScore& v : result.videos) j["videos"].push_back(VideoJson(v));
  j["warnings"] = result.warnings;
  j["seconds"] = result.seconds;
  return j.dump();
}

std::string RunScore(const ScoreCommandOptions& options, ProgressSink& progress) {
  const ScoreResult result = Score(options.score, progress);
  if (!options.plot.empty()) WriteTextAtomically(options.plot, ScorePlot(result));
  return ScoreJson(result);
}

std::string DescribeScore(const std::string& text) {
  const auto j = Json::parse(text);
  constexpr const char* kKeys[] = {"cropping_ratio", "distortion", "stability", "jitter_px", "kept_area", "stability_x", "stability_y", "stability_rotation", "stability_detrended"};
  constexpr const char* kTitles[] = {"cropping", "distortion", "stability", "jitter px", "kept area", "stab. x", "stab. y", "stab. rot.", "detrended"};
  std::size_t width = 5;
  for (const Json& v : j["videos"]) width = std::max(width, std::filesystem::path(v["file"].get<std::string>()).filename().string().size());
  std::string table = fmt::format("{:<{}}", "video", width);
  for (const char* title : kTitles) table += fmt::format("  {:>10}", title);
  for (const Json& v : j["videos"]) {
    table += fmt::format("\n{:<{}}", std::filesystem::path(v["file"].get<std::string>()).filename().string(), width);
    for (const char* key : kKeys) table += fmt::format("  {:>10}", Cell(v[key]));
  }
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
      for (std::size_t k = 0; k < values.size(); ++k) s.points.push_back({static_cast<double>(k) * v.path.interval_s, unit * values[k], {}, {}});
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
      s.points.push_back({static_cast<double>(k + 1) / (n * v.path.interval_s), 2 / n * std::sqrt(across[k] + down[k]), {}, {}});
    spectrum.series.push_back(std::move(s));
  }
  const VideoScore& input = result.videos[0];
  if (input.path.interval_s > 0 && !input.path.x_px.empty())
    spectrum.marks.push_back({5.5 / (static_cast<double>(input.path.x_px.size()) * input.path.interval_s), "slow | fast"});
  spectrum.marks.push_back({1, "1 Hz"});
  return SvgOf({x, y, rotation, spectrum, jitter});
}

}  // namespace lumi::score
