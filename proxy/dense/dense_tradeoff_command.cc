#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "proxy/commands.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/tradeoff/held_out.h"

namespace lumi {
namespace {

struct DenseRow {
  std::string name, line;
  DenseOptions options;
  std::string failed;
  double depth_s = 0, seconds = 0;
  std::size_t faces = 0;
  std::optional<double> psnr_db, ms_per_frame;
};

// One setting at a time from those given. What changes fusion and mesh alone comes first: the depth maps stay. A map is
// never larger than its photo, so that widths beyond the largest photo's, `most_px`, would repeat a row.
std::vector<DenseRow> Variants(const DenseOptions& given, int most_px) {
  std::vector<DenseRow> rows(1);
  rows[0].name = "as given";
  rows[0].options = given;
  const auto add = [&](const std::string& line, const auto& set, const auto& values, const auto& own) {
    for (const auto value : values) {
      if (value == own) continue;
      DenseRow row = rows[0];
      row.name = fmt::format("{} {}", line, value);
      row.line = line;
      set(row.options, value);
      rows.push_back(row);
    }
  };
  add(
      "agree", [](DenseOptions& o, int v) { o.fusion.agree = v; }, std::array{1, 2, 3, 4}, given.fusion.agree);
  add(
      "merge-px", [](DenseOptions& o, double v) { o.merge_px = v; }, std::array{1.0, 1.5, 2.0, 4.0}, given.merge_px);
  std::vector<int> widths{240, 320, 480, 640, 960};
  std::erase_if(widths, [&](int width) { return width > most_px; });
  add(
      "width", [](DenseOptions& o, int v) { o.stereo.width = v; }, widths, given.stereo.width);
  add(
      "views", [](DenseOptions& o, int v) { o.stereo.views = v; }, std::array{3, 4, 6, 10}, given.stereo.views);
  add(
      "iterations", [](DenseOptions& o, int v) { o.stereo.iterations = v; }, std::array{2, 3, 4, 8},
      given.stereo.iterations);
  return rows;
}

int LongestSide(const Scene& scene) {
  int side = 1;
  for (const View& v : scene.views) side = std::max({side, scene.CameraOf(v).width_px, scene.CameraOf(v).height_px});
  return side;
}

void MeasureRow(const HeldOutBench& bench, int holdout, DenseRow& row, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  std::string proxy = row.line.empty() ? "given" : row.name;
  std::ranges::replace(proxy, ' ', '-');
  try {
    DenseRequest request;
    request.dense = row.options;
    request.seed = row.options.stereo.seed;
    const Made<DenseSummary> made = RunDense({bench.folder(), proxy, {}, false, holdout}, request, progress);
    row.depth_s = made.figures ? made.figures->stereo.seconds : 0;
    row.seconds = SecondsSince(start);
    row.faces = made.faces;
    const HeldOutBench::Figures figures = bench.Measure(made.name);
    row.psnr_db = figures.psnr_db;
    row.ms_per_frame = figures.ms_per_frame;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    row.failed = e.what();
  }
}

TradeoffTable TableOf(const std::vector<DenseRow>& rows) {
  using enum TradeoffRole;
  return TradeoffTableOf<DenseRow>(
      {{{"name", kSetting, "setting", -16, "{}", "setting"}, &DenseRow::name},
       {{"line", kSetting}, &DenseRow::line},
       {{"width", kSetting}, [](const DenseRow& r) { return r.options.stereo.width; }},
       {{"views", kSetting}, [](const DenseRow& r) { return r.options.stereo.views; }},
       {{"iterations", kSetting}, [](const DenseRow& r) { return r.options.stereo.iterations; }},
       {{"agree", kSetting}, [](const DenseRow& r) { return r.options.fusion.agree; }},
       {{"merge_px", kSetting}, [](const DenseRow& r) { return r.options.merge_px; }},
       {{"seconds", kCost, "seconds", 9, "{:.1f}"}, &DenseRow::seconds},
       {{"depth_seconds", kFigure, "of depth", 9, "{:.1f}"}, &DenseRow::depth_s},
       {{"faces", kFigure, "faces", 9}, &DenseRow::faces},
       {{"psnr_holdout_db", kMoreIsBetter, "held-out dB", 12, "{:.2f}"}, &DenseRow::psnr_db},
       {{"ms_per_frame", kFigure, "ms/frame", 9, "{:.1f}"}, &DenseRow::ms_per_frame},
       {{"failed", kFailed}, &DenseRow::failed}},
      rows);
}

Plot PlotOfRows(const TradeoffTable& table) {
  return PlotOf(table, {"Dense proxies",
                        "held-out photos, in dB",
                        "seconds",
                        {"seconds", true},
                        "psnr_holdout_db",
                        {"dB"},
                        {{"", "as given", "#24292f", Marker::kDiamond},
                         {"width", "width", "#1f6feb"},
                         {"views", "views", "#b45309", Marker::kSquare},
                         {"iterations", "iterations", "#9333ea"},
                         {"agree", "photos that agree", "#15803d", Marker::kSquare},
                         {"merge-px", "merged within", "#be123c", Marker::kDiamond}},
                        "line",
                        "",
                        table.Front("seconds", "psnr_holdout_db")});
}

}  // namespace

DenseTradeoff RunDenseTradeoff(const ProxyTarget& target, const DenseTradeoffRequest& request, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (const std::string wrong = Validate(request.dense.dense); !wrong.empty()) throw UsageError(wrong);
  if (request.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (target.output.extension() == ".ply" || target.output.extension() == ".obj")
    throw UsageError("--tradeoff writes tables and a plot: --output names a folder, not " + target.output.string());
  const Scene scene = OpenForProxy(target.scene, progress);
  std::optional<FolderLock> lock;
  if (target.output.empty()) {
    RequireKeepsProxies(scene);
    lock.emplace(scene.folder);
  }
  DenseOptions given = request.dense.dense;
  given.stereo.seed = static_cast<std::uint32_t>(request.dense.seed);
  std::vector<DenseRow> rows = Variants(given, LongestSide(scene));
  const HeldOutBench bench(scene.folder, request.holdout, request.choose_width_px);
  Progress steps(progress, "settings", static_cast<long>(rows.size()));
  for (DenseRow& row : rows) {
    MeasureRow(bench, request.holdout, row, progress);
    steps.Step();
  }
  DenseTradeoff t;
  t.table = TableOf(rows);
  t.table.MarkFront("seconds", "psnr_holdout_db");
  t.seconds = SecondsSince(start);
  t.table.facts = {{"holdout", request.holdout}, {"width_px", request.choose_width_px}, {"seconds", t.seconds}};
  t.files = WriteTradeoff((target.output.empty() ? scene.folder / "tradeoff" : target.output) / "dense", t.table,
                          {PlotOfRows(t.table)});
  return t;
}

void ListKeys(JsonKeys& j, DenseTradeoff& t) {
  j.Say("dense_tradeoff", KeysOf(t.table));
  j("tradeoff_json", t.files.json, "tradeoff_csv", t.files.csv, "tradeoff_svg", t.files.svg);
}

std::string Describe(const DenseTradeoff& t) {
  return TextOf(t.table) +
         fmt::format(
             "\n* no other setting is both faster and better; made without the photos left out; fusion and mesh alone "
             "change with agree and merge-px, whose depth maps were there\n{}, .csv, .svg; {:.0f} s",
             t.files.json.string(), t.seconds);
}

}  // namespace lumi
