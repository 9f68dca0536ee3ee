// A scene without some of its photos: what a proxy for an evaluation is made of.
#pragma once

#include <vector>

#include "scene/model/scene.h"

namespace lumi {

// The views with `keep` and the points that at least two of them see; cameras are as they were.
Scene WithViews(const Scene& scene, const std::vector<bool>& keep);

// Photos that remain when those of `--holdout n` are left out, and with `choosing` those that anything is chosen on.
std::vector<bool> ViewsWithoutFolds(const Scene& scene, int n, bool choosing);

}  // namespace lumi
