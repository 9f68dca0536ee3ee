// The room in which things turn: a table before shelves and posters, all of it still, with detail at every depth for the
// camera to be placed by.
#pragma once

#include "simulate/examples/scene_builder.h"

namespace lumi {

void AddPeriodicRoom(SceneBuilder& scene);

// Materials "paper" and "iron", of what turns there.
void AddPaperAndIron(SceneBuilder& scene);

}  // namespace lumi
