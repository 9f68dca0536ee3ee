// The common way of the subcommands that make a mesh.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "proxy/commands.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

// A mesh, and what there is to say of it beside its faces: JSON that is kept beside it.
struct BuiltProxy {
  BuiltProxy(Mesh built) : mesh(std::move(built)) {}  // NOLINT: most have nothing to say
  template <typename Figures>
  BuiltProxy(Mesh built, Figures& of_it) : mesh(std::move(built)), figures(JsonKeys(of_it).Text(2) + "\n") {}
  Mesh mesh;
  std::string figures;
};

// Makes a mesh, or takes the one that is there where nothing changed, and keeps it where `target` says. options and
// inputs (name, fingerprint) are the record of how it was made.
ProxySummary MakeProxy(const ProxyTarget& target, const std::string& kind, std::map<std::string, std::string> options,
                       std::map<std::string, std::string> inputs, ProgressSink& progress,
                       const std::function<BuiltProxy(const Scene&)>& make);

// Of a target that leaves photos out: those that stay.
std::vector<bool> KnownPhotos(const ProxyTarget& target, const Scene& scene);
// The scene as a proxy for an evaluation may know it. Throws DataError where too few photos stay.
Scene KnownTo(const ProxyTarget& target, Scene scene);

// A scene to make a proxy of: its cameras and points.
Scene OpenForProxy(const std::filesystem::path& path, ProgressSink& progress);

// What an earlier run said of a proxy beside its mesh, for a run that has nothing to do.
template <typename Figures>
void TakeFigures(const std::filesystem::path& folder, Made<Figures>& made) {
  const std::filesystem::path record = FiguresPath(folder, made.name);
  std::error_code error;
  if (!made.figures && std::filesystem::exists(record, error))
    if (const auto kept = JsonKeys::Parse(ReadText(record))) made.figures = kept->As<Figures>();
}

// MakeProxy of a kind whose figures can be read back: a run that has nothing to do says what the one before said.
template <typename Figures>
Made<Figures> MakeAndKeep(const ProxyTarget& target, const std::string& kind,
                          std::map<std::string, std::string> options, std::map<std::string, std::string> inputs,
                          ProgressSink& progress, const std::function<Mesh(const Scene&, Figures&)>& make) {
  std::optional<Figures> figures;
  Made<Figures> made{MakeProxy(target, kind, std::move(options), std::move(inputs), progress,
                               [&](const Scene& scene) -> BuiltProxy {
                                 Figures& f = figures.emplace();
                                 Mesh mesh = make(scene, f);
                                 return {std::move(mesh), f};
                               }),
                     figures};
  if (target.output.empty()) TakeFigures(made.file.parent_path().parent_path(), made);  // SCENE/proxies/NAME.ply
  return made;
}

// Of the scene's points, coordinate by coordinate: a point in the middle of what is photographed. None without points.
std::optional<Eigen::Vector3d> MedianPoint(const Scene& scene);

}  // namespace lumi
