#include "pipeline/stabilize/stabilize_tradeoff.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/sibling_stage.h"
#include "pipeline/sibling_summaries.h"
#include "pipeline/stabilize/film_output.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

struct Dial {
  std::string name;
  std::vector<std::string> values;
  const char* option;  // of lumi-render, or of lumi-stabilize where `of_path`
  bool of_path = false;
};

std::vector<TradeoffColumn> Columns() {
  using enum TradeoffRole;
  return {{"dial", kSetting, "dial", -23},
          {"value", kSetting, "value", 6},
          {"path_seconds", kCost, "path, s", 9, "{:.2f}"},
          {"render_seconds", kCost},
          {"ms_per_frame", kCost, "ms/frame", 10, "{:.1f}"},
          {"cropping_ratio", kMoreIsBetter, "cropping", 9, "{:.3f}"},
          {"kept_area", kMoreIsBetter, "kept area", 10, "{:.3f}"},
          {"stability", kMoreIsBetter, "stability", 10, "{:.3f}"},
          {"distortion", kMoreIsBetter, "distortion", 11, "{:.3f}"},
          {"jitter_px", kLessIsBetter, "jitter px", 10, "{:.2f}"}};
}

}  // namespace

StabilizeTradeoff MeasureStabilizeTradeoff(const fs::path& window, const fs::path& folder,
                                           const StabilizeVideoOptions& options, double fps, ProgressSink& progress) {
  std::vector<fs::path> frames;
  const MatrixPath made = ReadMatrixPath(window / "path.json");
  const std::string& model = made.model.empty() ? options.model : made.model;  // the first shot may lack the object
  std::vector<double> time_s;
  for (const MatrixKey& key : made.keys) {
    frames.push_back(window / "frames" / key.view);
    time_s.push_back(key.time_s);
  }
  const int length = static_cast<int>(frames.size());
  StabilizeTradeoff result{{.columns = Columns()}, {}};
  TradeoffTable& table = result.table;
  const fs::path filmed = folder / "tradeoff-filmed.mp4", steady = folder / "tradeoff-steady.mp4",
                 path = folder / "tradeoff-path.json";
  WriteFilm(filmed, {fps, time_s, [&](int i) { return ReadImage8(frames[static_cast<std::size_t>(i)]); }},
            "writing the window as filmed", progress);

  const std::string width = std::to_string(std::max(16, 2 * (made.width_px / 4)));
  const std::vector<Dial> dials{{"as chosen", {""}, "", false},
                                {"frames to either side", {"0", "2", "10"}, "--window-frames", false},
                                {"k", {"1", "2", "8"}, "--k", false},
                                {"rounds of the path", {"0", "3"}, "--iterations", true},
                                {"least width kept", {"0.7", "0.8", "0.9"}, "--min-scale", true},
                                {"cutoff Hz", {"0.25", "1"}, "--cutoff-hz", true},
                                {"shape cutoff Hz", {"0.25", "1"}, "--similar-hz", true},
                                {"render width", {width}, "--width", false}};
  int count = 0, number = 0;
  for (const Dial& dial : dials) count += static_cast<int>(dial.values.size());
  for (const Dial& dial : dials)
    for (const std::string& value : dial.values) {
      ++number;
      const std::string name = "tradeoff: " + (value.empty() ? dial.name : dial.name + " " + value);
      const auto run = [&](const std::string& program, std::vector<std::string> arguments,
                           const std::vector<std::string>& given, bool turned) {
        for (std::size_t i = 0; i < given.size(); ++i) {
          if (turned && given[i] == dial.option)
            ++i;  // skips the option's value: the dial's own is appended
          else
            arguments.push_back(given[i]);
        }
        if (turned && *dial.option != '\0') arguments.insert(arguments.end(), {dial.option, value});
        arguments.insert(arguments.end(),
                         {"--threads", std::to_string(options.threads), "--seed", std::to_string(options.seed)});
        return RunSiblingStage({name, program, arguments, number, count, options.executor.get()}, progress);
      };
      const std::string scene = (window / "scene").string();
      const StageResult solved =
          run("lumi-stabilize", {scene, "-o", path.string(), "--model", model, "--border", options.border},
              options.path_arguments, dial.of_path);
      std::vector<std::string> draw{scene, "-o", steady.string(), "--path", path.string(), "--proxy", "per-view"};
      if (options.border == "fill") draw.insert(draw.end(), {"--border", "fill"});
      const StageResult drawn = run("lumi-render", draw, options.render_arguments, !dial.of_path);
      const auto scores = run("lumi-stabilize", {"score", filmed.string(), steady.string()}, {}, false)
                              .summary.As<sibling::ScoreSummary>();
      const sibling::ScoredVideo& score = scores.videos.back();
      table.Add({dial.name, value, solved.summary.As<sibling::PathSummary>().seconds, drawn.seconds,
                 drawn.summary.As<sibling::FramesSummary>().ms_per_frame, score.cropping_ratio, score.kept_area,
                 score.stability, score.distortion, score.jitter_px});
    }
  std::error_code ec;
  for (const fs::path& file : {filmed, steady, path}) fs::remove(file, ec);

  table.facts = {{"frames", length}};
  const std::string subtitle = fmt::format("{} frames, one dial at a time", length);
  const char* colors[] = {"#d1242f", "#1f6feb", "#8250df", "#1a7f37", "#9a6700", "#0f766e", "#be185d", "#57606a"};
  const auto panel = [&](const char* title, const char* x, const PlotAxis& x_axis, const char* y,
                         const PlotAxis& y_axis, bool of_path_only) {
    TradeoffPanel p{title, subtitle, x, x_axis, y, y_axis, {}, "dial", "value"};
    for (std::size_t d = 0; d < dials.size(); ++d)
      if (!of_path_only || d == 0 || dials[d].of_path)
        p.series.push_back({dials[d].name, dials[d].name, colors[d % std::size(colors)]});
    return PlotOf(table, p);
  };
  result.files = WriteTradeoff(
      folder / "tradeoff", table,
      {panel("What the dials cost and give", "ms_per_frame", {"ms a frame", true}, "jitter_px",
             {"jitter above 1 Hz, px", false, true}, false),
       panel("Steadiness against what is kept", "kept_area", {"share of the area kept"}, "stability", {"stability"},
             true),
       panel("Steadiness against shape", "distortion", {"distortion (1: none)"}, "stability", {"stability"}, true)});
  return result;
}

}  // namespace lumi
