// A scene for other programs: nerfstudio's and instant-ngp's transforms.json, or a COLMAP workspace.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"

namespace lumi {

struct ExportOptions {
  std::filesystem::path scene;   // a scene, a COLMAP workspace or transforms.json
  std::filesystem::path output;  // FILE.json, or the folder of a workspace: images/ and sparse/0/
};

struct ExportSummary {
  std::filesystem::path output;
  std::string format;  // transforms.json, colmap
  int photos = 0, cameras = 0, points = 0;
  int photos_copied = 0;  // beside the output, where they are not there
};
void ListKeys(JsonKeys& j, ExportSummary& summary);
std::string Describe(const ExportSummary& summary);

// Cameras as they are, with their distortion. Photos that lie outside the folder of a transforms.json are
// copied to images/ beside it, so that the folder is whole; a workspace always has its own. Nothing that is there is
// replaced: UsageError. DataError for a scene without metric cameras.
// Until FinishExport the output counts as begun, and the same export may be made again.
ExportSummary ExportScene(const ExportOptions& options, ProgressSink& sink);
// Comes last, when there is nothing left that can fail.
void FinishExport(const ExportOptions& options);

}  // namespace lumi
