// A capture of memory as a scene on disk, with its true proxy.
#pragma once

#include <filesystem>

#include "capture.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"

namespace lumi::test {

// The proxy is called "truth" and is the active one. Photos are written as they are named.
inline void WriteAsScene(Capture& c, const std::filesystem::path& folder) {
  c.scene.image_folder = folder / "images";
  for (std::size_t i = 0; i < c.photos.size(); ++i)
    WriteImage(c.scene.image_folder / c.scene.views[i].name, c.photos[i].levels[0]);
  c.scene.active_proxy = "truth";
  WriteScene(c.scene, folder);
  WriteMesh(ProxyPath(folder, "truth"), c.proxy);
}

}  // namespace lumi::test
