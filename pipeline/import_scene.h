// A COLMAP workspace, or a scene of ours elsewhere, as a scene folder: what stands in for lumi-reconstruct where the
// cameras are already known. The workspace itself is only read.
#pragma once

#include <filesystem>

#include "pipeline/sibling_stage.h"

namespace lumi {

struct ImportOptions {
  std::filesystem::path input;
  std::filesystem::path output;
  bool rescale_cameras = false;
};

// Undistorted photos, cameras and points of `input` written to `output`; nothing is done where neither changed.
// Throws what OpenScene throws; DataError where the model has no points (a proxy needs them).
StageResult ImportScene(const ImportOptions& options, ProgressSink& progress);

}  // namespace lumi
