// nerfstudio's and instant-ngp's transforms.json: camera-to-world 4x4 in the OpenGL convention (x right, y up, z back).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

// Frames whose file is absent are left out and named in *skipped (if given); .png or .jpg is added to a name that has
// no ending. image_folder is the JSON's folder, or the deepest folder that holds it and all photos. Intrinsics may
// stand at the top or at a frame; without w and h the photo is asked. A file_path leads to the folder of the JSON, or
// the one above it (../images is common), and not out of these. Throws InputError.
Scene ReadTransformsJson(const std::filesystem::path& path, std::vector<std::string>* skipped = nullptr);
// file_path is relative to the file's folder. DataError for photos that it cannot name, and for a scene that is not
// metric.
void WriteTransformsJson(const Scene& scene, const std::filesystem::path& path);

}  // namespace lumi
