#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "proxy/hull/hull_tradeoff.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

Json RowsJson(const std::vector<HullTradeoffRow>& rows) {
  Json points = Json::array();
  for (const HullTradeoffRow& r : rows) {
    Json j{{"name", r.name},       {"line", r.line},      {"views", r.views}, {"silhouette_reduction", r.reduction},
           {"cell_px", r.cell_px}, {"seconds", r.seconds}};
    if (!r.failed.empty()) {
      j["failed"] = r.failed;
    } else {
      j.update(Json{{"views_used", r.used},
                    {"faces", r.faces},
                    {"dilation_px", r.dilation_px},
                    {"iou_median", r.iou_median},
                    {"iou_min", r.iou_min},
                    {"coverage_min", r.coverage_min},
                    {"volume", r.volume},
                    {"volume_ratio", r.volume / rows[0].volume},
                    {"front", r.on_front}});
    }
    points.push_back(std::move(j));
  }
  return points;
}

std::string RowsCsv(const std::vector<HullTradeoffRow>& rows) {
  std::string csv =
      "setting,line,views,silhouette_reduction,cell_px,views_used,faces,dilation_px,iou_median,iou_min,coverage_min,volume,volume_ratio,"
      "seconds,front,failed\n";
  for (const HullTradeoffRow& r : rows) {
    csv += fmt::format("\"{}\",{},{},{},{:g},", r.name, r.line, r.views, r.reduction, r.cell_px);
    if (r.failed.empty()) {
      csv += fmt::format("{},{},{:.4g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.3f},{},\n", r.used, r.faces, r.dilation_px, r.iou_median,
                         r.iou_min, r.coverage_min, r.volume, r.volume / rows[0].volume, r.seconds, r.on_front ? 1 : 0);
    } else {
      std::string why = r.failed;
      std::replace(why.begin(), why.end(), '"', '\'');
      csv += fmt::format(",,,,,,,,{:.3f},0,\"{}\"\n", r.seconds, why);
    }
  }
  return csv;
}

std::string RowsSvg(const std::vector<HullTradeoffRow>& rows) {
  struct Kind {
    const char *line, *label, *color;
    Marker marker;
  };
  constexpr Kind kKinds[] = {{"", "as given", "#24292f", Marker::kDiamond},
                             {"views", "fewer views", "#1f6feb", Marker::kCircle},
                             {"silhouettes", "smaller silhouettes", "#b45309", Marker::kSquare},
                             {"several", "fewer and smaller", "#9333ea", Marker::kCircle},
                             {"cell", "wider cells", "#15803d", Marker::kSquare}};
  const auto panel = [&](const char* title, const char* subtitle, const char* label, bool front, auto&& value) {
    Plot plot;
    plot.title = title;
    plot.subtitle = subtitle;
    plot.x = {"seconds", true, false};
    plot.y = {label, false, false};
    if (front) {
      std::vector<const HullTradeoffRow*> best;
      for (const HullTradeoffRow& r : rows)
        if (r.on_front) best.push_back(&r);
      std::sort(best.begin(), best.end(), [](const HullTradeoffRow* a, const HullTradeoffRow* b) { return a->seconds < b->seconds; });
      PlotSeries line{"front", "#57606a", Marker::kNone, true, true, false, {}};
      for (const HullTradeoffRow* r : best) line.points.push_back({r->seconds, value(*r), {}, {}});
      plot.series.push_back(std::move(line));
    }
    for (const Kind& kind : kKinds) {
      PlotSeries series{kind.label, kind.color, kind.marker, false, false, false, {}};
      for (const HullTradeoffRow& r : rows) {
        if (!r.failed.empty() || r.line != kind.line) continue;
        series.points.push_back({r.seconds, value(r), r.name, fmt::format("{}: {:.2f} s, {:.4f}", r.name, r.seconds, value(r))});
      }
      if (!series.points.empty()) plot.series.push_back(std::move(series));
    }
    return plot;
  };
  return SvgOf({panel("Tightness", "intersection over union with all silhouettes", "median", true,
                      [](const HullTradeoffRow& r) { return r.iou_median; }),
                panel("Volume", "over that of the hull as given", "ratio", false,
                      [&](const HullTradeoffRow& r) { return r.volume / rows[0].volume; })});
}

}  // namespace

std::string RunHullTradeoff(const HullRequest& request, const std::filesystem::path& path, const std::filesystem::path& output,
                            ProgressSink& progress) {
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
  const std::vector<SilhouetteView> views = ReadSilhouettes(
      scene, request.silhouettes.empty() ? scene.folder / "silhouettes" : request.silhouettes, request.clean, nullptr, progress);
  const std::vector<HullTradeoffRow> rows = MeasureHullTradeoff(views, request.hull, progress, MedianPoint(scene));
  const std::filesystem::path folder = output.empty() ? scene.folder / "tradeoff" : output;
  std::filesystem::create_directories(folder);
  const std::filesystem::path json = folder / "hull.json", csv = folder / "hull.csv", svg = folder / "hull.svg";
  const Json tradeoff{{"silhouettes", views.size()}, {"points", RowsJson(rows)}, {"seconds", SecondsSince(start)}};
  WriteTextAtomically(json, tradeoff.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  WriteTextAtomically(csv, RowsCsv(rows));
  WriteTextAtomically(svg, RowsSvg(rows));
  return Json{{"hull_tradeoff", tradeoff}, {"tradeoff_json", json.string()}, {"tradeoff_csv", csv.string()}, {"tradeoff_svg", svg.string()}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string DescribeHullTradeoff(const std::string& text) {
  const Json json = Json::parse(text);
  if (!json.contains("hull_tradeoff")) return {};
  const Json& t = json["hull_tradeoff"];
  std::string out = fmt::format("  {:<32} {:>8} {:>6} {:>8} {:>9} {:>8} {:>8} {:>9} {:>7}\n", "setting", "seconds", "used", "faces",
                                "dilation", "IoU med.", "least", "covered", "volume");
  for (const Json& p : t["points"]) {
    const std::string name = p["name"];
    if (p.contains("failed")) {
      out += fmt::format("  {:<32} {:>8.2f} {}\n", name, p["seconds"].get<double>(), p["failed"].get<std::string>());
      continue;
    }
    out += fmt::format("{} {:<32} {:>8.2f} {:>6} {:>8} {:>9.2f} {:>8.4f} {:>8.4f} {:>8.2f}% {:>7.3f}\n", p["front"].get<bool>() ? '*' : ' ',
                       name, p["seconds"].get<double>(), fmt::format("{}/{}", p["views_used"].get<int>(), p["views"].get<int>()),
                       p["faces"].get<std::size_t>(), p["dilation_px"].get<double>(), p["iou_median"].get<double>(),
                       p["iou_min"].get<double>(), 100 * p["coverage_min"].get<double>(), p["volume_ratio"].get<double>());
  }
  return out + fmt::format(
                   "* no other setting is both faster and tighter; over all {} silhouettes, whole size, used or not; volume over the first "
                   "row's\n{}, .csv, .svg; {:.0f} s",
                   t["silhouettes"].get<std::size_t>(), json["tradeoff_json"].get<std::string>(), t["seconds"].get<double>());
}

}  // namespace lumi
