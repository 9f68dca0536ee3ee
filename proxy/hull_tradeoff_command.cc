#include <fmt/format.h>

#include <chrono>

#include "proxy/commands.h"
#include "proxy/hull/hull_tradeoff.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

TradeoffTable TableOf(const std::vector<HullTradeoffRow>& rows) {
  using Row = HullTradeoffRow;
  using enum TradeoffRole;
  return TradeoffTableOf<Row>(
      {{{"name", kSetting, "setting", -32, "{}", "setting"}, &Row::name},
       {{"line", kSetting}, &Row::line},
       {{"views", kSetting}, &Row::views},
       {{"silhouette_reduction", kSetting}, &Row::reduction},
       {{"cell_px", kSetting}, &Row::cell_px},
       {{"views_used"}, &Row::used},
       {{"seconds", kCost, "seconds", 8, "{:.2f}"}, &Row::seconds},
       {{"", kFigure, "used", 6}, [](const Row& r) { return fmt::format("{}/{}", r.used, r.views); }},
       {{"faces", kFigure, "faces", 8}, &Row::faces},
       {{"dilation_px", kFigure, "dilation", 9, "{:.2f}"}, &Row::dilation_px},
       {{"iou_median", kMoreIsBetter, "IoU med.", 8, "{:.4f}"}, &Row::iou_median},
       {{"iou_min", kFigure, "least", 8, "{:.4f}"}, &Row::iou_min},
       {{"coverage_min", kFigure, "covered", 9, "{:.2f}%"}, &Row::coverage_min},
       {{"volume"}, &Row::volume},
       {{"volume_ratio", kFigure, "volume", 7, "{:.3f}"}, [&](const Row& r) { return r.volume / rows[0].volume; }},
       {{"failed", kFailed}, &Row::failed}},
      rows);
}

std::vector<Plot> PanelsOf(const TradeoffTable& table) {
  TradeoffPanel panel{"Tightness",
                      "intersection over union with all silhouettes",
                      "seconds",
                      {"seconds", true},
                      "iou_median",
                      {"median"},
                      {{"", "as given", "#24292f", Marker::kDiamond},
                       {"views", "fewer views", "#1f6feb"},
                       {"silhouettes", "smaller silhouettes", "#b45309", Marker::kSquare},
                       {"several", "fewer and smaller", "#9333ea"},
                       {"cell", "wider cells", "#15803d", Marker::kSquare},
                       {"prefer", "the other preference", "#be123c", Marker::kDiamond}},
                      "line",
                      "",
                      table.Front("seconds", "iou_median")};
  const Plot tightness = PlotOf(table, panel);
  panel.title = "Volume", panel.subtitle = "over that of the hull as given";
  panel.y = "volume_ratio", panel.y_axis.label = "ratio";
  panel.front.clear();
  return {tightness, PlotOf(table, panel)};
}

}  // namespace

HullTradeoff RunHullTradeoff(const HullRequest& request, const std::filesystem::path& path,
                             const std::filesystem::path& output, ProgressSink& progress) {
  if (const std::string wrong = Validate(request.hull); !wrong.empty()) throw UsageError(wrong);
  if (output.extension() == ".ply" || output.extension() == ".obj")
    throw UsageError("--tradeoff writes tables and a plot: --output names a folder, not " + output.string());
  const auto start = std::chrono::steady_clock::now();
  OpenOptions open;
  open.check_photos = false;
  const Scene scene = OpenScene(path, open, progress);
  RequireMetric(scene, "a hull");
  std::optional<FolderLock> lock;
  if (output.empty()) {
    RequireKeepsProxies(scene);
    lock.emplace(scene.folder);
  }
  const std::vector<SilhouetteView> views =
      ReadSilhouettes(scene, request.silhouettes.empty() ? scene.folder / "silhouettes" : request.silhouettes,
                      request.clean, nullptr, progress);
  HullTradeoff t;
  t.table = TableOf(MeasureHullTradeoff(views, request.hull, progress, MedianPoint(scene)));
  t.table.MarkFront("seconds", "iou_median");
  t.silhouettes = views.size();
  t.seconds = SecondsSince(start);
  t.table.facts = {{"silhouettes", t.silhouettes}, {"seconds", t.seconds}};
  t.files = WriteTradeoff((output.empty() ? scene.folder / "tradeoff" : output) / "hull", t.table, PanelsOf(t.table));
  return t;
}

void ListKeys(JsonKeys& j, HullTradeoff& t) {
  j.Say("hull_tradeoff", KeysOf(t.table));
  j("tradeoff_json", t.files.json, "tradeoff_csv", t.files.csv, "tradeoff_svg", t.files.svg);
}

std::string Describe(const HullTradeoff& t) {
  return TextOf(t.table) + fmt::format(
                               "\n* no other setting is both faster and tighter; over all {} silhouettes, whole size, "
                               "used or not; volume over the first "
                               "row's\n{}, .csv, .svg; {:.0f} s",
                               t.silhouettes, t.files.json.string(), t.seconds);
}

}  // namespace lumi
