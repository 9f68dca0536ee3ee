// Reprojection errors of a scene's points under its own cameras, distorted ones included.
#pragma once

#include "scene/model/scene.h"

namespace lumi {

// Sets every point's error_px; returns the mean over all observations. An observation behind its camera counts as
// kBehindCameraPx.
double UpdatePointErrors(Scene& scene);
constexpr double kBehindCameraPx = 1e3;

}  // namespace lumi
