// Small copies of all photos of a scene, which stand in where a photo is not in memory: made once, and kept beside the
// scene as SCENE/small-photos/HALVINGS.
#pragma once

#include <vector>

#include "render/photos/photo_set.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// Whether they can be kept: the scene is a folder of ours. Others are not written to.
bool KeepsSmallPhotos(const Scene& scene);

// Whether a scene has so many photos that small copies are worth a pass over all of them, and can keep them.
bool CallsForSmallPhotos(const Scene& scene);

// All photos, halved so often (CopyHalvings), corrected as their views say. Reads the kept copies where the photos'
// names, sizes and times are those that they were made from; else makes them, which reads every photo, and keeps them
// if that is possible. Throws InputError for a photo that cannot be read.
std::vector<Photo> ReadSmallPhotos(const Scene& scene, int halvings, ProgressSink& sink);

}  // namespace lumi
