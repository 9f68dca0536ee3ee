// A scene as a proxy for an evaluation may know it: without what some of its photos saw.
#pragma once

#include <vector>

#include "scene/model/scene.h"

namespace lumi {

// Points have lost the observations of the others, and those that fewer than two photos see are gone. All cameras stay:
// they were found from all photos in any case, and a proxy may use that their places are empty.
Scene WithPhotos(const Scene& scene, const std::vector<bool>& keep);

// Photos that remain when k, k + 5, k + 10 ... are left out (kProxiesForEach), and their twins with them.
std::vector<bool> PhotosWithoutEach(const Scene& scene, int k);

// Photos that remain when those of `--holdout n` are left out, and with `choosing` those that anything is chosen
// on; their twins go with them.
std::vector<bool> PhotosWithoutFolds(const Scene& scene, int n, bool choosing);

}  // namespace lumi
