// Keyframes of a camera path as an editor changes them. Times always ascend, at least kLeastGap_s apart; the path
// begins at the first key's time, which need not be 0.
#pragma once

#include <cstddef>

#include "render/path/camera_path.h"

namespace lumi {

constexpr double kLeastGap_s = 0.01;

// Inserts a key in the order of times; if a key with that time exists, a little later. Returns its index.
std::size_t InsertKey(CameraPath& path, PathKey key);
// Another camera at the same time.
void ReplaceKey(CameraPath& path, std::size_t index, const PathKey& key);
void DeleteKey(CameraPath& path, std::size_t index);
// Changes a key's time and moves it to its place in the order. Returns its new index.
std::size_t RetimeKey(CameraPath& path, std::size_t index, double time_s);
// Scales all times so that the path lasts this long, > 0 (in proportion; short gaps grow to kLeastGap_s).
void StretchTo(CameraPath& path, double seconds);

}  // namespace lumi
