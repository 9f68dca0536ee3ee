#include "proxy/dense/depth_files.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "floats are read and written as they are in memory");
constexpr std::string_view kPlanesMagic = "lumigraph planes 1\n";
constexpr int kLargestSide = 1 << 16;
constexpr double kSteepest = 1e30;  // change of inverse depth a pixel: float holds it, and no surface has it

fs::path MapFile(const fs::path& stereo, const char* folder, const std::string& photo, const char* kind) {
  return stereo / folder / (photo + "." + kind + ".bin");
}

void PutFloats(std::string& bytes, const std::vector<float>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

// The unit normal of a pixel's plane, towards the camera. On the plane X = ray / w with w affine in the pixel, so
// n . X = 1 has n = (gx fx, gy fy, w - ...) up to sign and length.
Eigen::Vector3d NormalOf(const StereoCamera& camera, const DepthMap& map, int x, int y) {
  const std::size_t p = map.At(x, y);
  const Eigen::Vector3d ray = camera.Ray(x + 0.5, y + 0.5);
  Eigen::Vector3d n(map.gx[p] * camera.focal_px.x(), map.gy[p] * camera.focal_px.y(), 0);
  n.z() = map.w[p] - n.x() * ray.x() - n.y() * ray.y();
  return -n.normalized();
}

}  // namespace

ImageF ReadColmapMatrix(const fs::path& file) {
  const std::string bytes = ReadText(file);
  const char* at = bytes.data();
  const char* end = at + bytes.size();
  int size[3] = {};
  for (int& side : size) {
    const auto [next, error] = std::from_chars(at, end, side);
    if (error != std::errc() || next == end || *next != '&' || side < 1 || side > kLargestSide)
      throw InputError(file, "does not begin with width&height&channels&", "is it one of COLMAP's depth maps?");
    at = next + 1;
  }
  const std::size_t values =
      static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  if (size[2] > 16 || static_cast<std::size_t>(end - at) != values * sizeof(float))
    throw InputError(file, fmt::format("holds {} bytes where {}x{}x{} floats need {}: it is cut off or corrupt",
                                       end - at, size[0], size[1], size[2], values * sizeof(float)));
  ImageF image(size[0], size[1], size[2]);
  const std::size_t pixels = values / static_cast<std::size_t>(size[2]);
  for (std::size_t c = 0; c < static_cast<std::size_t>(size[2]); ++c)
    for (std::size_t p = 0; p < pixels; ++p)
      std::memcpy(&image.data[p * static_cast<std::size_t>(size[2]) + c], at + (c * pixels + p) * sizeof(float),
                  sizeof(float));
  return image;
}

void WriteColmapMatrix(const fs::path& file, const ImageF& matrix) {
  std::string bytes = fmt::format("{}&{}&{}&", matrix.width, matrix.height, matrix.channels);
  const auto channels = static_cast<std::size_t>(matrix.channels);
  const std::size_t pixels = matrix.data.size() / channels;
  std::vector<float> planar(matrix.data.size());
  for (std::size_t c = 0; c < channels; ++c)
    for (std::size_t p = 0; p < pixels; ++p) planar[c * pixels + p] = matrix.data[p * channels + c];
  PutFloats(bytes, planar);
  WriteBytesAtomically(file, bytes.data(), bytes.size());
}

void WriteColmapDepth(const fs::path& stereo, const std::string& photo, const StereoCamera& camera, const DepthMap& map,
                      float max_cost) {
  ImageF depth(map.width, map.height, 1), normal(map.width, map.height, 3);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t p = map.At(x, y);
      if (!(map.w[p] > 0) || !(map.cost[p] <= max_cost)) continue;
      depth.data[p] = 1 / map.w[p];
      const Eigen::Vector3f n = NormalOf(camera, map, x, y).cast<float>();
      for (int c = 0; c < 3; ++c) normal.At(x, y, c) = n[c];
    }
  }
  WriteColmapMatrix(MapFile(stereo, "depth_maps", photo, "geometric"), depth);
  WriteColmapMatrix(MapFile(stereo, "normal_maps", photo, "geometric"), normal);
}

std::optional<DepthMap> ReadColmapDepth(const fs::path& stereo, const std::string& photo,
                                        const StereoCamera& of_photo) {
  for (const char* kind : {"geometric", "photometric"}) {
    const fs::path file = MapFile(stereo, "depth_maps", photo, kind);
    std::error_code error;
    if (!fs::exists(file, error)) continue;
    const ImageF depth = ReadColmapMatrix(file);
    if (depth.channels != 1) throw InputError(file, "has more than one value a pixel", "is it a normal map?");
    const double shape = static_cast<double>(depth.width) / depth.height,
                 photos = static_cast<double>(of_photo.width) / of_photo.height;
    if (std::abs(shape / photos - 1) > 0.02)
      throw InputError(file,
                       fmt::format("is {} x {}, its photo {} x {}: not the same shape", depth.width, depth.height,
                                   of_photo.width, of_photo.height),
                       "do the maps belong to these photos?");
    DepthMap map(depth.width, depth.height);
    for (std::size_t p = 0; p < map.Pixels(); ++p)
      if (depth.data[p] > 0 && std::isfinite(1 / depth.data[p])) map.w[p] = 1 / depth.data[p];
    const fs::path normals = MapFile(stereo, "normal_maps", photo, kind);
    if (!fs::exists(normals, error)) return map;
    const ImageF normal = ReadColmapMatrix(normals);
    if (normal.channels != 3 || normal.width != depth.width || normal.height != depth.height)
      throw InputError(normals, "does not fit its depth map");
    const StereoCamera camera = Resized(of_photo, map.width, map.height);
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const Eigen::Vector3d n(normal.At(x, y, 0), normal.At(x, y, 1), normal.At(x, y, 2));
        const double facing = n.dot(camera.Ray(x + 0.5, y + 0.5));
        const std::size_t p = map.At(x, y);
        if (!(map.w[p] > 0) || !(std::abs(facing) > 0.05 * n.norm())) continue;  // from its edge: no slope to speak of
        const double gx = map.w[p] * n.x() / facing / camera.focal_px.x(),
                     gy = map.w[p] * n.y() / facing / camera.focal_px.y();
        if (!(std::abs(gx) < kSteepest) || !(std::abs(gy) < kSteepest)) continue;
        map.gx[p] = static_cast<float>(gx);
        map.gy[p] = static_cast<float>(gy);
      }
    }
    return map;
  }
  return std::nullopt;
}

void WriteColmapLists(const fs::path& stereo, const std::vector<std::string>& photos) {
  std::string fusion, match;
  for (const std::string& photo : photos) {
    fusion += photo + "\n";
    match += photo + "\n__auto__, 20\n";
  }
  WriteTextAtomically(stereo / "fusion.cfg", fusion);
  WriteTextAtomically(stereo / "patch-match.cfg", match);
}

void WritePlanes(const fs::path& file, const DepthMap& map) {
  std::string bytes(kPlanesMagic);
  for (const std::int32_t side : {map.width, map.height})
    bytes.append(reinterpret_cast<const char*>(&side), sizeof side);
  for (const std::vector<float>* values : {&map.w, &map.gx, &map.gy, &map.cost}) PutFloats(bytes, *values);
  WriteBytesAtomically(file, bytes.data(), bytes.size());
}

DepthMap ReadPlanes(const fs::path& file) {
  const std::string bytes = ReadText(file);
  const std::size_t head = kPlanesMagic.size() + 2 * sizeof(std::int32_t);
  if (bytes.size() < head || !bytes.starts_with(kPlanesMagic)) throw InputError(file, "is no map of planes");
  std::int32_t size[2];
  std::memcpy(size, bytes.data() + kPlanesMagic.size(), sizeof size);
  if (size[0] < 1 || size[1] < 1 || size[0] > kLargestSide || size[1] > kLargestSide ||
      bytes.size() - head != 16 * static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]))
    throw InputError(file, "is cut off or corrupt", "remove it, and it is made again");
  DepthMap map(size[0], size[1]);
  const char* at = bytes.data() + head;
  for (std::vector<float>* values : {&map.w, &map.gx, &map.gy, &map.cost}) {
    std::memcpy(values->data(), at, values->size() * sizeof(float));
    at += values->size() * sizeof(float);
  }
  return map;
}

}  // namespace lumi
