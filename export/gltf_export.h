// lumi-export gltf: the proxy as a glTF 2.0 mesh (GLB) with a colour a vertex, and the photos' cameras as glTF cameras
// with their names. Metres and y up, as glTF has them: the scene's up becomes y; its units stay where it has no scale.
// A scene far from its world's origin is written about its own centre, where the root node puts it.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"

namespace lumi {

struct GltfOptions {
  std::filesystem::path scene;
  std::filesystem::path output;  // FILE.glb
  std::string proxy;             // by name; empty: the active one
  std::filesystem::path points;  // the proxy's vertices and the scene's points as PLY, too; empty: not
};

struct GltfSummary {
  std::string output, points, proxy;
  long vertices = 0, faces = 0, cameras = 0, points_written = 0;
  double seen = 0;  // share of the vertices that a photo sees
  double mb = 0, seconds = 0;
};
void ListKeys(JsonKeys& j, GltfSummary& s);
std::string Describe(const GltfSummary& s);

// Throws UsageError, InputError, DataError (no metric), MachineError.
GltfSummary ExportGltf(const GltfOptions& options, ProgressSink& sink);

}  // namespace lumi
