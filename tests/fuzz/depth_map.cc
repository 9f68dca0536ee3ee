// COLMAP's dense maps: depth, and normals beside it that are the same file where it has three channels.
#include <cmath>

#include "proxy/dense/depth_files.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(depth_map) {
  const std::filesystem::path file = InputFile("stereo/depth_maps/photo.jpg.geometric.bin", bytes);
  std::filesystem::remove(InputFolder() / "stereo/normal_maps/photo.jpg.geometric.bin");  // of the input before
  const ImageF matrix = ReadColmapMatrix(file);
  Require(matrix.width > 0 && matrix.height > 0 && matrix.channels > 0, "a map of nothing");
  if (matrix.channels == 3) {  // as normals of a depth map of ones
    ImageF depth(matrix.width, matrix.height, 1);
    for (float& d : depth.data) d = 1;
    InputFile("stereo/normal_maps/photo.jpg.geometric.bin", bytes);
    WriteColmapMatrix(file, depth);
  }
  StereoCamera camera;
  camera.width = 2 * matrix.width;
  camera.height = 2 * matrix.height;
  camera.focal_px = {100, 100};
  camera.centre_px = {50, 50};
  const auto map = ReadColmapDepth(InputFolder() / "stereo", "photo.jpg", camera);
  Require(map.has_value(), "the map is there");
  for (std::size_t p = 0; p < map->Pixels(); ++p)
    Require(std::isfinite(map->w[p]) && map->w[p] >= 0 && std::isfinite(map->gx[p]) && std::isfinite(map->gy[p]),
            "a plane is not finite");
}

}  // namespace lumi::fuzz
