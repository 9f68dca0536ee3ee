#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "proxy/commands.h"
#include "proxy/hull/coverage.h"
#include "proxy/hull/soundness.h"
#include "proxy/make_proxy.h"
#include "proxy/points.h"
#include "proxy/proxy_store.h"
#include "proxy/simplify/deviation.h"
#include "proxy/simplify/self_intersection.h"
#include "proxy/simplify/simplify.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/geometry/median.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string OptionOf(const std::optional<Provenance>& record, const char* key) {
  const auto it = record ? record->options.find(key) : std::map<std::string, std::string>::const_iterator();
  return record && it != record->options.end() ? it->second : "";
}

// What is simplified: a proxy that is itself the outcome stands for what it was made from, so that a second run has nothing to do.
std::string SourceOf(const Scene& scene, const std::string& asked) {
  if (!asked.empty()) return asked;
  if (scene.active_proxy.empty()) throw UsageError(scene.folder.string() + " has no active proxy", "name one: --from NAME");
  const auto record = RecordOf(scene, scene.active_proxy);
  const std::string from = OptionOf(record, "kind") == "simplify" ? OptionOf(record, "from") : "";
  return from.empty() ? scene.active_proxy : from;
}

// The silhouettes that the source is a hull of: cleaned as they were for it, without the views that it left out.
std::vector<SilhouetteView> SilhouettesOf(const Scene& scene, const std::string& from, const fs::path& asked, ProgressSink& progress) {
  const fs::path folder = asked.empty() ? scene.folder / "silhouettes" : asked;
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    if (!asked.empty()) throw InputError(folder, "no such folder");
    return {};
  }
  CleanOptions clean;
  std::istringstream words(OptionOf(RecordOf(scene, from), "clean"));
  if (CleanOptions c; words >> c.close_px >> c.grow_px >> c.min_part_px >> c.min_radius_px >> c.min_hole_px) clean = c;
  std::vector<std::string> without;
  std::vector<SilhouetteView> views = ReadSilhouettes(scene, folder, clean, &without, progress);
  const fs::path record = ProxyPath(scene.folder, from).replace_extension(".json");
  const auto hull = fs::exists(record, error) ? JsonKeys::Parse(ReadText(record)) : std::nullopt;
  if (hull)
    for (const HullSummary::LeftOut& left : hull->As<HullFigures>().hull.left_out) std::erase_if(views, [&](const SilhouetteView& v) { return v.name == left.name; });
  return views;
}

// Pixels that a world unit at the mesh takes in the median view.
double PixelsPerUnit(const Scene& scene, const Mesh& mesh) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : mesh.vertices) middle += v / static_cast<double>(mesh.vertices.size());
  std::vector<double> scales;
  for (const ProxyView& view : MakeProxyViews(scene))
    if (const double depth = std::abs(view.DepthOf(middle)); depth > 0) scales.push_back(view.focal_px / depth);
  return scales.empty() ? 1 : Median(scales);
}

// What there is to say of a simplified mesh beside the one that it was made from.
SimplifiedFit Judge(const Mesh& before, const Mesh& after, const std::vector<SilhouetteView>& views, double pixels_per_unit) {
  const Soundness sound = CheckSoundness(after);
  const Deviation deviation = MeasureDeviation(before, after);
  SimplifiedFit fit;
  fit.mean_distance_px = deviation.mean * pixels_per_unit;
  fit.max_distance_px = deviation.max * pixels_per_unit;
  fit.sound = sound.manifold && sound.degenerate_faces == 0 && (!sound.closed || sound.outward);
  fit.soundness = sound.Describe();
  fit.parts = sound.parts;
  fit.intersects_itself = sound.manifold && IntersectsItself(after);
  if (sound.closed && IsClosed(before)) {
    fit.volume = EnclosedVolume(after);
    fit.volume_ratio = *fit.volume / EnclosedVolume(before);
  }
  if (views.empty() || !sound.closed) return fit;
  const std::vector<SilhouetteFit> fits = MeasureSilhouettes(after, views);
  fit.silhouettes = Summarize(fits);
  fit.views_used = views.size();
  for (std::size_t v = 0; v < views.size(); ++v)
    if (fits[v].coverage < kLeastCoverage || fits[v].deepest_uncovered_px > kDeepestUncoveredPx)
      fit.views_missed.push_back({views[v].name, fits[v].coverage, fits[v].deepest_uncovered_px});
  return fit;
}

// lumi-render's own word on a mesh as the proxy of a copy of the scene that shares its photos and cameras.
struct RenderedError {
  double psnr_db = 0, ms_per_frame = 0;
};
class RenderBench {
 public:
  RenderBench(const Scene& scene, int holdout, int width_px) : holdout_(holdout), width_px_(width_px) {
    fs::create_directory(copy_ / "proxies");
    for (const auto& entry : fs::directory_iterator(scene.folder)) {
      const std::string name = entry.path().filename().string();
      if (name == "images" || name == "masks" || name == "sparse") fs::create_symlink(fs::absolute(entry.path()), copy_ / name);
      if (name == "lumigraph.json") fs::copy_file(entry.path(), copy_ / name);
    }
  }
  RenderedError Measure(const Mesh& mesh) const {
    WriteMesh(copy_ / "proxies" / "measured.ply", mesh);
    const TemporaryFolder frames;
    SubprocessOptions options;
    options.separate_stdout = true;
    const SubprocessResult result = RunSubprocess({SiblingProgram("lumi-render").string(), copy_.path().string(), "-o", (frames / "frames").string(), "--proxy", "measured",
                                                   "--holdout", std::to_string(holdout_), "--fold", "choose", "--width", std::to_string(width_px_), "--json"},
                                                  options);
    OrderedJson json;
    try {
      json = OrderedJson::parse(result.out);
    } catch (const nlohmann::json::exception&) {
    }
    if (result.exit_code != 0 || !json.contains("psnr_mean_db") || !json["psnr_mean_db"].is_number()) {
      const std::string why = json.contains("error") ? json["error"].value("message", "") : result.tail.empty() ? "" : result.tail.back();
      throw Error(result.exit_code >= 1 && result.exit_code <= 4 ? static_cast<ExitCode>(result.exit_code) : ExitCode::kMachine,
                  fmt::format("lumi-render cannot measure a proxy of {} faces: {}", mesh.faces.size(), why));
    }
    return {json["psnr_mean_db"].get<double>(), json["ms_per_frame"].is_number() ? json["ms_per_frame"].get<double>() : 0};
  }

 private:
  TemporaryFolder copy_;
  int holdout_, width_px_;
};

std::string Number(const OrderedJson& j, const char* key, const char* format, double factor = 1) {
  return j.contains(key) && j[key].is_number() ? fmt::format(fmt::runtime(format), factor * j[key].get<double>()) : "-";
}

std::string TradeoffRows(const OrderedJson& points) {
  std::string text = fmt::format("{:<10} {:>8} {:>8} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}", "method", "faces", "seconds", "coverage", "deepest", "IoU min",
                                 "IoU med", "mean px", "max px", "PSNR dB", "ms");
  for (const OrderedJson& p : points) {
    if (p.contains("failed")) {
      text += fmt::format("\n{:<10} {:>8} {}", p["method"].get<std::string>(), p["wanted"].get<std::size_t>(), p["failed"].get<std::string>());
      continue;
    }
    text += fmt::format("\n{:<10} {:>8} {:>8.2f} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}{}", p["method"].get<std::string>(), p["faces"].get<std::size_t>(),
                        p["seconds"].get<double>(), Number(p, "coverage_min", "{:.2f}%", 100), Number(p, "deepest_uncovered_px", "{:.1f} px"), Number(p, "iou_min", "{:.4f}"),
                        Number(p, "iou_median", "{:.4f}"), Number(p, "mean_distance_px", "{:.2f}"), Number(p, "max_distance_px", "{:.1f}"), Number(p, "psnr_mean_db", "{:.2f}"),
                        Number(p, "ms_per_frame", "{:.1f}"), p["reached"].get<bool>() ? "" : fmt::format("  (of {} wanted)", p["wanted"].get<std::size_t>()));
  }
  return text;
}

std::string TradeoffCsvOf(const OrderedJson& points) {
  constexpr std::array<const char*, 12> kColumns = {"wanted", "faces", "seconds", "coverage_min", "deepest_uncovered_px", "iou_min", "iou_median", "volume_ratio",
                                                    "mean_distance_px", "max_distance_px", "psnr_mean_db", "ms_per_frame"};
  std::string csv = "method";
  for (const char* column : kColumns) csv += fmt::format(",{}", column);
  csv += ",reached,failed\n";
  for (const OrderedJson& p : points) {
    csv += p["method"].get<std::string>();
    for (const char* column : kColumns) csv += "," + (p.contains(column) && p[column].is_number() ? p[column].dump() : "");
    const std::string failed = p.value("failed", "");
    csv += fmt::format(",{},{}\n", p.value("reached", false) ? "yes" : "no", failed.empty() ? "" : "\"" + failed + "\"");
  }
  return csv;
}

std::string TradeoffSvgOf(const OrderedJson& points, const std::string& from) {
  struct Panel {
    const char *title, *x, *x_label, *y, *y_label;
    bool x_log, y_log;
  };
  constexpr std::array<Panel, 3> kPanels = {{{"Distance to what it was made from", "faces", "faces", "mean_distance_px", "mean distance, px of the median view", true, true},
                                             {"Overlap with the silhouettes", "faces", "faces", "iou_median", "intersection over union, median", true, false},
                                             {"Held-out photos", "ms_per_frame", "milliseconds a frame", "psnr_mean_db", "PSNR, dB", false, false}}};
  std::vector<Plot> plots;
  for (const Panel& panel : kPanels) {
    Plot plot;
    plot.title = panel.title;
    plot.subtitle = "simplified from " + from;
    plot.x = {panel.x_label, panel.x_log, false};
    plot.y = {panel.y_label, panel.y_log, false};
    for (const auto& [method, color] : {std::pair("quadric", "#1f6feb"), std::pair("keep-hull", "#be123c"), std::pair("all", "#444444")}) {
      PlotSeries series;
      series.name = method;
      series.color = color;
      series.line = std::string(panel.x) == "faces";
      for (const OrderedJson& p : points)
        if (p["method"] == method && p.contains(panel.x) && p[panel.x].is_number() && p.contains(panel.y) && p[panel.y].is_number())
          series.points.push_back({p[panel.x].get<double>(), p[panel.y].get<double>(), std::to_string(p["faces"].get<std::size_t>()),
                                   fmt::format("{}, {} faces, {:.2f} s", method, p["faces"].get<std::size_t>(), p["seconds"].get<double>())});
      if (!series.points.empty()) plot.series.push_back(std::move(series));
    }
    if (!plot.series.empty()) plots.push_back(std::move(plot));
  }
  return SvgOf(plots);
}

}  // namespace

Made<SimplifyFigures> RunSimplify(const SimplifyRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  if (request.faces < 1) throw UsageError("--faces must be at least 1");
  const Scene opened = OpenForProxy(target.scene, progress);
  const std::string from = SourceOf(opened, request.from);
  const Mesh before = LoadProxy(opened, from);
  const SimplifyMethod method = request.keep_hull ? SimplifyMethod::kKeepHull : SimplifyMethod::kQuadric;
  ProxyTarget named = target;
  if (named.name.empty()) named.name = fmt::format("{}-{}{}", from, request.faces, request.keep_hull ? "-kept" : "");
  if (named.name == from && named.output.empty()) throw UsageError("--name " + from + " is the proxy that is simplified", "choose another name");
  const fs::path silhouettes = request.silhouettes.empty() ? opened.folder / "silhouettes" : request.silhouettes;
  std::optional<SimplifyFigures> figures;
  Made<SimplifyFigures> made{
      MakeProxy(named, "simplify", {{"faces", std::to_string(request.faces)}, {"method", Name(method)}, {"from", from}},
                {{"from", Fingerprint(ProxyPath(opened.folder, from))}, {"silhouettes", Fingerprint(silhouettes)}}, progress, [&](const Scene& scene) {
        SimplifiedMesh simple = std::move(Simplify(before, {static_cast<std::size_t>(request.faces)}, method, progress).front());
        const std::vector<SilhouetteView> views = SilhouettesOf(scene, from, request.silhouettes, progress);
        figures = SimplifyFigures{from, Name(method), request.faces, before.faces.size(), simple.reached, simple.wrapped, simple.seconds,
                                  Judge(before, simple.mesh, views, PixelsPerUnit(scene, before))};
        if (!simple.reached) progress.Message(fmt::format("warning: {} faces are left, no edge may be collapsed any more", simple.mesh.faces.size()));
        if (const std::size_t missed = figures->fit.views_missed.size(); request.keep_hull && missed > 0)
          progress.Message(fmt::format("warning: {} silhouettes are not covered to {:g} % and {:g} px; so it was with {}?", missed, 100 * kLeastCoverage,
                                       kDeepestUncoveredPx, from));
        return std::move(simple.mesh);
      }), figures};
  if (named.output.empty()) KeepFigures(opened.folder, made);
  return made;
}

std::string RunSimplifyTradeoff(const SimplifyTradeoffRequest& request, ProgressSink& progress) {
  if (request.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (request.width_px < 16) throw UsageError("--choose-width must be at least 16");
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = OpenForProxy(request.scene, progress);
  RequireKeepsProxies(scene);
  const std::string from = SourceOf(scene, request.from);
  const Mesh before = LoadProxy(scene, from);
  const std::vector<SilhouetteView> views = SilhouettesOf(scene, from, request.silhouettes, progress);
  const double pixels_per_unit = PixelsPerUnit(scene, before);
  const int photos = static_cast<int>(scene.views.size());
  std::optional<RenderBench> bench;
  if (request.render && photos >= 3) bench.emplace(scene, photos > request.holdout / 2 ? request.holdout : 2, request.width_px);

  std::vector<std::size_t> counts;
  for (const int n : request.faces)
    if (n > 0 && static_cast<std::size_t>(n) < before.faces.size()) counts.push_back(static_cast<std::size_t>(n));
  std::vector<SimplifyMethod> methods = {SimplifyMethod::kQuadric};
  if (IsClosed(before)) methods.push_back(SimplifyMethod::kKeepHull);
  OrderedJson points = OrderedJson::array();
  Progress steps(progress, "measuring simplified proxies", static_cast<long>(counts.size() * methods.size()) + 1);
  const auto measure = [&](const std::string& method, std::size_t wanted, const SimplifiedMesh& simple) {
    OrderedJson p{{"method", method}, {"wanted", wanted}, {"faces", simple.mesh.faces.size()}, {"seconds", simple.seconds}, {"reached", simple.reached}};
    p.update(OrderedJson::parse(JsonKeys(Judge(before, simple.mesh, views, pixels_per_unit)).Text()));
    p["psnr_mean_db"] = p["ms_per_frame"] = nullptr;
    if (bench) {
      const RenderedError error = bench->Measure(simple.mesh);
      p["psnr_mean_db"] = error.psnr_db;
      p["ms_per_frame"] = error.ms_per_frame;
    }
    points.push_back(std::move(p));
    steps.Step();
  };
  const auto fail = [&](SimplifyMethod method, std::size_t wanted, const char* why) {
    points.push_back({{"method", Name(method)}, {"wanted", wanted}, {"failed", why}});
    steps.Step();
  };
  for (const SimplifyMethod method : methods) {
    // One run for all where it can be had: each number of faces is passed on the way to the fewest.
    std::vector<SimplifiedMesh> together;
    try {
      together = Simplify(before, counts, method, progress);
    } catch (const DataError&) {
    } catch (const UsageError&) {
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      CheckInterrupted();
      try {
        measure(Name(method), counts[i], together.empty() ? Simplify(before, {counts[i]}, method, progress).front() : together[i]);
      } catch (const DataError& e) {
        fail(method, counts[i], e.what());
      } catch (const UsageError& e) {
        fail(method, counts[i], e.what());
      }
    }
  }
  SimplifiedMesh all;
  all.mesh = before;
  measure("all", before.faces.size(), all);

  const fs::path folder = scene.folder / "tradeoff", base = folder / ("simplify-" + from);
  OrderedJson json{{"name", from}, {"faces", before.faces.size()}, {"closed", IsClosed(before)}, {"seconds", 0.0}, {"tradeoff", {{"from", from}, {"points", points}}}};
  const FolderLock lock(scene.folder);
  fs::create_directories(folder);
  WriteTextAtomically(base.string() + ".csv", TradeoffCsvOf(points));
  WriteTextAtomically(base.string() + ".svg", TradeoffSvgOf(points, from));
  json["tradeoff"]["csv"] = base.string() + ".csv";
  json["tradeoff"]["svg"] = base.string() + ".svg";
  json["tradeoff"]["json"] = base.string() + ".json";
  json["seconds"] = SecondsSince(start);
  WriteTextAtomically(base.string() + ".json", json["tradeoff"].dump(2) + "\n");
  return json.dump();
}

std::string DescribeSimplified(const std::string& text) {
  const OrderedJson json = OrderedJson::parse(text);
  const OrderedJson& t = json["tradeoff"];
  return TradeoffRows(t["points"]) + fmt::format("\n{}, {}, {}; {:.0f} s", t["csv"].get<std::string>(), t["svg"].get<std::string>(), t["json"].get<std::string>(), json["seconds"].get<double>());
}

}  // namespace lumi
