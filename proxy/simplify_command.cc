#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
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
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/tradeoff/held_out.h"
#include "scene/tradeoff/table.h"

namespace lumi {
namespace fs = std::filesystem;

static void ListKeys(JsonKeys& j, SimplifyTradeoffRow& r) {
  j("method", r.method, "wanted", r.wanted);
  if (!r.failed.empty()) {
    j("failed", r.failed);
    return;
  }
  j("faces", r.faces, "seconds", r.seconds, "reached", r.reached);
  ListKeys(j, r.fit);
  j("psnr_mean_db", r.psnr_db, "ms_per_frame", r.ms_per_frame);
}

namespace {

std::string OptionOf(const std::optional<Provenance>& record, const char* key) {
  const auto it = record ? record->options.find(key) : std::map<std::string, std::string>::const_iterator();
  return record && it != record->options.end() ? it->second : "";
}

// The proxy to simplify. If the active one is a simplified proxy itself, it is the one that was simplified, so that a
// second run has nothing to do.
std::string SourceOf(const Scene& scene, const std::string& asked) {
  // A mesh file by its whole path: it is recorded, and looked for from wherever a later run is started.
  if (IsMeshFile(asked)) return fs::absolute(asked).lexically_normal().string();
  if (!asked.empty()) return asked;
  if (scene.active_proxy.empty())
    throw UsageError(scene.folder.string() + " has no active proxy", "name one: --from NAME");
  const auto record = RecordOf(scene, scene.active_proxy);
  const std::string from = OptionOf(record, "kind") == "simplify" ? OptionOf(record, "from") : "";
  return from.empty() ? scene.active_proxy : from;
}

// What names are made of: the proxy's own, of a mesh file the file's.
std::string NameOf(const std::string& from) { return IsMeshFile(from) ? fs::path(from).stem().string() : from; }

// The folder of silhouettes that is asked for; else the one that the source was made from, where it is still there;
// else the scene's.
fs::path SilhouetteFolder(const Scene& scene, const std::string& from, const fs::path& asked) {
  if (!asked.empty()) return asked;
  const std::string recorded = OptionOf(RecordOf(scene, from), "silhouettes");
  std::error_code error;
  if (!recorded.empty() && fs::is_directory(scene.folder / recorded, error)) return scene.folder / recorded;
  return scene.folder / "silhouettes";
}

// The silhouettes that the source is a hull of: cleaned as they were for it, without the views that it left out.
std::vector<SilhouetteView> SilhouettesOf(const Scene& scene, const std::string& from, const fs::path& asked,
                                          ProgressSink& progress) {
  const fs::path folder = SilhouetteFolder(scene, from, asked);
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
  const fs::path record = IsMeshFile(from) ? fs::path() : FiguresPath(scene.folder, from);
  const auto hull = fs::exists(record, error) ? JsonKeys::Parse(ReadText(record)) : std::nullopt;
  if (hull)
    for (const HullSummary::LeftOut& left : hull->As<HullFigures>().hull.left_out)
      std::erase_if(views, [&](const SilhouetteView& v) { return v.name == left.name; });
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
SimplifiedFit Judge(const Mesh& before, const Mesh& after, const std::vector<SilhouetteView>& views,
                    double pixels_per_unit) {
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

TradeoffTable TableOf(const std::vector<SimplifyTradeoffRow>& rows) {
  using Row = SimplifyTradeoffRow;
  using enum TradeoffRole;
  const auto fit = [](std::optional<double> SimplifiedFit::*member) {
    return [=](const Row& r) { return r.fit.*member; };
  };
  const auto covered = [](double SilhouetteFitSummary::*member) {
    return [=](const Row& r) { return r.fit.silhouettes ? std::optional((*r.fit.silhouettes).*member) : std::nullopt; };
  };
  return TradeoffTableOf<Row>(
      {{{"method", kSetting, "method", -10}, &Row::method},
       {{"wanted", kSetting}, &Row::wanted},
       {{"", kSetting, "faces", 8}, [](const Row& r) { return r.failed.empty() ? r.faces : r.wanted; }},
       {{"faces"}, &Row::faces},
       {{"seconds", kFigure, "seconds", 8, "{:.2f}"}, &Row::seconds},
       {{"coverage_min", kFigure, "coverage", 9, "{:.2f}%"}, covered(&SilhouetteFitSummary::coverage_min)},
       {{"deepest_uncovered_px", kFigure, "deepest", 9, "{:.1f} px"},
        covered(&SilhouetteFitSummary::deepest_uncovered_px)},
       {{"iou_min", kFigure, "IoU min", 8, "{:.4f}"}, covered(&SilhouetteFitSummary::iou_min)},
       {{"iou_median", kMoreIsBetter, "IoU med", 8, "{:.4f}"}, covered(&SilhouetteFitSummary::iou_median)},
       {{"volume_ratio"}, fit(&SimplifiedFit::volume_ratio)},
       {{"mean_distance_px", kLessIsBetter, "mean px", 8, "{:.2f}"},
        [](const Row& r) { return r.fit.mean_distance_px; }},
       {{"max_distance_px", kFigure, "max px", 8, "{:.1f}"}, [](const Row& r) { return r.fit.max_distance_px; }},
       {{"psnr_mean_db", kMoreIsBetter, "PSNR dB", 9, "{:.2f}"}, &Row::psnr_db},
       {{"ms_per_frame", kFigure, "ms", 8, "{:.1f}"}, &Row::ms_per_frame},
       {{"reached"}, &Row::reached},
       {{"failed", kFailed}, &Row::failed},
       {{"", kRemark},
        [](const Row& r) { return r.reached ? std::string() : fmt::format("(of {} wanted)", r.wanted); }}},
      rows);
}

std::vector<Plot> PanelsOf(const TradeoffTable& table, const std::string& from) {
  std::vector<Plot> plots;
  const auto panel = [&](const char* title, const char* x, const PlotAxis& x_axis, const char* y,
                         const PlotAxis& y_axis) {
    const bool line = x_axis.log;
    Plot plot = PlotOf(table, {title,
                               "simplified from " + from,
                               x,
                               x_axis,
                               y,
                               y_axis,
                               {{"quadric", "quadric", "#1f6feb", Marker::kCircle, line},
                                {"in-pixels", "in-pixels", "#15803d", Marker::kCircle, line},
                                {"keep-hull", "keep-hull", "#be123c", Marker::kCircle, line},
                                {"all", "all", "#444444"}},
                               "method",
                               "faces"});
    if (!plot.series.empty()) plots.push_back(std::move(plot));
  };
  const PlotAxis faces{"faces", true};
  panel("Distance to what it was made from", "faces", faces, "mean_distance_px",
        {"mean distance, px of the median view", true});
  panel("Overlap with the silhouettes", "faces", faces, "iou_median", {"intersection over union, median"});
  panel("Held-out photos", "ms_per_frame", {"milliseconds a frame"}, "psnr_mean_db", {"PSNR, dB"});
  return plots;
}

// As in the file.
JsonKeys TradeoffKeysOf(SimplifyTradeoff t) {
  JsonKeys j;
  j("from", t.from, "points", t.rows, "csv", t.files.csv, "svg", t.files.svg, "json", t.files.json);
  return j;
}

}  // namespace

Made<SimplifyFigures> RunSimplify(const SimplifyRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  if (request.faces < 1) throw UsageError("--faces must be at least 1");
  const Scene opened = OpenForProxy(target.scene, progress);
  const std::string from = SourceOf(opened, request.from);
  const Mesh before = LoadProxy(opened, from);
  if (request.keep_hull && request.in_pixels) throw UsageError("--keep-hull and --in-pixels exclude each other");
  const SimplifyMethod method = request.keep_hull   ? SimplifyMethod::kKeepHull
                                : request.in_pixels ? SimplifyMethod::kInPixels
                                                    : SimplifyMethod::kQuadric;
  ProxyTarget named = target;
  if (named.name.empty())
    named.name = fmt::format("{}-{}{}", NameOf(from), request.faces, request.keep_hull ? "-kept" : "");
  if (named.name == from && named.output.empty())
    throw UsageError("--name " + from + " is the proxy that is simplified", "choose another name");
  const fs::path silhouettes = SilhouetteFolder(opened, from, request.silhouettes);
  std::map<std::string, std::string> options{
      {"faces", std::to_string(request.faces)}, {"method", Name(method)}, {"from", from}};
  if (request.in_pixels) options["small_parts"] = "may go";
  std::optional<SimplifyFigures> figures;
  Made<SimplifyFigures> made{
      MakeProxy(named, "simplify", std::move(options),
                {{"from", Fingerprint(ProxyFile(opened, from))}, {"silhouettes", Fingerprint(silhouettes)}}, progress,
                [&](const Scene& scene) -> BuiltProxy {
                  SimplifiedMesh simple = std::move(Simplify(before, {static_cast<std::size_t>(request.faces)}, method,
                                                             progress, MakeProxyViews(scene))
                                                        .front());
                  const std::vector<SilhouetteView> views = SilhouettesOf(scene, from, request.silhouettes, progress);
                  figures = SimplifyFigures{from,
                                            Name(method),
                                            request.faces,
                                            before.faces.size(),
                                            simple.reached,
                                            simple.wrapped,
                                            simple.removed_parts,
                                            simple.seconds,
                                            Judge(before, simple.mesh, views, PixelsPerUnit(scene, before))};
                  if (!simple.reached)
                    progress.Message(
                        FacesLeft(simple.mesh.faces.size(), static_cast<std::size_t>(request.faces), method));
                  if (const std::size_t missed = figures->fit.views_missed.size(); request.keep_hull && missed > 0)
                    progress.Message(
                        fmt::format("warning: {} silhouettes are not covered to {:g} % and {:g} px; so it was with {}?",
                                    missed, 100 * kLeastCoverage, kDeepestUncoveredPx, from));
                  return {std::move(simple.mesh), *figures};
                }),
      figures};
  if (named.output.empty()) TakeFigures(opened.folder, made);
  return made;
}

SimplifyTradeoff RunSimplifyTradeoff(const SimplifyTradeoffRequest& request, ProgressSink& progress) {
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
  std::optional<HeldOutBench> bench;
  if (request.render && photos >= 3)
    bench.emplace(scene.folder, photos > request.holdout / 2 ? request.holdout : 2, request.width_px);

  std::vector<std::size_t> counts;
  for (const int n : request.faces)
    if (n > 0 && static_cast<std::size_t>(n) < before.faces.size()) counts.push_back(static_cast<std::size_t>(n));
  std::vector<SimplifyMethod> methods = {SimplifyMethod::kQuadric, SimplifyMethod::kInPixels};
  const std::vector<ProxyView> cameras = MakeProxyViews(scene);
  if (IsClosed(before)) methods.push_back(SimplifyMethod::kKeepHull);
  SimplifyTradeoff t{from, before.faces.size(), IsClosed(before), 0, {}, {}};
  Progress steps(progress, "measuring simplified proxies", static_cast<long>(counts.size() * methods.size()) + 1);
  const auto measure = [&](const std::string& method, std::size_t wanted, const SimplifiedMesh& simple) {
    SimplifyTradeoffRow row{method,
                            wanted,
                            {},
                            simple.mesh.faces.size(),
                            simple.seconds,
                            simple.reached,
                            Judge(before, simple.mesh, views, pixels_per_unit),
                            {},
                            {}};
    if (bench) {
      WriteMesh(bench->folder() / "proxies" / "measured.ply", simple.mesh);
      const HeldOutBench::Figures figures = bench->Measure("measured");
      row.psnr_db = figures.psnr_db;
      row.ms_per_frame = figures.ms_per_frame;
    }
    t.rows.push_back(std::move(row));
    steps.Step();
  };
  const auto fail = [&](SimplifyMethod method, std::size_t wanted, const char* why) {
    t.rows.push_back({Name(method), wanted, why, 0, 0, true, {}, {}, {}});
    steps.Step();
  };
  for (const SimplifyMethod method : methods) {
    // One run for all where it can be had: each number of faces is passed on the way to the fewest.
    std::vector<SimplifiedMesh> together;
    try {
      together = Simplify(before, counts, method, progress, cameras);
    } catch (const DataError&) {
    } catch (const UsageError&) {
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      CheckInterrupted();
      try {
        measure(Name(method), counts[i],
                together.empty() ? Simplify(before, {counts[i]}, method, progress, cameras).front() : together[i]);
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

  const fs::path stem = scene.folder / "tradeoff" / ("simplify-" + NameOf(from));
  t.files = {stem.string() + ".json", stem.string() + ".csv", stem.string() + ".svg"};
  const TradeoffTable table = TableOf(t.rows);
  const FolderLock lock(scene.folder);
  WriteTradeoff(stem, table, PanelsOf(table, from), TradeoffKeysOf(t).Text(2) + "\n");
  t.seconds = SecondsSince(start);
  return t;
}

void ListKeys(JsonKeys& j, SimplifyTradeoff& t) {
  j("name", t.from, "faces", t.faces, "closed", t.closed, "seconds", t.seconds).Say("tradeoff", TradeoffKeysOf(t));
}

std::string Describe(const SimplifyTradeoff& t) {
  return TextOf(TableOf(t.rows)) + fmt::format("\n{}, {}, {}; {:.0f} s", t.files.csv.string(), t.files.svg.string(),
                                               t.files.json.string(), t.seconds);
}

}  // namespace lumi
