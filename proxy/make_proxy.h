// The common way of the subcommands that make a mesh.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "proxy/commands.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

// Makes a mesh, or takes the one that is there where nothing changed, and keeps it where `target` says.
// `make` fills its own keys into the JSON. options and inputs (name, fingerprint) are the record of how it was made.
std::string MakeProxy(const ProxyTarget& target, const std::string& kind, std::map<std::string, std::string> options,
                      std::map<std::string, std::string> inputs, ProgressSink& progress,
                      const std::function<Mesh(const Scene&, nlohmann::ordered_json&)>& make);

// Of the scene's points, coordinate by coordinate: a point in the middle of what is photographed. None without points.
std::optional<Eigen::Vector3d> MedianPoint(const Scene& scene);

}  // namespace lumi
