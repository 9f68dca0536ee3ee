// Depth maps on disk: COLMAP's dense workspace (SCENE/stereo/depth_maps, normal_maps), which other tools read and
// write, and our own planes, which stereo goes on from.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "proxy/dense/depth_map.h"
#include "proxy/dense/stereo_camera.h"
#include "scene/model/image.h"

namespace lumi {

// COLMAP's matrix of floats: "width&height&channels&", then little-endian floats, channel by channel, rows from the
// top. Throws InputError where counts and the file's size do not fit.
ImageF ReadColmapMatrix(const std::filesystem::path& file);
void WriteColmapMatrix(const std::filesystem::path& file, const ImageF& matrix);

// stereo/depth_maps/PHOTO.geometric.bin (depth along the camera's axis, 0: none) and stereo/normal_maps/ (unit, in the
// camera's frame, towards it), at the map's size. `keep`: pixels that are written, by cost; others are 0.
void WriteColmapDepth(const std::filesystem::path& stereo, const std::string& photo, const StereoCamera& camera,
                      const DepthMap& map, float max_cost);
// The same from somebody else's, geometric where there is one, else photometric; planes face the camera where there
// are no normals. Costs are 0: whoever made them kept what he trusted. None where the photo has no map.
std::optional<DepthMap> ReadColmapDepth(const std::filesystem::path& stereo, const std::string& photo,
                                        const StereoCamera& of_photo);
// Lists of photos and their sources as COLMAP's patch_match_stereo and stereo_fusion read them.
void WriteColmapLists(const std::filesystem::path& stereo, const std::vector<std::string>& photos);

// Planes and costs as they are. Throws InputError.
void WritePlanes(const std::filesystem::path& file, const DepthMap& map);
DepthMap ReadPlanes(const std::filesystem::path& file);

}  // namespace lumi
