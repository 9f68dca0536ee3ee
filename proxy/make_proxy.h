// The common way of the subcommands that make a mesh.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "proxy/commands.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

// Makes a mesh, or takes the one that is there where nothing changed, and keeps it where `target` says. options and
// inputs (name, fingerprint) are the record of how it was made.
ProxySummary MakeProxy(const ProxyTarget& target, const std::string& kind, std::map<std::string, std::string> options,
                       std::map<std::string, std::string> inputs, ProgressSink& progress,
                       const std::function<Mesh(const Scene&)>& make);

// Of a target that leaves photos out: those that stay.
std::vector<bool> KnownPhotos(const ProxyTarget& target, const Scene& scene);

// A scene to make a proxy of: its cameras and points.
Scene OpenForProxy(const std::filesystem::path& path, ProgressSink& progress);

// What an earlier run said of a proxy beside its mesh, for a run that has nothing to do; or what this run has to say,
// kept there.
template <typename Figures>
void KeepFigures(const std::filesystem::path& folder, Made<Figures>& made) {
  const std::filesystem::path record = ProxyPath(folder, made.name).replace_extension(".json");
  std::error_code error;
  if (made.figures)
    WriteTextAtomically(record, JsonKeys(*made.figures).Text(2) + "\n");
  else if (std::filesystem::exists(record, error))
    if (const auto kept = JsonKeys::Parse(ReadText(record))) made.figures = kept->As<Figures>();
}

// Of the scene's points, coordinate by coordinate: a point in the middle of what is photographed. None without points.
std::optional<Eigen::Vector3d> MedianPoint(const Scene& scene);

}  // namespace lumi
