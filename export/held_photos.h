// How finely an export holds a scene's photos: all of them are in memory at once.
#pragma once

#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// How often photos are halved when they are read (PhotoOptions::halvings), so that `copies` of all of them fit into six
// tenths of the free memory and all together have at most so many pixels; 0: no bound. Says so where memory is the
// reason. Throws MachineError where not even photos of some hundred pixels fit.
int HalvingsToHold(const Scene& scene, double most_pixels, double copies, ProgressSink& sink);

}  // namespace lumi
