#include "pipeline/report/fronts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"
#include "scene/tradeoff/front.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using Value = std::optional<double>;

// Columns that are read of the stages' tables; each table has some of them.
struct FrontRow {
  std::string name, method, dial, value;
  Value minutes, seconds, faces, ms;
  Value choosing_db, psnr_db, psnr_holdout_db, psnr_mean_db, psnr_optimum_db, iou_median;
  Value centre_rms_percent, mean_reprojection_error_px, error_percent, mean_distance_px;
  Value ms_per_frame, jitter_px;
};
void ListKeys(JsonKeys& j, FrontRow& r) {
  j("name", r.name, "method", r.method, "minutes", r.minutes, "seconds", r.seconds, "faces", r.faces, "ms", r.ms);
  j("choosing_db", r.choosing_db, "psnr_db", r.psnr_db, "psnr_holdout_db", r.psnr_holdout_db, "psnr_mean_db",
    r.psnr_mean_db);
  j("psnr_optimum_db", r.psnr_optimum_db, "iou_median", r.iou_median, "centre_rms_percent", r.centre_rms_percent);
  j("dial", r.dial, "value", r.value, "ms_per_frame", r.ms_per_frame, "jitter_px", r.jitter_px);
  j("mean_reprojection_error_px", r.mean_reprojection_error_px, "error_percent", r.error_percent);
  j("mean_distance_px", r.mean_distance_px);
}
struct FrontTable {
  std::vector<FrontRow> points, qualities;
  std::string proxy;
};
void ListKeys(JsonKeys& j, FrontTable& t) { j("points", t.points, "qualities", t.qualities, "proxy", t.proxy); }

// Which row a mark stands at.
enum class Marked { kAsGiven, kFilm, kThisScene, kNothing };

// A stage's table: which of its columns are drawn. Of several accuracies the first that a row has.
struct Stage {
  std::string file;  // below the scene, without .json; one that ends in "*": all that begin so
  std::string title;
  Marked marked = Marked::kNothing;
  Value FrontRow::*cost = nullptr;
  std::string cost_label;
  struct Accuracy {
    Value FrontRow::*value;
    std::string label;
    bool less = false;  // is better
  };
  std::vector<Accuracy> accuracies;
};

const std::vector<Stage>& Stages() {
  using Row = FrontRow;
  const std::vector<Stage::Accuracy> cameras{{&Row::centre_rms_percent, "centres off, % of the extent", true},
                                             {&Row::mean_reprojection_error_px, "reprojection error, px", true}};
  const Stage::Accuracy held_out{&Row::psnr_holdout_db, "held-out PSNR, dB"},
      iou{&Row::iou_median, "silhouettes (IoU)"};
  static const std::vector<Stage> all{
      // In the folder above, whose scenes are the qualities.
      {"../tradeoff/pipeline",
       "The whole pipeline",
       Marked::kThisScene,
       &Row::minutes,
       "minutes",
       {{&Row::choosing_db, "PSNR of the choosing fold, dB"}, {&Row::psnr_db, "held-out PSNR, dB"}}},
      // In the folder of the film that the scene is a window of.
      {"../../tradeoff",
       "Stabilising",
       Marked::kAsGiven,
       &Row::ms_per_frame,
       "ms a frame",
       {{&Row::jitter_px, "jitter above 1 Hz, px", true}}},
      {"tradeoff/colmap", "Cameras", Marked::kAsGiven, &Row::seconds, "seconds", cameras},
      {"tradeoff/factorization", "Cameras by factorisation", Marked::kAsGiven, &Row::seconds, "seconds", cameras},
      {"tradeoff/period",
       "Period",
       Marked::kAsGiven,
       &Row::seconds,
       "seconds",
       {{&Row::error_percent, "error, %", true}}},
      {"tradeoff/dense", "Dense proxy", Marked::kAsGiven, &Row::seconds, "seconds", {held_out}},
      {"tradeoff/hull", "Visual hull", Marked::kAsGiven, &Row::seconds, "seconds", {iou}},
      {"tradeoff/simplify-*",
       "Fewer faces",
       Marked::kNothing,
       &Row::faces,
       "faces",
       {{&Row::psnr_mean_db, "held-out PSNR, dB"}, iou, {&Row::mean_distance_px, "distance, px", true}}},
      {"fronts/*",
       "Rendering",
       Marked::kFilm,
       &Row::ms,
       "ms a frame",
       {held_out, {&Row::psnr_optimum_db, "PSNR to the optimum, dB"}}},
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

std::optional<FrontTable> Read(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  try {
    return JsonKeys::Read(file, "a table of what accuracy costs").As<FrontTable>();
  } catch (const Error&) {
    return std::nullopt;
  }
}

// The name up to a colon: "as given: 8192 features, ..." is "as given".
std::string NameOf(const FrontRow& row) {
  if (!row.dial.empty()) return row.value.empty() ? "as given" : row.dial + " " + row.value;
  const std::string& name = row.name.empty() ? row.method : row.name;
  return name.substr(0, name.find(':'));
}

std::optional<Plot> PanelOf(const Stage& stage, const fs::path& file, const SceneSettings& scene) {
  const std::optional<FrontTable> table = Read(file);
  if (!table) return std::nullopt;
  const auto is_marked = [&](const std::string& name) {
    switch (stage.marked) {
      case Marked::kAsGiven: return name == "as given";
      case Marked::kFilm: return !name.empty() && name == scene.film && table->proxy == scene.proxy;
      case Marked::kThisScene: return name == scene.quality;
      case Marked::kNothing: break;
    }
    return false;
  };
  for (const Stage::Accuracy& accuracy : stage.accuracies) {
    std::vector<PlotPoint> points;
    std::vector<CostAndQuality> measured;
    PlotSeries marked{.name = stage.marked == Marked::kAsGiven ? "as given" : "this scene",
                      .color = "#cf222e",
                      .marker = Marker::kDiamond,
                      .points = {}};
    for (const FrontRow& row : stage.marked == Marked::kThisScene ? table->qualities : table->points) {
      const Value x = row.*stage.cost, y = row.*accuracy.value;
      if (!x || !y || !std::isfinite(*x) || !std::isfinite(*y) || !(*x > 0)) continue;
      const std::string name = NameOf(row);
      points.push_back({*x, *y, "", name});
      measured.push_back({*x, accuracy.less ? -*y : *y});
      if (is_marked(name)) marked.points.push_back({*x, *y, name, name});
    }
    if (points.empty()) continue;
    PlotSeries settings{.name = "settings", .color = "#8c959f", .points = {}};
    PlotSeries front{.name = "front", .color = "#1f6feb", .line = true, .steps = true, .points = {}};
    for (const std::size_t i : ParetoFront(measured)) {
      front.points.push_back(points[i]);
      front.points.back().label = points[i].tip;
      for (PlotPoint& p : marked.points)
        if (p.label == points[i].tip) p.label.clear();  // it has its name already
    }
    settings.points = std::move(points);
    Plot plot{.title = stage.title,
              .subtitle = stage.file.ends_with("*") ? file.stem().string() : std::string(),
              .x = {stage.cost_label, true},
              .y = {accuracy.label},
              .series = {std::move(settings), std::move(front)},
              .marks = {}};
    if (!marked.points.empty()) plot.series.push_back(std::move(marked));
    return plot;
  }
  return std::nullopt;
}

}  // namespace

std::string FrontsSvg(const fs::path& scene_folder, const SceneSettings& scene) {
  std::vector<Plot> panels;
  for (const Stage& stage : Stages())
    for (const fs::path& file : FilesOf(scene_folder, stage))
      if (std::optional<Plot> panel = PanelOf(stage, file, scene)) panels.push_back(*std::move(panel));
  return panels.empty() ? std::string() : SvgOf(panels, 2);
}

}  // namespace lumi
