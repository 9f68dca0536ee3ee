// nerfstudio's camera path JSON, as its viewer writes and ns-render reads it: "camera_path" holds every frame,
// "keyframes" what they were made from. Its cameras have x right, y up and z back, camera_to_world is row-major, fov
// the vertical angle in degrees. The world is the scene's own: nerfstudio trains in a frame that it has turned, moved
// and scaled (its dataparser_transforms.json), and a path of such a frame has to be brought back first.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "render/path/camera_path.h"

namespace lumi {

bool IsNerfstudioPath(const nlohmann::json& j);

// kFrames: one key per frame, and as many frames; kKeyframes: its keyframes, interpolated as our paths are, if they
// have times. Throws InputError (the file and the entry) and nlohmann's exceptions.
CameraPath ParseNerfstudioPath(const nlohmann::json& j, const std::filesystem::path& file, PathDetail detail);

// width_px, height_px: the frames' size where the path has none. Atomically.
void WriteNerfstudioPath(const std::filesystem::path& file, const CameraPath& path, int width_px, int height_px);

}  // namespace lumi
