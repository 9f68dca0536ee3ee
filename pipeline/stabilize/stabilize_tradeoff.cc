#include "pipeline/stabilize/stabilize_tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "pipeline/sibling_stage.h"
#include "pipeline/sibling_summaries.h"
#include "pipeline/stabilize/film_output.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"
#include "scene/plot/plot.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

struct Dial {
  std::string name;
  std::vector<std::string> values;
  const char* option;                    // of lumi-render, or of lumi-stabilize where `of_path`
  bool of_path = false;
};

// NaN where there is none: a film of a few frames has no stability. JSON writes it as null.
double OrNan(const std::optional<double>& x) { return x.value_or(std::numeric_limits<double>::quiet_NaN()); }

std::string Cell(double x, int digits) { return std::isnan(x) ? "-" : fmt::format("{:.{}f}", x, digits); }

}  // namespace

StabilizeTradeoff MeasureStabilizeTradeoff(const fs::path& window, const fs::path& folder, const StabilizeVideoOptions& options, double fps, ProgressSink& progress) {
  using nlohmann::json;
  std::vector<fs::path> frames;
  const MatrixPath made = ReadMatrixPath(window / "path.json");
  for (const MatrixKey& key : made.keys) frames.push_back(window / "frames" / key.view);
  StabilizeTradeoff result;
  result.frames = static_cast<int>(frames.size());
  const fs::path filmed = folder / "tradeoff-filmed.mp4", steady = folder / "tradeoff-steady.mp4", path = folder / "tradeoff-path.json";
  WriteFilm(filmed, result.frames, fps, [&](int i) { return ReadImage8(frames[static_cast<std::size_t>(i)]); }, {}, "writing the window as filmed", progress);

  const std::string width = std::to_string(std::max(16, 2 * (made.width_px / 4)));
  const std::vector<Dial> dials{{"as chosen", {""}, "", false},
                                {"frames to either side", {"0", "2", "10"}, "--window-frames", false},
                                {"k", {"1", "2", "8"}, "--k", false},
                                {"rounds of the path", {"0", "3"}, "--iterations", true},
                                {"render width", {width}, "--width", false}};
  const std::vector<std::string> common{"--threads", std::to_string(options.threads), "--seed", std::to_string(options.seed)};
  int count = 0, number = 0;
  for (const Dial& dial : dials) count += static_cast<int>(dial.values.size());
  for (const Dial& dial : dials)
    for (const std::string& value : dial.values) {
      ++number;
      const std::string name = dial.values.front().empty() ? dial.name : dial.name + " " + value;
      std::vector<std::string> arguments{(window / "scene").string(), "-o", path.string(), "--model", options.model, "--border", options.border};
      arguments.insert(arguments.end(), options.path_arguments.begin(), options.path_arguments.end());
      if (dial.of_path) arguments.insert(arguments.end(), {dial.option, value});
      arguments.insert(arguments.end(), common.begin(), common.end());
      const StageResult solved = RunSiblingStage({"tradeoff: " + name, "lumi-stabilize", arguments, number, count}, progress);
      arguments = {(window / "scene").string(), "-o", steady.string(), "--path", path.string(), "--proxy", "per-view"};
      if (options.border == "fill") arguments.insert(arguments.end(), {"--border", "fill"});
      arguments.insert(arguments.end(), options.render_arguments.begin(), options.render_arguments.end());
      if (!dial.of_path && *dial.option != '\0') arguments.insert(arguments.end(), {dial.option, value});
      arguments.insert(arguments.end(), common.begin(), common.end());
      const StageResult drawn = RunSiblingStage({"tradeoff: " + name, "lumi-render", arguments, number, count}, progress);
      arguments = {"score", filmed.string(), steady.string()};
      arguments.insert(arguments.end(), common.begin(), common.end());
      const auto scores = RunSiblingStage({"tradeoff: " + name, "lumi-stabilize", arguments, number, count}, progress).summary.As<sibling::ScoreSummary>();
      const sibling::ScoredVideo& score = scores.videos.back();
      StabilizeTradeoffPoint point;
      point.dial = dial.name;
      point.value = value;
      point.path_seconds = solved.summary.As<sibling::PathSummary>().seconds;
      point.render_seconds = drawn.seconds;
      point.ms_per_frame = drawn.summary.As<sibling::FramesSummary>().ms_per_frame;
      point.kept_scale = OrNan(score.cropping_ratio);
      point.stability = OrNan(score.stability);
      point.distortion = OrNan(score.distortion);
      point.jitter_px = OrNan(score.jitter_px);
      result.points.push_back(point);
    }
  std::error_code ec;
  for (const fs::path& file : {filmed, steady, path}) fs::remove(file, ec);

  nlohmann::ordered_json j;
  j["frames"] = result.frames;
  j["points"] = json::array();
  Plot plot{"What the dials cost and give", fmt::format("{} frames, one dial at a time", result.frames), {"ms a frame", true}, {"jitter above 1 Hz, px", false, true}, {}, {}};
  const char* colors[] = {"#d1242f", "#1f6feb", "#8250df", "#1a7f37", "#9a6700"};
  for (const StabilizeTradeoffPoint& p : result.points) {
    j["points"].push_back({{"dial", p.dial}, {"value", p.value}, {"path_seconds", p.path_seconds}, {"render_seconds", p.render_seconds}, {"ms_per_frame", p.ms_per_frame},
                           {"cropping_ratio", p.kept_scale}, {"stability", p.stability}, {"distortion", p.distortion}, {"jitter_px", p.jitter_px}});
    if (plot.series.empty() || plot.series.back().name != p.dial)
      plot.series.push_back({p.dial, colors[plot.series.size() % std::size(colors)], Marker::kCircle, false, false, false, {}});
    if (std::isnan(p.jitter_px) || std::isnan(p.ms_per_frame)) continue;
    plot.series.back().points.push_back({p.ms_per_frame, p.jitter_px, p.value, fmt::format("{} {}: {:.1f} ms, stability {}, jitter {:.2f} px", p.dial, p.value, p.ms_per_frame, Cell(p.stability, 3), p.jitter_px)});
  }
  result.json = folder / "tradeoff.json";
  result.plot = folder / "tradeoff.svg";
  WriteTextAtomically(result.json, j.dump(1) + "\n");
  WriteTextAtomically(result.plot, SvgOf({plot}));
  return result;
}

std::string TableOf(const StabilizeTradeoff& tradeoff) {
  std::string text = fmt::format("{:<24}{:>6} {:>9} {:>10} {:>9} {:>10} {:>11} {:>10}\n", "dial", "value", "path, s", "ms/frame", "cropping", "stability", "distortion", "jitter px");
  for (const StabilizeTradeoffPoint& p : tradeoff.points)
    text += fmt::format("{:<24}{:>6} {:>9} {:>10} {:>9} {:>10} {:>11} {:>10}\n", p.dial, p.value, Cell(p.path_seconds, 2), Cell(p.ms_per_frame, 1), Cell(p.kept_scale, 3), Cell(p.stability, 3),
                        Cell(p.distortion, 3), Cell(p.jitter_px, 2));
  return text;
}

}  // namespace lumi
