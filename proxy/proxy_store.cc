#include "proxy/proxy_store.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>

#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kUnfinished = "unfinished";  // in place of the version, until all is written

std::string StageOf(const std::string& name) { return "proxy-" + name; }

}  // namespace

void RequireKeepsProxies(const Scene& scene) {
  std::error_code error;
  if (fs::exists(scene.folder / "lumigraph.json", error)) return;
  throw UsageError(
      scene.folder.string() + " is another tool's workspace and is not written to",
      fmt::format("make a scene of it, with a proxy: lumi-pipeline {0} -o SCENE; or write a mesh file, which "
                  "lumi-render and lumi-view take as --proxy FILE.ply: lumi-proxy delaunay {0} -o FILE.ply",
                  scene.folder.string()));
}

void RequireProxyName(const std::string& name) {
  const bool plain = !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
  });
  if (!plain) throw UsageError("\"" + name + "\" is no name for a proxy", "use letters, digits, '-', '_' and '.'");
  if (name == "auto") throw UsageError("\"auto\" is no name for a proxy", "it names the choice among them");
  if (name == "per-view")
    throw UsageError("\"per-view\" is no name for a proxy", "lumi-render makes that one anew for each view");
}

Provenance ProxyProvenance(const Scene& scene, const std::string& name, const std::string& kind,
                           std::map<std::string, std::string> options) {
  Provenance p;
  p.stage = StageOf(name);
  p.version = kVersion;
  p.options = std::move(options);
  p.options["kind"] = kind;
  p.inputs["sparse"] = Fingerprint(scene.folder / "sparse");
  return p;
}

std::optional<Provenance> RecordOf(const Scene& scene, const std::string& name) {
  if (IsMeshFile(name)) return {};  // a file anywhere: nobody knows what it was made of
  return ReadProvenance(scene.folder, StageOf(name));
}

std::optional<Provenance> FinishedRecordOf(const Scene& scene, const std::string& name) {
  std::optional<Provenance> record = RecordOf(scene, name);
  std::error_code error;
  if (!record || record->version == kUnfinished || !fs::exists(ProxyPath(scene.folder, name), error)) return {};
  return record;
}

void RequireSameKind(const Scene& scene, const Provenance& wanted, const std::string& name) {
  const fs::path path = ProxyPath(scene.folder, name);
  std::error_code error;
  if (!fs::exists(path, error)) return;
  std::string before = "unknown";
  if (const auto record = RecordOf(scene, name); record && record->options.contains("kind"))
    before = record->options.at("kind");
  if (before == wanted.options.at("kind")) return;
  throw UsageError(fmt::format("{} is there already, of another kind ({})", path.string(), before),
                   "choose another --name, or remove that file");
}

fs::path FiguresPath(const fs::path& scene_folder, const std::string& name) {
  return ProxyPath(scene_folder, name).replace_extension(".json");
}

void StoreProxy(const Scene& scene, const std::string& name, const Mesh& mesh, const std::string& figures,
                Provenance provenance) {
  Provenance begun = provenance;
  begun.version = kUnfinished;
  begun.outputs.clear();
  WriteProvenance(scene.folder, begun);
  const auto wrote = [&](const fs::path& path) {
    provenance.outputs[path.lexically_relative(scene.folder).string()] = Fingerprint(path);
  };
  const fs::path path = ProxyPath(scene.folder, name), beside = FiguresPath(scene.folder, name);
  WriteMesh(path, mesh);
  wrote(path);
  std::error_code ignored;
  if (figures.empty()) {
    fs::remove(beside, ignored);
  } else {
    WriteTextAtomically(beside, figures);
    wrote(beside);
  }
  WriteProvenance(scene.folder, provenance);
}

std::optional<JsonKeys> StageRecord::KeptSummary() const {
  std::error_code error;
  if (!fs::exists(folder_ / SummaryName(), error) || !IsUpToDate(folder_, wanted_)) return std::nullopt;
  return JsonKeys::Parse(ReadText(folder_ / SummaryName()));
}

void StageRecord::Write(const std::string& summary, double seconds, std::vector<std::string> outputs) {
  WriteTextAtomically(folder_ / SummaryName(), summary);
  outputs.push_back(SummaryName());
  wanted_.seconds = seconds;
  for (const std::string& output : outputs) wanted_.outputs[output] = Fingerprint(folder_ / output);
  WriteProvenance(folder_, wanted_);
}

void Activate(Scene& scene, const std::string& name) {
  if (scene.active_proxy == name) return;
  scene.active_proxy = name;
  WriteManifest(scene, scene.folder);
}

}  // namespace lumi
