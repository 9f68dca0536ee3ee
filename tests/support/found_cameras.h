// A scene's cameras against those that took its simulated photos.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "scene/files/colmap_model.h"
#include "scene/geometry/similarity3.h"

namespace lumi {

struct FoundCameras {
  std::size_t photos = 0, cameras = 0;
  PoseErrors errors;
};

// true_name: the name that a photo of the scene has in the capture; empty: it is left out.
inline FoundCameras CompareWithCapture(
    const std::filesystem::path& scene, const std::filesystem::path& capture,
    const std::function<std::string(const std::string&)>& true_name = [](const std::string& name) { return name; }) {
  std::map<std::string, Rigid3> truth;
  for (const View& view : ReadColmapModel(capture / "truth" / "sparse").views) truth[view.name] = view.cam_from_world;
  const Scene made = ReadColmapModel(scene / "sparse");
  std::vector<Rigid3> found, wanted;
  for (const View& view : made.views) {
    const std::string name = true_name(view.name);
    if (name.empty()) continue;
    found.push_back(view.cam_from_world);
    wanted.push_back(truth.at(name));
  }
  return {found.size(), made.cameras.size(), ComparePoses(found, wanted)};
}

}  // namespace lumi
