#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>

#include "proxy/box/box_proxy.h"
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/sibling.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kSummaryFile = "proxies/auto.json";  // the table, for a run that has nothing to do

constexpr int kMostPhotos = 10;  // that the choice is made on: more take their time and change little

// A kind of proxy that is tried: the name that it is kept under, why this scene does not call for it (or empty), how it
// is made.
struct Recipe {
  std::string name, kind;
  std::function<std::string(const Scene&)> unfit;
  std::function<ProxySummary(const ProxyTarget&, ProgressSink&)> run;
};

// Walls on at least three sides that hold half of the points, twice as long as wide, along which the cameras travel:
// anything less a box shows worse than what goes through the points.
std::string UnfitForBox(const Scene& scene) {
  constexpr double kOnWalls = 0.5, kOnAWall = 0.05, kTravel = 1, kLong = 2;
  BoxSummary s;
  try {
    BuildBoxProxy(scene, {}, &s);
  } catch (const DataError& e) {
    return e.what();
  }
  const auto walls = std::ranges::count_if(
      s.wall_points, [&](std::size_t n) { return static_cast<double>(n) >= kOnAWall * static_cast<double>(s.points); });
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const View& view : scene.views) {
    const double along = s.box_from_world.row(2).dot(view.CentreInWorld());
    first = std::min(first, along);
    last = std::max(last, along);
  }
  const Eigen::Vector3d size = s.high - s.low;
  if (walls < 3 || static_cast<double>(s.points_on_walls) < kOnWalls * static_cast<double>(s.points))
    return fmt::format(
        "no tube: {:.0f} % of the points lie on {} walls",
        100.0 * static_cast<double>(s.points_on_walls) / std::max<double>(1, static_cast<double>(s.points)), walls);
  if (size.z() < kLong * size.head<2>().maxCoeff()) return "no tube: it would be hardly longer than wide";
  if (last - first < kTravel * size.head<2>().minCoeff()) return "the cameras do not travel along a tube";
  return {};
}

const std::vector<Recipe>& Recipes() {
  const auto always = [](const Scene&) { return std::string(); };
  // A kind of proxy that is made of another one (a simplified hull) comes after it.
  static const std::vector<Recipe> recipes = {
      {"plane", "plane", always, RunPlane},
      {"planes", "planes", always, [](const ProxyTarget& t, ProgressSink& p) { return RunPlanes(t, {}, p); }},
      {"box", "box", UnfitForBox,
       [](const ProxyTarget& t, ProgressSink& p) { return RunBox(t, BoxOptions().sides, p); }},
      {"mesh", "delaunay", always,
       [](const ProxyTarget& t, ProgressSink& p) { return RunDelaunay(t, DelaunayOptions().merge_px, p); }},
      {"moving", "moving", UnfitForMoving, [](const ProxyTarget& t, ProgressSink& p) { return RunMoving(t, {}, p); }},
      {"hull", "hull",
       [](const Scene& scene) {
         std::error_code error;
         return fs::exists(scene.folder / "silhouettes", error)
                    ? std::string()
                    : std::string("there are no silhouettes: lumi-proxy silhouettes makes some");
       },
       [](const ProxyTarget& t, ProgressSink& p) { return RunHull({}, t, p); }},
      {"hull-500", "simplify",
       [](const Scene& scene) {
         std::error_code error;
         return fs::exists(ProxyPath(scene.folder, "hull"), error) ? std::string()
                                                                   : std::string("there is no hull to simplify");
       },
       [](const ProxyTarget& t, ProgressSink& p) {
         return RunSimplify({.faces = 500, .from = "hull", .keep_hull = true, .silhouettes = {}}, t, p);
       }},
  };
  return recipes;
}

// A proxy of that name and kind made of the same cameras and points, whatever its options: somebody's choice, which
// stays.
bool MadeBefore(const Scene& scene, const Recipe& recipe) {
  std::error_code error;
  if (!fs::exists(ProxyPath(scene.folder, recipe.name), error)) return false;
  const auto record = RecordOf(scene, recipe.name);
  if (!record || !record->options.contains("kind") || !record->inputs.contains("sparse")) return false;
  return record->options.at("kind") == recipe.kind &&
         record->inputs.at("sparse") == Fingerprint(scene.folder / "sparse");
}

ProxyCandidate Make(const Scene& scene, const std::string& name, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  ProxyCandidate c;
  c.name = name;
  const auto recipe = std::find_if(Recipes().begin(), Recipes().end(), [&](const Recipe& r) { return r.name == name; });
  try {
    if (recipe == Recipes().end() || MadeBefore(scene, *recipe)) {
      const Mesh mesh = LoadProxy(scene, name);
      c.faces = mesh.faces.size();
      c.closed = IsClosed(mesh);
    } else if (c.refused = recipe->unfit(scene); c.refused.empty()) {
      const ProxySummary made = recipe->run({scene.folder, name, {}, false}, progress);
      c.faces = made.faces;
      c.closed = made.closed;
    }
    c.made = c.refused.empty();
  } catch (const Error& e) {
    // What the data do not allow, or a file of that name that is somebody's own: a row of the table. Else the run ends.
    if (e.code() != ExitCode::kDataRefused && e.code() != ExitCode::kUsage && e.code() != ExitCode::kCorruptInput)
      throw;
    c.refused = e.what();
  }
  c.build_s = SecondsSince(start);
  return c;
}

// What lumi-render says of held-out photos.
struct HoldoutErrors {
  std::optional<double> psnr_db, ssim, coverage, ms, psnr_object_db;
};
void ListKeys(JsonKeys& j, HoldoutErrors& e) {
  j("psnr_mean_db", e.psnr_db, "ssim_mean", e.ssim, "coverage", e.coverage, "ms_per_frame", e.ms, "psnr_object_mean_db",
    e.psnr_object_db);
}

void Measure(const Scene& scene, const AutoOptions& options, int holdout, ProxyCandidate& c) {
  const auto start = std::chrono::steady_clock::now();
  const TemporaryFolder folder;
  HoldoutErrors errors;
  try {
    errors =
        RunSibling({"lumi-render",
                    {scene.folder.string(), "-o", (folder.path() / "frames").string(), "--proxy", c.name, "--holdout",
                     std::to_string(holdout), "--fold", "choose", "--width", std::to_string(options.choose_width_px)},
                    {},
                    {}},
                   SilentProgress())
            .summary.As<HoldoutErrors>();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    c.refused = e.what();
  }
  c.measure_s = SecondsSince(start);
  if (!c.refused.empty()) return;
  if (!errors.psnr_db || !errors.ssim || !errors.coverage || !errors.ms)
    throw MachineError("lumi-render gave no figures for proxy " + c.name, "is it of the same version as this program?");
  c.psnr_db = errors.psnr_db;
  c.ssim = errors.ssim;
  c.coverage = errors.coverage;
  c.ms = errors.ms;
  c.psnr_object_db = errors.psnr_object_db;
}

// Who gave silhouettes is after the object: around it a hull shows nothing, and holes count as black.
double Score(const ProxyCandidate& c) { return c.psnr_object_db ? *c.psnr_object_db : *c.psnr_db; }

// The best of those within the budget, and why; of equals the one with fewer faces. Where nothing is within it, the
// fastest.
std::pair<const ProxyCandidate*, std::string> Choose(const AutoTable& table, std::optional<double> budget_ms) {
  const ProxyCandidate* best = nullptr;
  const ProxyCandidate* fastest = nullptr;
  const ProxyCandidate* last = nullptr;
  std::size_t made = 0, measured = 0;
  for (const ProxyCandidate& c : table.candidates) {
    if (!c.refused.empty()) continue;
    ++made;
    if (!last || last->name != "mesh") last = &c;
    if (!c.psnr_db) continue;
    ++measured;
    if (!fastest || *c.ms < *fastest->ms) fastest = &c;
    if (budget_ms && *c.ms > *budget_ms) continue;
    const double ahead = best ? Score(c) - Score(*best) : 1;
    if (ahead > 0 || (ahead == 0 && c.faces < best->faces)) best = &c;
  }
  // Nothing to go by: what goes through the points, or the last that there is, which is the most elaborate.
  if (measured == 0) return {last, made == 1 ? "the only one that can be made" : table.unmeasured};
  if (!best) return {fastest, fmt::format("none is within {:g} ms a frame: the fastest", *budget_ms)};
  std::string reason =
      measured == 1 && made == 1 ? "the only one that can be made" : "the smallest error on " + table.fold;
  if (budget_ms) reason += fmt::format(" within {:g} ms a frame", *budget_ms);
  return {best, reason};
}

AutoSummary Chosen(AutoTable table, const AutoOptions& options) {
  AutoSummary s;
  const auto [choice, reason] = Choose(table, options.budget_ms);
  s.name = choice->name;
  s.reason = reason;
  s.faces = choice->faces;
  s.closed = choice->closed;
  s.budget_ms = options.budget_ms;
  s.table = std::move(table);
  return s;
}

std::vector<std::string> Wanted(const Scene& scene, const AutoOptions& options) {
  if (options.candidates.empty()) {
    std::vector<std::string> names;
    for (const Recipe& r : Recipes()) names.push_back(r.name);
    return names;
  }
  const std::vector<std::string> there = ListProxies(scene.folder);
  std::vector<std::string> names;
  for (const std::string& name : options.candidates) {
    const bool known = std::any_of(Recipes().begin(), Recipes().end(), [&](const Recipe& r) { return r.name == name; });
    if (!known && std::ranges::find(there, name) == there.end()) {
      std::string made;
      for (const Recipe& r : Recipes()) made += (made.empty() ? "" : ", ") + r.name;
      throw UsageError("\"" + name + "\" is no candidate", "one of " + made + ", or a proxy that the scene has");
    }
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace

AutoSummary RunAuto(const AutoOptions& options, ProgressSink& progress) {
  if (options.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (options.choose_width_px < 16) throw UsageError("--choose-width must be at least 16");
  if (options.budget_ms && !(*options.budget_ms > 0)) throw UsageError("--budget-ms must be above 0");
  const auto start = std::chrono::steady_clock::now();
  Scene scene = OpenForProxy(options.scene, progress);
  RequireKeepsProxies(scene);
  const std::vector<std::string> names = Wanted(scene, options);

  Provenance wanted = ProxyProvenance(scene, "auto", "auto",
                                      {{"choose_width", std::to_string(options.choose_width_px)},
                                       {"holdout", std::to_string(options.holdout)},
                                       {"candidates", fmt::format("{}", fmt::join(names, ","))}});
  wanted.inputs["images"] = Fingerprint(scene.image_folder);
  wanted.inputs["silhouettes"] = Fingerprint(scene.folder / "silhouettes");
  if (IsUpToDate(scene.folder, wanted)) {
    // Measured already: a budget only chooses among what is there.
    const FolderLock lock(scene.folder);
    const auto table = JsonKeys::Parse(ReadText(scene.folder / kSummaryFile));
    if (!table)
      throw InputError(scene.folder / kSummaryFile, "is no JSON object",
                       "remove it, and what was measured is measured again");
    AutoSummary s = Chosen(table->As<AutoTable>(), options);
    Activate(scene, s.name);
    s.table.reused = true;
    s.seconds = SecondsSince(start);
    return s;
  }

  // With fewer photos than N the fold for choosing would be empty: every photo's number then is in one fold of two.
  const int views = static_cast<int>(scene.views.size());
  int holdout = views > options.holdout / 2 ? options.holdout : 2;
  // An odd multiple of N keeps clear of 0, N, 2N ..., which quality is reported on.
  for (const int n = holdout; views / holdout > kMostPhotos; holdout += 2 * n) {
  }
  std::vector<ProxyCandidate> candidates;
  {
    Progress steps(progress, "making proxies", static_cast<long>(names.size()));
    for (const std::string& name : names) {
      candidates.push_back(Make(scene, name, progress));
      steps.Step();
    }
  }
  const auto made = std::ranges::count_if(candidates, [](const ProxyCandidate& c) { return c.made; });
  if (made == 0)
    throw DataError("no proxy can be made: " + candidates.front().refused, "reconstruct from more photos that overlap");
  if (views >= 3 && made > 1) {
    Progress steps(progress, "choosing a proxy", static_cast<long>(made));
    for (ProxyCandidate& c : candidates) {
      if (!c.made) continue;
      Measure(scene, options, holdout, c);
      steps.Step();
    }
    if (std::ranges::none_of(candidates, [](const ProxyCandidate& c) { return c.psnr_db.has_value(); })) {
      const auto first = std::ranges::find_if(candidates, [](const ProxyCandidate& c) { return c.made; });
      throw MachineError("lumi-render can measure no proxy: " + first->refused, "", scene.folder);
    }
  }

  const FolderLock lock(scene.folder);
  AutoTable table{holdout,
                  options.choose_width_px,
                  "too few photos to leave one out",
                  fmt::format("photos {}, {} ... left out", holdout / 2, holdout / 2 + holdout),
                  candidates,
                  false};
  WriteTextAtomically(scene.folder / kSummaryFile, JsonKeys(table).Text(2) + "\n");
  AutoSummary s = Chosen(std::move(table), options);
  // The first that was made has become the active one meanwhile.
  scene.active_proxy = OpenForProxy(options.scene, progress).active_proxy;
  Activate(scene, s.name);
  wanted.outputs[kSummaryFile] = Fingerprint(scene.folder / kSummaryFile);
  for (const ProxyCandidate& c : candidates) {
    if (!c.made) continue;
    const fs::path path = ProxyPath(scene.folder, c.name);
    wanted.outputs[path.lexically_relative(scene.folder).string()] = Fingerprint(path);
  }
  wanted.seconds = SecondsSince(start);
  WriteProvenance(scene.folder, wanted);
  s.seconds = SecondsSince(start);
  return s;
}

}  // namespace lumi
