#include <fmt/format.h>

#include <algorithm>
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
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/tradeoff/held_out.h"
#include "scene/tradeoff/json_rows.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr double kLeastCoverage = 0.995, kDeepestUncoveredPx = 2;  // what a hull promises of every silhouette used

Scene OpenToSimplify(const fs::path& path, ProgressSink& progress) {
  OpenOptions options;
  options.check_photos = false;
  Scene scene = OpenScene(path, options, progress);
  RequireMetric(scene, "a proxy");
  return scene;
}

OrderedJson RecordOf(const Scene& scene, const std::string& proxy) {
  const fs::path record = scene.folder / "provenance" / ("proxy-" + proxy + ".json");
  std::error_code error;
  if (!fs::exists(record, error)) return {};
  try {
    return OrderedJson::parse(ReadText(record));
  } catch (const nlohmann::json::exception&) {
    return {};  // no record is no reason to stop
  }
}

std::string OptionOf(const OrderedJson& record, const char* key) {
  return record.contains("options") && record["options"].contains(key) ? record["options"][key].get<std::string>() : "";
}

// What is simplified: a proxy that is itself the outcome stands for what it was made from, so that a second run has nothing to do.
std::string SourceOf(const Scene& scene, const std::string& asked) {
  if (!asked.empty()) return asked;
  if (scene.active_proxy.empty()) throw UsageError(scene.folder.string() + " has no active proxy", "name one: --from NAME");
  const OrderedJson record = RecordOf(scene, scene.active_proxy);
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
  if (fs::exists(record, error)) {
    const OrderedJson hull = OrderedJson::parse(ReadText(record));
    if (hull.contains("views_left_out"))
      for (const OrderedJson& left : hull["views_left_out"])
        std::erase_if(views, [&](const SilhouetteView& v) { return v.name == left.value("name", ""); });
  }
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
OrderedJson Judge(const Mesh& before, const Mesh& after, const std::vector<SilhouetteView>& views, double pixels_per_unit) {
  const Soundness sound = CheckSoundness(after);
  const Deviation deviation = MeasureDeviation(before, after);
  OrderedJson j{{"mean_distance_px", deviation.mean * pixels_per_unit}, {"max_distance_px", deviation.max * pixels_per_unit},
                {"sound", sound.manifold && sound.degenerate_faces == 0 && (!sound.closed || sound.outward)}, {"soundness", sound.Describe()},
                {"parts", sound.parts}, {"intersects_itself", sound.manifold && IntersectsItself(after)}};
  if (sound.closed && IsClosed(before)) {
    j["volume"] = EnclosedVolume(after);
    j["volume_ratio"] = EnclosedVolume(after) / EnclosedVolume(before);
  }
  j["coverage_min"] = j["iou_min"] = j["iou_median"] = j["deepest_uncovered_px"] = nullptr;
  if (views.empty() || !sound.closed) return j;
  const std::vector<SilhouetteFit> fits = MeasureSilhouettes(after, views);
  const SilhouetteFitSummary fit = Summarize(fits);
  j["coverage_min"] = fit.coverage_min;
  j["iou_min"] = fit.iou_min;
  j["iou_median"] = fit.iou_median;
  j["deepest_uncovered_px"] = fit.deepest_uncovered_px;
  j["views_used"] = views.size();
  j["views_missed"] = OrderedJson::array();
  for (std::size_t v = 0; v < views.size(); ++v)
    if (fits[v].coverage < kLeastCoverage || fits[v].deepest_uncovered_px > kDeepestUncoveredPx)
      j["views_missed"].push_back({{"name", views[v].name}, {"coverage", fits[v].coverage}, {"deepest_uncovered_px", fits[v].deepest_uncovered_px}});
  return j;
}

std::string Number(const OrderedJson& j, const char* key, const char* format, double factor = 1) {
  return j.contains(key) && j[key].is_number() ? fmt::format(fmt::runtime(format), factor * j[key].get<double>()) : "-";
}

// Of the rows as RunSimplifyTradeoff's summary has them.
TradeoffTable TableOf(const OrderedJson& points) {
  using enum TradeoffRole;
  return TradeoffTableOf<OrderedJson>(
      {FromJson<OrderedJson>({"method", kSetting, "method", -10}), FromJson<OrderedJson>({"wanted", kSetting}),
       {{"", kSetting, "faces", 8}, [](const OrderedJson& p) { return p[p.contains("failed") ? "wanted" : "faces"].get<int>(); }},
       FromJson<OrderedJson>({"faces"}), FromJson<OrderedJson>({"seconds", kFigure, "seconds", 8, "{:.2f}"}),
       FromJson<OrderedJson>({"coverage_min", kFigure, "coverage", 9, "{:.2f}%"}), FromJson<OrderedJson>({"deepest_uncovered_px", kFigure, "deepest", 9, "{:.1f} px"}),
       FromJson<OrderedJson>({"iou_min", kFigure, "IoU min", 8, "{:.4f}"}), FromJson<OrderedJson>({"iou_median", kMoreIsBetter, "IoU med", 8, "{:.4f}"}),
       FromJson<OrderedJson>({"volume_ratio"}), FromJson<OrderedJson>({"mean_distance_px", kLessIsBetter, "mean px", 8, "{:.2f}"}),
       FromJson<OrderedJson>({"max_distance_px", kFigure, "max px", 8, "{:.1f}"}), FromJson<OrderedJson>({"psnr_mean_db", kMoreIsBetter, "PSNR dB", 9, "{:.2f}"}),
       FromJson<OrderedJson>({"ms_per_frame", kFigure, "ms", 8, "{:.1f}"}), FromJson<OrderedJson>({"reached"}), FromJson<OrderedJson>({"failed", kFailed}),
       {{"", kRemark}, [](const OrderedJson& p) {
          return p.value("reached", true) ? std::string() : fmt::format("(of {} wanted)", p["wanted"].get<std::size_t>());
        }}},
      points.get<std::vector<OrderedJson>>());
}

std::vector<Plot> PanelsOf(const TradeoffTable& table, const std::string& from) {
  std::vector<Plot> plots;
  const auto panel = [&](const char* title, const char* x, const PlotAxis& x_axis, const char* y, const PlotAxis& y_axis) {
    const bool line = x_axis.log;
    Plot plot = PlotOf(table, {title, "simplified from " + from, x, x_axis, y, y_axis,
                               {{"quadric", "quadric", "#1f6feb", Marker::kCircle, line},
                                {"keep-hull", "keep-hull", "#be123c", Marker::kCircle, line},
                                {"all", "all", "#444444"}}, "method", "faces"});
    if (!plot.series.empty()) plots.push_back(std::move(plot));
  };
  const PlotAxis faces{"faces", true};
  panel("Distance to what it was made from", "faces", faces, "mean_distance_px", {"mean distance, px of the median view", true});
  panel("Overlap with the silhouettes", "faces", faces, "iou_median", {"intersection over union, median"});
  panel("Held-out photos", "ms_per_frame", {"milliseconds a frame"}, "psnr_mean_db", {"PSNR, dB"});
  return plots;
}

}  // namespace

std::string RunSimplify(const SimplifyRequest& request, const ProxyTarget& target, ProgressSink& progress) {
  if (request.faces < 1) throw UsageError("--faces must be at least 1");
  const Scene opened = OpenToSimplify(target.scene, progress);
  const std::string from = SourceOf(opened, request.from);
  const Mesh before = LoadProxy(opened, from);
  const SimplifyMethod method = request.keep_hull ? SimplifyMethod::kKeepHull : SimplifyMethod::kQuadric;
  ProxyTarget named = target;
  if (named.name.empty()) named.name = fmt::format("{}-{}{}", from, request.faces, request.keep_hull ? "-kept" : "");
  if (named.name == from && named.output.empty()) throw UsageError("--name " + from + " is the proxy that is simplified", "choose another name");
  const fs::path silhouettes = request.silhouettes.empty() ? opened.folder / "silhouettes" : request.silhouettes;
  OrderedJson made;
  OrderedJson json = OrderedJson::parse(
      MakeProxy(named, "simplify", {{"faces", std::to_string(request.faces)}, {"method", Name(method)}, {"from", from}},
                {{"from", Fingerprint(ProxyPath(opened.folder, from))}, {"silhouettes", Fingerprint(silhouettes)}}, progress, [&](const Scene& scene, OrderedJson&) {
        SimplifiedMesh simple = std::move(Simplify(before, {static_cast<std::size_t>(request.faces)}, method, progress).front());
        const std::vector<SilhouetteView> views = SilhouettesOf(scene, from, request.silhouettes, progress);
        made = OrderedJson{{"from", from}, {"method", Name(method)}, {"wanted", request.faces}, {"faces_before", before.faces.size()},
                           {"reached", simple.reached}, {"wrapped", simple.wrapped}, {"simplify_s", simple.seconds}};
        made.update(Judge(before, simple.mesh, views, PixelsPerUnit(scene, before)));
        if (!simple.reached) progress.Message(fmt::format("warning: {} faces are left, no edge may be collapsed any more", simple.mesh.faces.size()));
        if (request.keep_hull && made.contains("views_missed") && !made["views_missed"].empty())
          progress.Message(fmt::format("warning: {} silhouettes are not covered to {:g} % and {:g} px; so it was with {}?", made["views_missed"].size(),
                                       100 * kLeastCoverage, kDeepestUncoveredPx, from));
        return std::move(simple.mesh);
      }));
  if (named.output.empty()) {
    const fs::path record = ProxyPath(opened.folder, named.name).replace_extension(".json");
    std::error_code error;
    if (!made.empty()) WriteTextAtomically(record, made.dump(2) + "\n");
    else if (fs::exists(record, error)) made = OrderedJson::parse(ReadText(record));
  }
  json.update(made);
  return json.dump();
}

std::string RunSimplifyTradeoff(const SimplifyTradeoffRequest& request, ProgressSink& progress) {
  if (request.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (request.width_px < 16) throw UsageError("--choose-width must be at least 16");
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = OpenToSimplify(request.scene, progress);
  RequireKeepsProxies(scene);
  const std::string from = SourceOf(scene, request.from);
  const Mesh before = LoadProxy(scene, from);
  const std::vector<SilhouetteView> views = SilhouettesOf(scene, from, request.silhouettes, progress);
  const double pixels_per_unit = PixelsPerUnit(scene, before);
  const int photos = static_cast<int>(scene.views.size());
  std::optional<HeldOutBench> bench;
  if (request.render && photos >= 3) bench.emplace(scene.folder, photos > request.holdout / 2 ? request.holdout : 2, request.width_px);

  std::vector<std::size_t> counts;
  for (const int n : request.faces)
    if (n > 0 && static_cast<std::size_t>(n) < before.faces.size()) counts.push_back(static_cast<std::size_t>(n));
  std::vector<SimplifyMethod> methods = {SimplifyMethod::kQuadric};
  if (IsClosed(before)) methods.push_back(SimplifyMethod::kKeepHull);
  OrderedJson points = OrderedJson::array();
  Progress steps(progress, "measuring simplified proxies", static_cast<long>(counts.size() * methods.size()) + 1);
  const auto measure = [&](const std::string& method, std::size_t wanted, const SimplifiedMesh& simple) {
    OrderedJson p{{"method", method}, {"wanted", wanted}, {"faces", simple.mesh.faces.size()}, {"seconds", simple.seconds}, {"reached", simple.reached}};
    p.update(Judge(before, simple.mesh, views, pixels_per_unit));
    p["psnr_mean_db"] = p["ms_per_frame"] = nullptr;
    if (bench) {
      WriteMesh(bench->folder() / "proxies" / "measured.ply", simple.mesh);
      const HeldOutBench::Figures figures = bench->Measure("measured");
      p["psnr_mean_db"] = figures.psnr_db;
      p["ms_per_frame"] = figures.ms_per_frame;
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

  const fs::path stem = scene.folder / "tradeoff" / ("simplify-" + from);
  OrderedJson t{{"from", from}, {"points", points}};
  for (const char* kind : {"csv", "svg", "json"}) t[kind] = stem.string() + "." + kind;
  const TradeoffTable table = TableOf(points);
  const FolderLock lock(scene.folder);
  WriteTradeoff(stem, table, PanelsOf(table, from), t.dump(2) + "\n");
  const OrderedJson json{{"name", from}, {"faces", before.faces.size()}, {"closed", IsClosed(before)}, {"seconds", SecondsSince(start)}, {"tradeoff", t}};
  return json.dump();
}

std::string DescribeSimplified(const std::string& text) {
  const OrderedJson json = OrderedJson::parse(text);
  if (json.contains("tradeoff")) {
    const OrderedJson& t = json["tradeoff"];
    return TextOf(TableOf(t["points"])) + fmt::format("\n{}, {}, {}; {:.0f} s", t["csv"].get<std::string>(), t["svg"].get<std::string>(), t["json"].get<std::string>(), json["seconds"].get<double>());
  }
  std::string out = fmt::format("{}: {} faces of {}'s {}, {}, {:.2f} s{}\n{}", json["file"].get<std::string>(), json["faces"].get<std::size_t>(), json.value("from", "?"),
                                json.value("faces_before", std::size_t{0}), json.value("method", "?"), json["seconds"].get<double>(),
                                json["reused"].get<bool>() ? " (nothing had changed)" : "", json.value("soundness", ""));
  if (json.value("intersects_itself", false)) out += ", runs through itself";
  if (json.contains("volume_ratio")) out += fmt::format("; volume {:.4f} of what it was", json["volume_ratio"].get<double>());
  out += fmt::format("\ndistance {} px in the mean, {} px at most", Number(json, "mean_distance_px", "{:.2f}"), Number(json, "max_distance_px", "{:.1f}"));
  if (json.contains("views_missed")) {
    out += fmt::format("\n{} silhouettes: covered {} at least, deepest uncovered pixel {} px; intersection over union {} median, {} least", json["views_used"].get<std::size_t>(),
                       Number(json, "coverage_min", "{:.2f} %", 100), Number(json, "deepest_uncovered_px", "{:.1f}"), Number(json, "iou_median", "{:.4f}"), Number(json, "iou_min", "{:.4f}"));
    std::vector<OrderedJson> missed(json["views_missed"].begin(), json["views_missed"].end());
    std::stable_sort(missed.begin(), missed.end(), [](const OrderedJson& a, const OrderedJson& b) { return a["coverage"].get<double>() < b["coverage"].get<double>(); });
    if (!missed.empty()) out += fmt::format("\n{} silhouettes not covered to {:g} % and {:g} px, the worst:", missed.size(), 100 * kLeastCoverage, kDeepestUncoveredPx);
    for (std::size_t i = 0; i < std::min<std::size_t>(3, missed.size()); ++i)
      out += fmt::format("\nnot covered: {}, {:.2f} %, {:.1f} px deep", missed[i]["name"].get<std::string>(), 100 * missed[i]["coverage"].get<double>(),
                         missed[i]["deepest_uncovered_px"].get<double>());
  } else {
    out += "\nno silhouettes: what it covers of them was not measured";
  }
  return out;
}

}  // namespace lumi
