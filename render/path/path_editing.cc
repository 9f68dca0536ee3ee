#include "render/path/path_editing.h"

#include <algorithm>
#include <stdexcept>

namespace lumi {
namespace {

void RequireKey(const CameraPath& path, std::size_t index) {
  if (index >= path.keys.size()) throw std::out_of_range("the path has no such key");
}

// Moves keys from `first` on to later times if they are too close to the one before.
void Separate(CameraPath& path, std::size_t first) {
  for (std::size_t i = std::max<std::size_t>(first, 1); i < path.keys.size(); ++i)
    path.keys[i].time_s = std::max(path.keys[i].time_s, path.keys[i - 1].time_s + kLeastGap_s);
}

}  // namespace

std::size_t InsertKey(CameraPath& path, PathKey key) {
  path.frames = 0;
  const auto after = std::upper_bound(path.keys.begin(), path.keys.end(), key.time_s,
                                      [](double t, const PathKey& k) { return t < k.time_s; });
  const auto index = static_cast<std::size_t>(after - path.keys.begin());
  path.keys.insert(after, key);
  Separate(path, index);
  return index;
}

void ReplaceKey(CameraPath& path, std::size_t index, const PathKey& key) {
  RequireKey(path, index);
  path.frames = 0;
  const double time_s = path.keys[index].time_s;
  path.keys[index] = key;
  path.keys[index].time_s = time_s;
}

void DeleteKey(CameraPath& path, std::size_t index) {
  RequireKey(path, index);
  path.frames = 0;
  path.keys.erase(path.keys.begin() + static_cast<std::ptrdiff_t>(index));
}

std::size_t RetimeKey(CameraPath& path, std::size_t index, double time_s) {
  RequireKey(path, index);
  PathKey key = path.keys[index];
  key.time_s = time_s;
  DeleteKey(path, index);
  return InsertKey(path, key);
}

void StretchTo(CameraPath& path, double seconds) {
  if (!(seconds > 0)) throw std::invalid_argument("StretchTo: a path lasts longer than 0 s");
  const double duration = Duration(path);
  if (!(duration > 0)) return;
  path.frames = 0;
  const double start = path.keys.front().time_s;
  for (PathKey& key : path.keys) key.time_s = start + (key.time_s - start) * (seconds / duration);
  Separate(path, 1);
}

}  // namespace lumi
