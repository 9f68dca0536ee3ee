// The photos around a picture's moment (thesis sec. 6.4.3).
#pragma once

#include <optional>
#include <string>

#include "render/radiance/decided.h"
#include "render/radiance/settings.h"
#include "scene/model/scene.h"

namespace lumi {

// How a picture uses the photos around its moment, where nobody `decided` otherwise: 5 to either side where the scene
// is a video's or the picture is of a path of matrices (frame and photo go together), else all. Photos get times, time
// counts from the middle of the window on, fields of view are looked at, and along a path a photo gives way before it
// ends. Returns the reach, -1: all.
int TakeWindow(Scene& scene, std::optional<int> wanted, bool along_path, Decided& decided, RadianceSettings& settings);

}  // namespace lumi
