// Where a scene keeps its proxies: SCENE/proxies/NAME.ply, with a record of how each was made; a proxy is never
// overwritten by one of another kind.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/files/provenance.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

// Proxies are kept in the scene's own folder where it is one of this suite's. Other tools' workspaces are opened as
// they are and never written to: throws UsageError, saying what to do instead.
void RequireKeepsProxies(const Scene& scene);

// Throws UsageError for a name that is no plain file name.
void RequireProxyName(const std::string& name);

// The record of a proxy that is to be made, as far as it is known beforehand. The scene's cameras and points are among
// the inputs.
Provenance ProxyProvenance(const Scene& scene, const std::string& name, const std::string& kind,
                           std::map<std::string, std::string> options);

// How NAME was made; none where there is no record, or none that can be read.
std::optional<Provenance> RecordOf(const Scene& scene, const std::string& name);
// The same where NAME.ply is there and no run ended while it was made.
std::optional<Provenance> FinishedRecordOf(const Scene& scene, const std::string& name);

// Throws UsageError where NAME.ply exists and its record names another kind, or none.
void RequireSameKind(const Scene& scene, const Provenance& wanted, const std::string& name);

// The file of a proxy's figures, beside its mesh.
std::filesystem::path FiguresPath(const std::filesystem::path& scene_folder, const std::string& name);

// Writes the mesh and its figures (empty: none), then its record. Before these, a record says that a proxy of this kind
// is being made: after a kill the same kind may be made again.
void StoreProxy(const Scene& scene, const std::string& name, const Mesh& mesh, const std::string& figures,
                Provenance provenance);

// The record of a stage that makes no mesh but files of the scene: with its summary beside it
// (provenance/STAGE.summary), for a run that has nothing to do.
class StageRecord {
 public:
  StageRecord(std::filesystem::path scene_folder, Provenance wanted)
      : folder_(std::move(scene_folder)), wanted_(std::move(wanted)) {}
  // What the run before said, where nothing changed since.
  template <typename Summary>
  std::optional<Summary> Before() const {
    const std::optional<JsonKeys> kept = KeptSummary();
    Summary summary;
    return kept && kept->Into(summary) ? std::optional(std::move(summary)) : std::nullopt;
  }
  // `outputs`: paths in the scene.
  template <typename Summary>
  void Keep(const Summary& summary, double seconds, const std::vector<std::string>& outputs) {
    Write(JsonKeys(summary).Text(2) + "\n", seconds, outputs);
  }

 private:
  std::string SummaryName() const { return "provenance/" + wanted_.stage + ".summary"; }
  std::optional<JsonKeys> KeptSummary() const;
  void Write(const std::string& summary, double seconds, std::vector<std::string> outputs);

  std::filesystem::path folder_;
  Provenance wanted_;
};

// Makes NAME the scene's active proxy where it is not yet.
void Activate(Scene& scene, const std::string& name);

}  // namespace lumi
