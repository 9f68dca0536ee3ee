// Keyframes of a camera path as an editor changes them. Times ascend strictly whatever is asked for, kLeastGap_s apart;
// the first key's time is the path's beginning, wherever on the clock.
#pragma once

#include <cstddef>

#include "render/path/camera_path.h"

namespace lumi {

constexpr double kLeastGap_s = 0.01;

// Puts a key where its time belongs; where one stands already, a little after it. Returns its index.
std::size_t InsertKey(CameraPath& path, PathKey key);
// Another camera at the same time.
void ReplaceKey(CameraPath& path, std::size_t index, const PathKey& key);
void DeleteKey(CameraPath& path, std::size_t index);
// Gives a key another time, and the place in the order that goes with it. Returns its index.
std::size_t RetimeKey(CameraPath& path, std::size_t index, double time_s);
// Scales all times so that the path lasts this long, > 0 (in proportion; short gaps grow to kLeastGap_s).
void StretchTo(CameraPath& path, double seconds);

}  // namespace lumi
