// How much a path of matrices shakes.
#pragma once

#include <vector>

#include "stabilize/filmed_scene.h"

namespace lumi {

// Pixels, RMS: the part above 1 Hz of where the points' images move under P. Along each point, at the frames that see
// it: what a parabola under a window of two seconds leaves over. 0 where no point is seen for half a second. Of a video
// shorter than two seconds the window is the whole of it.
double ShakePx(const FilmedScene& film, const std::vector<Matrix34d>& P);

}  // namespace lumi
