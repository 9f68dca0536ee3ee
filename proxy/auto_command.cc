#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>

#include "proxy/box/box_proxy.h"
#include "proxy/choose_proxy.h"
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/dense/dense_proxy.h"
#include "proxy/leave_out.h"
#include "proxy/make_proxy.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/filled_in_parts.h"
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
  // Whether the proxy depends on nothing but the photos that are not left out, so that one can be made for an
  // evaluation.
  bool knows_photos = false;
  bool dense = false;  // takes minutes: made of all photos only once it is chosen
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

// `without`: as in AutoTable::evaluated_without; the mesh for use goes on from the depth maps of the one measured.
ProxySummary RunDenseAgreeing(const ProxyTarget& target, int agree, int width_px, int without, ProgressSink& progress) {
  DenseRequest request;
  if (target.leave_out == 0) request.maps_without = without;
  request.dense.fusion.agree = agree;
  request.dense.stereo.width = width_px;
  return RunDense(target, request, progress);
}

// dense_width_px: of the depth maps. A kind of proxy that is made of another one (a simplified hull) comes after it.
std::vector<Recipe> Recipes(int dense_width_px, int without) {
  const auto always = [](const Scene&) { return std::string(); };
  const auto dense = [=](int agree) {
    return
        [=](const ProxyTarget& t, ProgressSink& p) { return RunDenseAgreeing(t, agree, dense_width_px, without, p); };
  };
  return {
      {"plane", "plane", always, RunPlane, true},
      {"planes", "planes", always, [](const ProxyTarget& t, ProgressSink& p) { return RunPlanes(t, {}, p); }, true},
      {"box", "box", UnfitForBox,
       [](const ProxyTarget& t, ProgressSink& p) { return RunBox(t, BoxOptions().sides, p); }, true},
      {"delaunay", "delaunay", always,
       [](const ProxyTarget& t, ProgressSink& p) { return RunDelaunay(t, DelaunayOptions().merge_px, p); }, true},
      {"dense", "dense", always, dense(2), true, true},
      {"dense-strict", "dense", always, dense(3), true, true},
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
         return RunSimplify({.faces = 500, .from = "hull", .keep_hull = true, .in_pixels = false, .silhouettes = {}}, t,
                            p);
       }},
  };
}

const Recipe* Find(const std::vector<Recipe>& recipes, const std::string& name) {
  const auto at = std::ranges::find(recipes, name, &Recipe::name);
  return at == recipes.end() ? nullptr : &*at;
}

// Of what size depth maps are made, or why none are.
struct DensePlan {
  int width_px = 0;
  std::string refused;
};
// evaluated: share of the photos that the proxies know which are measured; 0: none are made beside those for use.
DensePlan PlanDense(const Scene& scene, const AutoOptions& options, double evaluated) {
  if (options.depth_width_px) return {*options.depth_width_px, {}};
  if (options.proxy_minutes == 0.0) return {0, "switched off by --proxy-minutes 0"};
  const bool timed = options.proxy_minutes.has_value();
  // Few of its photos show one moment.
  if (!timed && scene.period_s)
    return {0, "the scene repeats itself: --proxy-minutes or --depth-width asks for depth maps"};
  if (const int usual = UsualStereoWidth(scene); !timed && usual > 0) return {usual, {}};
  double minutes = 0;
  for (const int width : kStereoWidths) {
    StereoOptions stereo;
    stereo.width = width;
    // Depth maps once: those of photos that are left out are added for use. Two meshes that are measured, one for use.
    minutes = (EstimateStereoSeconds(scene, stereo) +
               (evaluated > 0 ? 1 + 2 * evaluated : 2) * EstimateMeshSeconds(scene, width)) /
              60;
    if (timed && minutes <= *options.proxy_minutes) return {width, {}};
  }
  const std::string least =
      fmt::format("depth maps {} pixels wide would take about {:.1f} minutes", kStereoWidths.back(), minutes);
  return {0, timed ? fmt::format("{}, --proxy-minutes allows {:.1f}", least, *options.proxy_minutes)
                   : least + " of so many photos: --proxy-minutes or --depth-width asks for them"};
}

// A proxy of that name and kind made of the same cameras and points and, where it is made of these, photos, masks and
// silhouettes, whatever its options: somebody's choice, which stays.
bool MadeBefore(const Scene& scene, const Recipe& recipe) {
  const auto record = FinishedRecordOf(scene, recipe.name);
  if (!record || !record->options.contains("kind") || !record->inputs.contains("sparse")) return false;
  const auto same = [&](const char* input, const fs::path& path) {
    return !record->inputs.contains(input) || record->inputs.at(input) == Fingerprint(path);
  };
  // A hull's silhouettes may be another folder's.
  const bool own = !record->options.contains("silhouettes");
  return record->options.at("kind") == recipe.kind && same("sparse", scene.folder / "sparse") &&
         same("images", scene.image_folder) && same("masks", scene.folder / "masks") &&
         (!own || same("silhouettes", scene.folder / "silhouettes"));
}

// NAME-without-N where it is there and differs from NAME in nothing but the photos that it knows; else empty.
std::string EvaluatedBefore(const Scene& scene, const std::string& name, int without) {
  const std::string evaluated = StoredName({scene.folder, name, {}, false, without});
  const auto record = FinishedRecordOf(scene, name), other = FinishedRecordOf(scene, evaluated);
  if (without == 0 || !record || !other) return {};
  std::map<std::string, std::string> options = other->options;
  options.erase("leave_out");
  std::map<std::string, std::string> for_use = record->options;
  for_use.erase("maps_without");
  return options == for_use && other->inputs == record->inputs ? evaluated : std::string();
}

// A refusal of the data, or a file of that name that is somebody's own, becomes a row of the table. Other errors end
// the run, and so do parts of depth maps of other options: with theirs they would be taken.
bool BecomesARow(const Error& e) {
  if (dynamic_cast<const PartsDiffer*>(&e) != nullptr) return false;
  return e.code() == ExitCode::kDataRefused || e.code() == ExitCode::kUsage || e.code() == ExitCode::kCorruptInput;
}

// Makes a candidate and what it is measured by. `without`: N of the photos that are left out, 0: there is only the
// proxy of all photos.
ProxyCandidate Make(const Scene& scene, const std::vector<Recipe>& recipes, const std::string& name, int without,
                    const DensePlan& dense, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  ProxyCandidate c;
  c.name = name;
  const Recipe* recipe = Find(recipes, name);
  try {
    if (!recipe || MadeBefore(scene, *recipe)) {
      const Mesh mesh = LoadProxy(scene, name);
      c.faces = mesh.faces.size();
      c.closed = IsClosed(mesh);
      c.evaluated = EvaluatedBefore(scene, name, without);
    } else if (c.refused = recipe->dense && dense.width_px == 0 ? dense.refused : recipe->unfit(scene);
               c.refused.empty()) {
      ProxyTarget target{scene.folder, name, {}, false};
      if (!recipe->dense || without == 0) {
        const ProxySummary made = recipe->run(target, progress);
        c.faces = made.faces;
        c.closed = made.closed;
      }
      if (recipe->knows_photos && without != 0) {
        target.leave_out = without;
        const ProxySummary made = recipe->run(target, progress);
        c.evaluated = made.name;
        if (recipe->dense) {
          c.faces = made.faces;
          c.closed = made.closed;
        }
      }
    }
    c.made = c.refused.empty();
  } catch (const Error& e) {
    if (!BecomesARow(e)) throw;
    c.refused = e.what();
  }
  c.build_s = SecondsSince(start);
  return c;
}

// Makes the chosen proxy from all photos, where so far only the one for measuring exists; the row then shows its faces.
void MakeForUse(const Scene& scene, const std::vector<Recipe>& recipes, ProxyCandidate& c, ProgressSink& progress) {
  const Recipe* recipe = Find(recipes, c.name);
  if (!recipe || !recipe->dense || c.evaluated.empty() || MadeBefore(scene, *recipe)) return;
  const auto start = std::chrono::steady_clock::now();
  try {
    const ProxySummary made = recipe->run({scene.folder, c.name, {}, false}, progress);
    c.faces = made.faces;
    c.closed = made.closed;
  } catch (const Error& e) {
    if (!BecomesARow(e) || e.code() == ExitCode::kCorruptInput) throw;
    c.refused = e.what();
  }
  c.build_s += SecondsSince(start);
}

// What lumi-render says of held-out photos.
struct HoldoutErrors {
  std::optional<double> psnr_db, ssim, coverage, ms, psnr_object_db;
};
void ListKeys(JsonKeys& j, HoldoutErrors& e) {
  j("psnr_mean_db", e.psnr_db, "ssim_mean", e.ssim, "coverage", e.coverage, "ms_per_frame", e.ms, "psnr_object_mean_db",
    e.psnr_object_db);
}

// What lumi-render failed with, where it did.
std::optional<Error> Measure(const Scene& scene, const AutoOptions& options, int holdout, ProxyCandidate& c) {
  const auto start = std::chrono::steady_clock::now();
  const TemporaryFolder folder;
  HoldoutErrors errors;
  try {
    errors = RunSibling({"lumi-render",
                         {scene.folder.string(), "-o", (folder.path() / "frames").string(), "--proxy",
                          c.evaluated.empty() ? c.name : c.evaluated, "--holdout", std::to_string(holdout), "--fold",
                          "choose", "--width", std::to_string(options.choose_width_px)},
                         {},
                         {}},
                        SilentProgress())
                 .summary.As<HoldoutErrors>();
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    c.refused = e.what();
    c.measure_s = SecondsSince(start);
    return e;
  }
  c.measure_s = SecondsSince(start);
  if (!errors.psnr_db || !errors.ssim || !errors.coverage || !errors.ms)
    throw MachineError("lumi-render gave no figures for proxy " + c.name, "is it of the same version as this program?");
  c.psnr_db = errors.psnr_db;
  c.ssim = errors.ssim;
  c.coverage = errors.coverage;
  c.ms = errors.ms;
  c.psnr_object_db = errors.psnr_object_db;
  return std::nullopt;
}

AutoSummary Chosen(AutoTable table, const AutoOptions& options) {
  AutoSummary s;
  const auto [choice, reason] = ChooseProxy(table, options.budget_ms);
  s.name = choice->name;
  s.reason = reason;
  s.faces = choice->faces;
  s.closed = choice->closed;
  s.budget_ms = options.budget_ms;
  s.table = std::move(table);
  return s;
}

// Chooses, and makes of all photos what was chosen; where that fails, the next best.
AutoSummary Settle(const Scene& scene, AutoTable table, const AutoOptions& options, ProgressSink& progress) {
  const std::vector<Recipe> recipes = Recipes(table.dense_width_px.value_or(0), table.evaluated_without.value_or(0));
  for (;;) {
    if (std::ranges::none_of(table.candidates, [](const ProxyCandidate& c) { return c.refused.empty(); }))
      throw DataError("no proxy can be made: " + table.candidates.front().refused,
                      "reconstruct from more photos that overlap");
    AutoSummary s = Chosen(table, options);
    const auto chosen = std::ranges::find(table.candidates, s.name, &ProxyCandidate::name);
    MakeForUse(scene, recipes, *chosen, progress);
    if (chosen->refused.empty()) return Chosen(std::move(table), options);
  }
}

std::vector<std::string> Wanted(const Scene& scene, const AutoOptions& options) {
  const std::vector<Recipe> recipes = Recipes(0, 0);
  if (options.candidates.empty()) {
    std::vector<std::string> names;
    for (const Recipe& r : recipes)
      if (!r.dense || options.depth_width_px || options.proxy_minutes != 0.0) names.push_back(r.name);
    return names;
  }
  const std::vector<std::string> there = ListProxies(scene.folder);
  std::vector<std::string> names;
  for (const std::string& name : options.candidates) {
    const bool known = Find(recipes, name) != nullptr;
    if (!known && std::ranges::find(there, name) == there.end()) {
      std::string made;
      for (const Recipe& r : recipes) made += (made.empty() ? "" : ", ") + r.name;
      throw UsageError("\"" + name + "\" is no candidate", "one of " + made + ", or a proxy that the scene has");
    }
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace

static void Check(const AutoOptions& options) {
  if (options.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (options.choose_width_px < 16) throw UsageError("--choose-width must be at least 16");
  if (options.proxy_minutes && !(*options.proxy_minutes >= 0)) throw UsageError("--proxy-minutes must be at least 0");
  if (options.proxy_minutes && options.depth_width_px)
    throw UsageError("give one of --proxy-minutes and --depth-width");
  if (options.depth_width_px) {
    StereoOptions stereo;
    stereo.width = *options.depth_width_px;
    if (!Validate(stereo).empty()) throw UsageError("--depth-width must be 64 to 8192");
  }
  if (options.budget_ms && !(*options.budget_ms > 0)) throw UsageError("--budget-ms must be above 0");
}

// N of the photos that the proxies which are compared must not know, as long as that leaves enough of them; 0: none.
static int LeftOutToMeasure(const Scene& scene, const AutoOptions& options, std::size_t candidates) {
  const auto views = static_cast<std::ptrdiff_t>(scene.views.size());
  const bool compared = views >= 3 && candidates > 1, whole_folds = views > options.holdout / 2;
  const auto kept = std::ranges::count(PhotosWithoutFolds(scene, options.holdout, true), true);
  return compared && whole_folds && 2 * kept >= views ? options.holdout : 0;
}

DepthPartSummary RunAutoPart(const AutoOptions& options, const Part& part, ProgressSink& progress) {
  Check(options);
  if (options.proxy_minutes && *options.proxy_minutes > 0)
    throw UsageError(
        "--shard goes with --depth-width, not with --proxy-minutes: how long other machines take is unknown",
        "give the same width to all parts, and to the run without --shard");
  const Scene scene = OpenForProxy(options.scene, progress);
  RequireKeepsProxies(scene);
  const std::vector<std::string> names = Wanted(scene, options);
  const int without = LeftOutToMeasure(scene, options, names.size());
  const DensePlan plan = PlanDense(scene, options, 0);
  if (plan.width_px == 0) {
    progress.Message(fmt::format("no depth maps: {}", plan.refused));
    return {.folder = {}, .part = part, .stereo = {}, .seconds = 0};
  }
  const std::vector<Recipe> recipes = Recipes(plan.width_px, without);
  for (const std::string& name : names) {
    const Recipe* recipe = Find(recipes, name);
    if (!recipe || !recipe->dense || MadeBefore(scene, *recipe)) continue;
    DenseRequest request;
    request.dense.stereo.width = plan.width_px;
    try {
      return RunDensePart({scene.folder, name, {}, false, without}, request, part, progress);
    } catch (const Error& e) {
      if (!BecomesARow(e)) throw;
      progress.Message(fmt::format("no depth maps: {}", e.what()));
      break;
    }
  }
  return {.folder = {}, .part = part, .stereo = {}, .seconds = 0};
}

AutoSummary RunAuto(const AutoOptions& options, ProgressSink& progress) {
  Check(options);
  const auto start = std::chrono::steady_clock::now();
  Scene scene = OpenForProxy(options.scene, progress);
  RequireKeepsProxies(scene);
  const std::vector<std::string> names = Wanted(scene, options);

  Provenance wanted =
      ProxyProvenance(scene, "auto", "auto",
                      {{"choose_width", std::to_string(options.choose_width_px)},
                       {"holdout", std::to_string(options.holdout)},
                       {"proxy_minutes", options.depth_width_px  ? fmt::format("{} px", *options.depth_width_px)
                                         : options.proxy_minutes ? fmt::format("{}", *options.proxy_minutes)
                                                                 : "usual"},
                       {"candidates", fmt::format("{}", fmt::join(names, ","))}});
  wanted.inputs["images"] = Fingerprint(scene.image_folder);
  wanted.inputs["silhouettes"] = Fingerprint(scene.folder / "silhouettes");
  if (IsUpToDate(scene.folder, wanted)) {
    // Measured already: a budget only chooses among what is there.
    const auto table = JsonKeys::Parse(ReadText(scene.folder / kSummaryFile));
    if (!table)
      throw InputError(scene.folder / kSummaryFile, "is no JSON object",
                       "remove it, and what was measured is measured again");
    AutoSummary s = Settle(scene, table->As<AutoTable>(), options, progress);
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
  const int without = LeftOutToMeasure(scene, options, names.size());
  const auto kept = std::ranges::count(PhotosWithoutFolds(scene, options.holdout, true), true);
  const DensePlan dense =
      PlanDense(scene, options, without != 0 ? static_cast<double>(kept) / static_cast<double>(views) : 0);
  const std::vector<Recipe> recipes = Recipes(dense.width_px, without);
  std::vector<ProxyCandidate> candidates;
  {
    Progress steps(progress, "making proxies", static_cast<long>(names.size()));
    for (const std::string& name : names) {
      candidates.push_back(Make(scene, recipes, name, without, dense, progress));
      steps.Step();
    }
  }
  const auto made = std::ranges::count_if(candidates, [](const ProxyCandidate& c) { return c.made; });
  if (made == 0)
    throw DataError("no proxy can be made: " + candidates.front().refused, "reconstruct from more photos that overlap");
  if (views >= 3 && made > 1) {
    Progress steps(progress, "choosing a proxy", static_cast<long>(made));
    std::optional<Error> failure;
    for (ProxyCandidate& c : candidates) {
      if (!c.made) continue;
      const auto failed = Measure(scene, options, holdout, c);
      if (!failure) failure = failed;
      steps.Step();
    }
    if (std::ranges::none_of(candidates, [](const ProxyCandidate& c) { return c.psnr_db.has_value(); })) {
      throw Error(failure->code() == ExitCode::kBug ? ExitCode::kMachine : failure->code(),
                  std::string("lumi-render can measure no proxy: ") + failure->what(),
                  failure->file().empty() ? scene.folder : failure->file(), failure->hint());
    }
  }

  AutoTable table{holdout,
                  options.choose_width_px,
                  "too few photos to leave one out",
                  fmt::format("photos {}, {} ... left out", holdout / 2, holdout / 2 + holdout),
                  candidates,
                  false,
                  dense.width_px != 0 ? std::optional(dense.width_px) : std::nullopt,
                  without != 0 ? std::optional(without) : std::nullopt};
  AutoSummary s = Settle(scene, std::move(table), options, progress);
  const FolderLock lock(scene.folder);
  WriteTextAtomically(scene.folder / kSummaryFile, JsonKeys(s.table).Text(2) + "\n");
  // The first that was made has become the active one meanwhile.
  scene.active_proxy = OpenForProxy(options.scene, progress).active_proxy;
  Activate(scene, s.name);
  wanted.outputs[kSummaryFile] = Fingerprint(scene.folder / kSummaryFile);
  for (const ProxyCandidate& c : s.table.candidates) {
    const fs::path path = ProxyPath(scene.folder, c.name);
    if (std::error_code error; !c.made || !fs::exists(path, error)) continue;
    wanted.outputs[path.lexically_relative(scene.folder).string()] = Fingerprint(path);
  }
  wanted.seconds = SecondsSince(start);
  WriteProvenance(scene.folder, wanted);
  s.seconds = SecondsSince(start);
  return s;
}

}  // namespace lumi
