// lumi-reconstruct: a folder of photos or a video -> SCENE (undistorted photos, cameras, sparse points).
//
//   ReconstructOptions options;
//   options.input = "photos";
//   options.scene = "scene";
//   const ReconstructSummary summary = Reconstruct(options, sink);
#pragma once

#include "reconstruct/options.h"
#include "scene/program/progress.h"

namespace lumi {

// Throws UsageError (options, somebody else's folder), InputError (unreadable input), DataError (the photos do not
// allow it), MachineError (no COLMAP, cannot write), Interrupted. What a killed run left in SCENE/colmap is gone on
// with.
ReconstructSummary Reconstruct(const ReconstructOptions& options, ProgressSink& sink);

}  // namespace lumi
