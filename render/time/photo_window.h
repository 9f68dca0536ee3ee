// The photos around a picture's moment (thesis sec. 6.4.3).
#pragma once

#include <optional>
#include <string>

#include "render/radiance/decided.h"
#include "render/radiance/settings.h"
#include "scene/model/scene.h"

namespace lumi {

// Sets how a picture uses the photos around its moment, except what is `decided`: 5 to either side for a video or a
// path of matrices (frame and photo go together), else all. If not all: gives photos times, and switches on time (from
// the middle of the window on), field of view and, along a path, a fade before a photo ends. Returns the reach, -1:
// all.
int TakeWindow(Scene& scene, std::optional<int> wanted, bool along_path, Decided& decided, RadianceSettings& settings);

}  // namespace lumi
