#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/plane/plane_proxy.h"
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

struct Candidate {
  std::string name;
  std::string refused;  // why it cannot be made here, or empty
  std::size_t faces = 0;
  bool closed = false;
  double seconds = 0;   // making and measuring it
  std::optional<double> psnr_db, ssim, coverage;
};

// The mesh kept under the candidate's name, made only where it is not up to date.
Candidate Keep(const Scene& scene, const std::string& name, const std::string& kind, std::map<std::string, std::string> options,
               const std::function<Mesh()>& make) {
  const auto start = std::chrono::steady_clock::now();
  Candidate c;
  c.name = name;
  Provenance wanted = ProxyProvenance(scene, name, kind, std::move(options));
  RequireSameKind(scene, wanted, name);
  try {
    Mesh mesh;
    if (IsUpToDate(scene.folder, wanted)) {
      mesh = ReadMesh(ProxyPath(scene.folder, name));
    } else {
      mesh = make();
      StoreProxy(scene, name, mesh, std::move(wanted), SecondsSince(start));
    }
    c.faces = mesh.faces.size();
    c.closed = IsClosed(mesh);
  } catch (const DataError& e) {
    c.refused = e.what();
  }
  c.seconds = SecondsSince(start);
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
  if (result.exit_code != 0) {
    std::string why = fmt::format("it ended with {}", result.exit_code);
    if (json.contains("error")) why = json["error"].value("message", why);
    else if (!result.tail.empty()) why += ": " + result.tail.back();
    throw Error(result.exit_code >= 1 && result.exit_code <= 4 ? static_cast<ExitCode>(result.exit_code) : ExitCode::kMachine,
                "lumi-render cannot measure proxy " + c.name + ": " + why, scene.folder, json.contains("error") ? json["error"].value("hint", "") : "");
  }
  const auto number = [&](const char* key) -> std::optional<double> {
    if (!json.contains(key) || !json[key].is_number()) return std::nullopt;
    return json[key].get<double>();
  };
  c.psnr_db = number("psnr_mean_db");
  c.ssim = number("ssim_mean");
  c.coverage = number("coverage");
  if (!c.psnr_db || !c.ssim || !c.coverage) throw MachineError("lumi-render gave no figures for proxy " + c.name, "is it of the same version as this program?");
  c.seconds += SecondsSince(start);
}

Json ToJson(const Candidate& c) {
  const auto value = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
  Json j{{"name", c.name}, {"psnr_mean_db", value(c.psnr_db)}, {"ssim_mean", value(c.ssim)}, {"coverage", value(c.coverage)},
         {"faces", c.faces}, {"seconds", c.seconds}};
  if (!c.refused.empty()) j["refused"] = c.refused;
  return j;
}

}  // namespace

std::string RunAuto(const AutoOptions& options, ProgressSink& progress) {
  if (options.holdout < 2) throw UsageError("--holdout must be at least 2");
  if (options.choose_width_px < 16) throw UsageError("--choose-width must be at least 16");
  const auto start = std::chrono::steady_clock::now();
  OpenOptions open;
  open.check_photos = false;
  Scene scene = OpenScene(options.scene, open, progress);
  RequireMetric(scene, "a proxy");
  RequireKeepsProxies(scene);
  const FolderLock lock(scene.folder);

  const DelaunayOptions delaunay;
  std::map<std::string, std::string> values = OptionValues(delaunay);
  values["choose_width"] = std::to_string(options.choose_width_px);
  values["holdout"] = std::to_string(options.holdout);
  Provenance wanted = ProxyProvenance(scene, "auto", "auto", std::move(values));
  wanted.inputs["images"] = Fingerprint(scene.image_folder);
  if (IsUpToDate(scene.folder, wanted)) {
    Json json = Json::parse(ReadText(scene.folder / kSummaryFile));
    Activate(scene, json.at("name").get<std::string>());
    json["reused"] = true;
    json["seconds"] = SecondsSince(start);
    return json.dump();
  }

  std::vector<Candidate> candidates;
  candidates.push_back(Keep(scene, "plane", "plane", {}, [&] { return BuildPlaneProxy(scene, {}); }));
  candidates.push_back(Keep(scene, "mesh", "delaunay", OptionValues(delaunay), [&] { return BuildDelaunayProxy(scene, delaunay, progress); }));
  std::vector<Candidate*> made;
  for (Candidate& c : candidates) {
    if (c.refused.empty()) made.push_back(&c);
  }
  if (made.empty()) throw DataError("no proxy can be made: " + candidates.front().refused, "reconstruct from more photos that overlap");

  // With fewer photos than N the fold for choosing would be empty: every photo's number then is in one fold of two.
  const int views = static_cast<int>(scene.views.size());
  const int holdout = views > options.holdout / 2 ? options.holdout : 2;
  std::string reason;
  const Candidate* best = made.back();  // a mesh before a plane, where nothing can be measured
  if (made.size() == 1) {
    reason = "the only one that can be made";
  } else if (views < 3) {
    reason = "too few photos to leave one out";
  } else {
    Progress steps(progress, "choosing a proxy", static_cast<long>(made.size()));
    for (Candidate* c : made) {
      Measure(scene, options, holdout, *c);
      steps.Step();
    }
    for (const Candidate* c : made) {
      if (*c->psnr_db > *best->psnr_db) best = c;
    }
    reason = fmt::format("the smallest error on photos {}, {} ... left out", holdout / 2, holdout / 2 + holdout);
  }

  Activate(scene, best->name);
  Json json{{"name", best->name}, {"faces", best->faces}, {"closed", best->closed}, {"seconds", 0.0}, {"reason", reason},
            {"holdout", holdout}, {"choose_width_px", options.choose_width_px}, {"candidates", Json::array()}, {"reused", false}};
  for (const Candidate& c : candidates) json["candidates"].push_back(ToJson(c));
  json["seconds"] = SecondsSince(start);
  WriteTextAtomically(scene.folder / kSummaryFile, json.dump(2) + "\n");
  wanted.outputs[kSummaryFile] = Fingerprint(scene.folder / kSummaryFile);
  for (const Candidate* c : made) {
    const fs::path path = ProxyPath(scene.folder, c->name);
    wanted.outputs[path.lexically_relative(scene.folder).string()] = Fingerprint(path);
  }
  wanted.seconds = SecondsSince(start);
  WriteProvenance(scene.folder, wanted);
  return json.dump();
}

}  // namespace lumi
