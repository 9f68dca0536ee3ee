#include "pipeline/report/fronts.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/plot/plot.h"
#include "scene/tradeoff/front.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

// A stage's table: which of its columns are drawn. Of several accuracies the first that has a value.
struct Stage {
  std::string file;  // below the scene, without .json; one that ends in "*": all that begin so
  std::string title;
  std::string rows;  // key of the list
  std::string cost, cost_label;
  struct Accuracy {
    std::string key, label;
    bool less = false;  // is better
  };
  std::vector<Accuracy> accuracies;
};

const std::vector<Stage>& Stages() {
  static const std::vector<Stage> all{
      {"tradeoff/pipeline", "The whole pipeline", "qualities", "minutes", "minutes", {{"psnr_db", "held-out PSNR, dB"}}},
      {"tradeoff/colmap", "Cameras", "points", "seconds", "seconds",
       {{"centre_rms_percent", "centres off, % of the extent", true}, {"mean_reprojection_error_px", "px", true}}},
      {"tradeoff/factorization", "Cameras by factorisation", "points", "seconds", "seconds",
       {{"centre_rms_percent", "centres off, % of the extent", true}, {"mean_reprojection_error_px", "px", true}}},
      {"tradeoff/period", "Period", "points", "seconds", "seconds", {{"error_percent", "error, %", true}}},
      {"tradeoff/dense", "Dense proxy", "points", "seconds", "seconds", {{"psnr_holdout_db", "held-out PSNR, dB"}}},
      {"tradeoff/hull", "Visual hull", "points", "seconds", "seconds", {{"iou_median", "silhouettes covered (IoU)"}}},
      {"tradeoff/simplify-*", "Fewer faces", "points", "faces", "faces",
       {{"psnr_mean_db", "held-out PSNR, dB"}, {"iou_median", "silhouettes covered (IoU)"}, {"mean_distance_px", "px", true}}},
      {"fronts/*", "Rendering", "points", "ms", "ms a frame",
       {{"psnr_holdout_db", "held-out PSNR, dB"}, {"psnr_optimum_db", "dB from the optimum"}}},
  };
  return all;
}

std::vector<fs::path> FilesOf(const fs::path& scene, const Stage& stage) {
  const fs::path stem = scene / stage.file;
  if (!stage.file.ends_with("*")) return {fs::path(stem) += ".json"};
  std::string begins = stem.filename().string();
  begins.pop_back();
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator it(stem.parent_path(), error), end; !error && it != end; it.increment(error))
    if (it->path().extension() == ".json" && it->path().filename().string().starts_with(begins))
      files.push_back(it->path());
  std::sort(files.begin(), files.end());
  return files;
}

std::optional<json> Read(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  json parsed = json::parse(ReadText(file), nullptr, false);
  if (!parsed.is_object()) return std::nullopt;
  return parsed;
}

std::string TextIn(const json& row, const char* key) {
  const auto found = row.find(key);
  return found != row.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<double> NumberIn(const json& row, const std::string& key) {
  const auto found = row.find(key);
  if (found == row.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

// The name up to a colon: "as given: 8192 features, ..." is "as given".
std::string NameIn(const json& row) {
  for (const char* key : {"name", "method"})
    if (std::string name = TextIn(row, key); !name.empty()) return name.substr(0, name.find(':'));
  return {};
}

// A row of the table that the scene was made with: what its stage calls so, or the film's settings.
bool IsTaken(const Stage& stage, const json& table, const std::string& name, const std::string& film) {
  if (stage.file == "tradeoff/pipeline") return name == TextIn(table, "recommended");
  return stage.file.starts_with("fronts") ? !film.empty() && name == film : name == "as given";
}

std::optional<Plot> PanelOf(const Stage& stage, const fs::path& file, const std::string& film) {
  const std::optional<json> table = Read(file);
  if (!table) return std::nullopt;
  const auto rows = table->find(stage.rows);
  if (rows == table->end() || !rows->is_array()) return std::nullopt;
  for (const Stage::Accuracy& accuracy : stage.accuracies) {
    std::vector<PlotPoint> points;
    std::vector<CostAndQuality> measured;
    PlotSeries taken{.name = "as this scene has it", .color = "#cf222e", .marker = Marker::kDiamond, .points = {}};
    for (const json& row : *rows) {
      if (!row.is_object()) continue;
      const auto x = NumberIn(row, stage.cost), y = NumberIn(row, accuracy.key);
      if (!x || !y || !std::isfinite(*x) || !std::isfinite(*y) || !(*x > 0)) continue;
      const std::string name = NameIn(row);
      points.push_back({*x, *y, "", name});
      measured.push_back({*x, accuracy.less ? -*y : *y});
      if (IsTaken(stage, *table, name, film)) taken.points.push_back({*x, *y, name, name});
    }
    if (points.empty()) continue;
    PlotSeries settings{.name = "settings", .color = "#8c959f", .points = {}};
    PlotSeries front{.name = "front", .color = "#1f6feb", .line = true, .steps = true, .points = {}};
    for (const std::size_t i : ParetoFront(measured)) {
      front.points.push_back(points[i]);
      front.points.back().label = points[i].tip;
      for (PlotPoint& p : taken.points)
        if (p.label == points[i].tip) p.label.clear();  // it has its name already
    }
    settings.points = std::move(points);
    Plot plot{.title = stage.title,
              .subtitle = stage.file.ends_with("*") ? file.stem().string() : std::string(),
              .x = {stage.cost_label, true},
              .y = {accuracy.label},
              .series = {std::move(settings), std::move(front)},
              .marks = {}};
    if (!taken.points.empty()) plot.series.push_back(std::move(taken));
    return plot;
  }
  return std::nullopt;
}

}  // namespace

std::string FrontsSvg(const fs::path& scene_folder, const std::string& film) {
  std::vector<Plot> panels;
  for (const Stage& stage : Stages())
    for (const fs::path& file : FilesOf(scene_folder, stage))
      if (std::optional<Plot> panel = PanelOf(stage, file, film)) panels.push_back(*std::move(panel));
  return panels.empty() ? std::string() : SvgOf(panels, 2);
}

}  // namespace lumi
