#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/box/box_proxy.h"
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/describe.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSummaryFile = "proxies/auto.json";  // the table, for a run that has nothing to do

constexpr int kMostPhotos = 10;  // that the choice is made on: more take their time and change little

struct Candidate {
  std::string name;
  std::string refused;      // why it cannot be made or measured here, or empty
  std::size_t faces = 0;
  bool closed = false;
  bool made = false;
  double build_s = 0, measure_s = 0;
  std::optional<double> psnr_db, ssim, coverage, ms;
  std::optional<double> psnr_object_db;  // over the object's pixels, where the scene has silhouettes
};

// A kind of proxy that is tried: the name that it is kept under, why this scene does not call for it (or empty), how it is made.
struct Recipe {
  std::string name, kind;
  std::function<std::string(const Scene&)> unfit;
  std::function<std::string(const ProxyTarget&, ProgressSink&)> run;
};

// Walls on at least three sides that hold half of the points, twice as long as wide, along which the cameras travel: anything less a
// box shows worse than what goes through the points.
std::string UnfitForBox(const Scene& scene) {
  constexpr double kOnWalls = 0.5, kOnAWall = 0.05, kTravel = 1, kLong = 2;
  BoxSummary s;
  try {
    BuildBoxProxy(scene, {}, &s);
  } catch (const DataError& e) {
    return e.what();
  }
  const auto walls = std::count_if(s.wall_points.begin(), s.wall_points.end(), [&](std::size_t n) { return static_cast<double>(n) >= kOnAWall * static_cast<double>(s.points); });
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const View& view : scene.views) {
    const double along = s.box_from_world.row(2).dot(view.CentreInWorld());
    first = std::min(first, along);
    last = std::max(last, along);
  }
  const Eigen::Vector3d size = s.high - s.low;
  if (walls < 3 || static_cast<double>(s.points_on_walls) < kOnWalls * static_cast<double>(s.points))
    return fmt::format("no tube: {:.0f} % of the points lie on {} walls", 100.0 * static_cast<double>(s.points_on_walls) / std::max<double>(1, static_cast<double>(s.points)), walls);
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
      {"box", "box", UnfitForBox, [](const ProxyTarget& t, ProgressSink& p) { return RunBox(t, BoxOptions().sides, p); }},
      {"mesh", "delaunay", always, [](const ProxyTarget& t, ProgressSink& p) { return RunDelaunay(t, DelaunayOptions().merge_px, p); }},
      {"moving", "moving", UnfitForMoving, [](const ProxyTarget& t, ProgressSink& p) { return RunMoving(t, {}, p); }},
      {"hull", "hull",
       [](const Scene& scene) {
         std::error_code error;
         return fs::exists(scene.folder / "silhouettes", error) ? std::string() : std::string("there are no silhouettes: lumi-proxy silhouettes makes some");
       },
       [](const ProxyTarget& t, ProgressSink& p) { return RunHull({}, t, p); }},
      {"hull-500", "simplify",
       [](const Scene& scene) {
         std::error_code error;
         return fs::exists(ProxyPath(scene.folder, "hull"), error) ? std::string() : std::string("there is no hull to simplify");
       },
       [](const ProxyTarget& t, ProgressSink& p) { return RunSimplify({.faces = 500, .from = "hull", .keep_hull = true, .silhouettes = {}}, t, p); }},
  };
  return recipes;
}

// A proxy of that name and kind made of the same cameras and points, whatever its options: somebody's choice, which stays.
bool MadeBefore(const Scene& scene, const Recipe& recipe) {
  const fs::path record = scene.folder / "provenance" / ("proxy-" + recipe.name + ".json");
  std::error_code error;
  if (!fs::exists(ProxyPath(scene.folder, recipe.name), error) || !fs::exists(record, error)) return false;
  try {
    const Json json = Json::parse(ReadText(record));
    return json.at("options").at("kind") == recipe.kind && json.at("inputs").at("sparse") == Fingerprint(scene.folder / "sparse");
  } catch (const Json::exception&) {
    return false;  // an unreadable record says nothing
  }
}

Candidate Make(const Scene& scene, const std::string& name, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  Candidate c;
  c.name = name;
  const auto recipe = std::find_if(Recipes().begin(), Recipes().end(), [&](const Recipe& r) { return r.name == name; });
  try {
    if (recipe == Recipes().end() || MadeBefore(scene, *recipe)) {
      const Mesh mesh = LoadProxy(scene, name);
      c.faces = mesh.faces.size();
      c.closed = IsClosed(mesh);
    } else if (c.refused = recipe->unfit(scene); c.refused.empty()) {
      const Json json = Json::parse(recipe->run({scene.folder, name, {}, false}, progress));
      c.faces = json["faces"].get<std::size_t>();
      c.closed = json["closed"].get<bool>();
    }
    c.made = c.refused.empty();
  } catch (const Error& e) {
    // What the data do not allow, or a file of that name that is somebody's own: a row of the table. Else the run ends.
    if (e.code() != ExitCode::kDataRefused && e.code() != ExitCode::kUsage && e.code() != ExitCode::kCorruptInput) throw;
    c.refused = e.what();
  }
  c.build_s = SecondsSince(start);
  return c;
}

void Measure(const Scene& scene, const AutoOptions& options, int holdout, Candidate& c) {
  const auto start = std::chrono::steady_clock::now();
  const TemporaryFolder folder;
  SubprocessOptions subprocess;
  subprocess.separate_stdout = true;
  const std::vector<std::string> argv = {SiblingProgram("lumi-render").string(), scene.folder.string(), "-o", (folder.path() / "frames").string(),
                                         "--proxy", c.name, "--holdout", std::to_string(holdout), "--fold", "choose",
                                         "--width", std::to_string(options.choose_width_px), "--json"};
  const SubprocessResult result = RunSubprocess(argv, subprocess);
  Json json;
  try {
    json = Json::parse(result.out);
  } catch (const Json::exception&) {
  }
  c.measure_s = SecondsSince(start);
  if (result.exit_code == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  if (result.exit_code != 0) {
    c.refused = fmt::format("lumi-render ended with {}", result.exit_code);
    if (json.contains("error")) c.refused = json["error"].value("message", c.refused);
    else if (!result.tail.empty()) c.refused += ": " + result.tail.back();
    return;
  }
  const auto number = [&](const char* key) -> std::optional<double> {
    if (!json.contains(key) || !json[key].is_number()) return std::nullopt;
    return json[key].get<double>();
  };
  c.psnr_db = number("psnr_mean_db");
  c.ssim = number("ssim_mean");
  c.coverage = number("coverage");
  c.ms = number("ms_per_frame");
  c.psnr_object_db = number("psnr_object_mean_db");
  if (!c.psnr_db || !c.ssim || !c.coverage || !c.ms) throw MachineError("lumi-render gave no figures for proxy " + c.name, "is it of the same version as this program?");
}

Json ToJson(const Candidate& c) {
  const auto value = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
  Json j{{"name", c.name}, {"psnr_mean_db", value(c.psnr_db)}, {"psnr_object_mean_db", value(c.psnr_object_db)}, {"ssim_mean", value(c.ssim)}, {"coverage", value(c.coverage)}, {"ms_per_frame", value(c.ms)},
         {"faces", c.faces}, {"closed", c.closed}, {"seconds", c.build_s + c.measure_s}, {"build_seconds", c.build_s}, {"measure_seconds", c.measure_s}};
  if (!c.refused.empty()) j["refused"] = c.refused;
  return j;
}

// Who gave silhouettes is after the object: around it a hull shows nothing, and holes count as black.
double Score(const Json& c) {
  const auto object = c.find("psnr_object_mean_db");
  return object != c.end() && object->is_number() ? object->get<double>() : c["psnr_mean_db"].get<double>();
}

struct Choice {
  std::string name, reason;
};

// The best of those within the budget; of equals the one with fewer faces. Where nothing is within it, the fastest.
Choice Choose(const Json& candidates, const std::string& unmeasured_reason, const std::string& fold, std::optional<double> budget_ms) {
  const Json* best = nullptr;
  const Json* fastest = nullptr;
  std::size_t made = 0, measured = 0;
  for (const Json& c : candidates) {
    if (c.contains("refused")) continue;
    ++made;
    if (c["psnr_mean_db"].is_null()) continue;
    ++measured;
    const double psnr = Score(c), ms = c["ms_per_frame"];
    if (!fastest || ms < (*fastest)["ms_per_frame"].get<double>()) fastest = &c;
    if (budget_ms && ms > *budget_ms) continue;
    const double ahead = best ? psnr - Score(*best) : 1;
    if (ahead > 0 || (ahead == 0 && c["faces"].get<std::size_t>() < (*best)["faces"].get<std::size_t>())) best = &c;
  }
  if (measured == 0) {
    // Nothing to go by: what goes through the points, or the last that there is, which is the most elaborate.
    const Json* last = nullptr;
    for (const Json& c : candidates)
      if (!c.contains("refused") && (!last || (*last)["name"] != "mesh")) last = &c;
    return {(*last)["name"].get<std::string>(), made == 1 ? "the only one that can be made" : unmeasured_reason};
  }
  if (!best) return {(*fastest)["name"].get<std::string>(), fmt::format("none is within {:g} ms a frame: the fastest", *budget_ms)};
  std::string reason = measured == 1 && made == 1 ? "the only one that can be made" : "the smallest error on " + fold;
  if (budget_ms) reason += fmt::format(" within {:g} ms a frame", *budget_ms);
  return {(*best)["name"].get<std::string>(), reason};
}

Json Chosen(const Json& table, const AutoOptions& options) {
  const Choice choice = Choose(table["candidates"], table["unmeasured"].get<std::string>(), table["fold"].get<std::string>(), options.budget_ms);
  Json json{{"name", choice.name}, {"faces", 0}, {"closed", false}, {"seconds", 0.0}, {"reason", choice.reason}};
  for (const Json& c : table["candidates"])
    if (c["name"] == choice.name) {
      json["faces"] = c["faces"];
      json["closed"] = c["closed"];
    }
  if (options.budget_ms) json["budget_ms"] = *options.budget_ms;
  json.update(table);
  return json;
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
    if (!known && std::find(there.begin(), there.end(), name) == there.end()) {
      std::string made;
      for (const Recipe& r : Recipes()) made += (made.empty() ? "" : ", ") + r.name;
      throw UsageError("\"" + name + "\" is no candidate", "one of " + made + ", or a proxy that the scene has");
    }
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace

std::string RunAuto(const AutoOptions& options, ProgressSink& progress) {
  if (options.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (options.choose_width_px < 16) throw UsageError("--choose-width must be at least 16");
  if (options.budget_ms && !(*options.budget_ms > 0)) throw UsageError("--budget-ms must be above 0");
  const auto start = std::chrono::steady_clock::now();
  OpenOptions open;
  open.check_photos = false;
  Scene scene = OpenScene(options.scene, open, progress);
  RequireMetric(scene, "a proxy");
  RequireKeepsProxies(scene);
  const std::vector<std::string> names = Wanted(scene, options);

  Provenance wanted = ProxyProvenance(scene, "auto", "auto",
                                      {{"choose_width", std::to_string(options.choose_width_px)}, {"holdout", std::to_string(options.holdout)}, {"candidates", fmt::format("{}", fmt::join(names, ","))}});
  wanted.inputs["images"] = Fingerprint(scene.image_folder);
  wanted.inputs["silhouettes"] = Fingerprint(scene.folder / "silhouettes");
  if (IsUpToDate(scene.folder, wanted)) {
    // Measured already: a budget only chooses among what is there.
    const FolderLock lock(scene.folder);
    Json json = Chosen(Json::parse(ReadText(scene.folder / kSummaryFile)), options);
    Activate(scene, json.at("name").get<std::string>());
    json["reused"] = true;
    json["seconds"] = SecondsSince(start);
    return json.dump();
  }

  // With fewer photos than N the fold for choosing would be empty: every photo's number then is in one fold of two.
  const int views = static_cast<int>(scene.views.size());
  int holdout = views > options.holdout / 2 ? options.holdout : 2;
  // An odd multiple of N keeps clear of 0, N, 2N ..., which quality is reported on.
  for (const int n = holdout; views / holdout > kMostPhotos; holdout += 2 * n) {
  }
  std::vector<Candidate> candidates;
  {
    Progress steps(progress, "making proxies", static_cast<long>(names.size()));
    for (const std::string& name : names) {
      candidates.push_back(Make(scene, name, progress));
      steps.Step();
    }
  }
  const auto made = std::count_if(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.made; });
  if (made == 0) throw DataError("no proxy can be made: " + candidates.front().refused, "reconstruct from more photos that overlap");
  if (views >= 3 && made > 1) {
    Progress steps(progress, "choosing a proxy", static_cast<long>(made));
    for (Candidate& c : candidates) {
      if (!c.made) continue;
      Measure(scene, options, holdout, c);
      steps.Step();
    }
    if (std::none_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.psnr_db.has_value(); })) {
      const auto first = std::find_if(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.made; });
      throw MachineError("lumi-render can measure no proxy: " + first->refused, "", scene.folder);
    }
  }

  const FolderLock lock(scene.folder);
  Json table{{"holdout", holdout}, {"choose_width_px", options.choose_width_px}, {"unmeasured", "too few photos to leave one out"},
             {"fold", fmt::format("photos {}, {} ... left out", holdout / 2, holdout / 2 + holdout)}, {"candidates", Json::array()}, {"reused", false}};
  for (const Candidate& c : candidates) table["candidates"].push_back(ToJson(c));
  Json json = Chosen(table, options);
  // The first that was made has become the active one meanwhile.
  scene.active_proxy = OpenScene(options.scene, open, progress).active_proxy;
  Activate(scene, json["name"].get<std::string>());
  WriteTextAtomically(scene.folder / kSummaryFile, table.dump(2) + "\n");
  wanted.outputs[kSummaryFile] = Fingerprint(scene.folder / kSummaryFile);
  for (const Candidate& c : candidates) {
    if (!c.made) continue;
    const fs::path path = ProxyPath(scene.folder, c.name);
    wanted.outputs[path.lexically_relative(scene.folder).string()] = Fingerprint(path);
  }
  wanted.seconds = SecondsSince(start);
  WriteProvenance(scene.folder, wanted);
  json["seconds"] = SecondsSince(start);
  return json.dump();
}

std::string DescribeAuto(const std::string& text) {
  const Json json = Json::parse(text);
  std::string out = fmt::format("{:<14} {:>8} {:>9} {:>10} {:>8} {:>9} {:>9} {:>8} {:>10}\n", "proxy", "faces", "PSNR dB", "object dB", "SSIM", "coverage", "ms/frame", "built s", "measured s");
  for (const Json& c : json["candidates"]) {
    if (c.contains("refused")) {
      out += fmt::format("{:<14} {}\n", c["name"].get<std::string>(), c["refused"].get<std::string>());
    } else if (c["psnr_mean_db"].is_null()) {
      out += fmt::format("{:<14} {:>8} {:>9} {:>10} {:>8} {:>9} {:>9} {:>8.2f} {:>10}\n", c["name"].get<std::string>(), c["faces"].get<std::size_t>(), "-", "-", "-", "-", "-",
                         c["build_seconds"].get<double>(), "-");
    } else {
      const std::string object = c.contains("psnr_object_mean_db") && c["psnr_object_mean_db"].is_number() ? fmt::format("{:.2f}", c["psnr_object_mean_db"].get<double>()) : "-";
      out += fmt::format("{:<14} {:>8} {:>9.2f} {:>10} {:>8.4f} {:>8.1f}% {:>9.1f} {:>8.2f} {:>10.2f}\n", c["name"].get<std::string>(), c["faces"].get<std::size_t>(),
                         c["psnr_mean_db"].get<double>(), object, c["ssim_mean"].get<double>(), 100 * c["coverage"].get<double>(), c["ms_per_frame"].get<double>(),
                         c["build_seconds"].get<double>(), c["measure_seconds"].get<double>());
    }
  }
  return out + fmt::format("active: {} ({}), {} px wide; {:.1f} s{}", json["name"].get<std::string>(), json["reason"].get<std::string>(), json["choose_width_px"].get<int>(),
                           json["seconds"].get<double>(), json["reused"].get<bool>() ? ", nothing had changed" : "");
}

}  // namespace lumi
