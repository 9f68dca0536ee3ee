// Cameras that are there already: what INPUT holds beside the photos.
#pragma once

#include "reconstruct/options.h"
#include "scene/program/progress.h"

namespace lumi {

// The word of --poses with which cameras beside the photos are not used.
constexpr const char* kCamerasAnew = "none";

// Where INPUT is a transforms.json, or a folder with one or with a COLMAP model beside its photos, `input` becomes the
// folder of the photos and `poses` that file or folder, as if --poses had said so; with --poses none `poses` stays
// empty, and cameras are found anew. Where the cameras lie beside the folder of photos that is INPUT, a message says
// how to use them. Throws UsageError for a scene or capture of ours, naming the folder of its photos; InputError.
void TakeCamerasBeside(ReconstructOptions& options, ProgressSink& sink);

}  // namespace lumi
