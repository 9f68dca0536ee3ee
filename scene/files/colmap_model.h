// COLMAP sparse models, binary and text (cameras, images, points3D); points3D may be missing. Checked against the size
// of the file before anything is allocated.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct ColmapModelFolder {
  std::filesystem::path path;
  std::uint64_t images = 0;
};
// The folder itself or its sparse/; else sparse/0, sparse/1 ... or 0, 1 ... below it, that with the most images first,
// of equals the first. Empty where there is none.
std::vector<ColmapModelFolder> FindColmapModels(const std::filesystem::path& folder);
// The first of them.
std::optional<std::filesystem::path> FindColmapModel(const std::filesystem::path& folder);

// Views sorted by name, cameras and points renumbered; 2D points without a 3D point are dropped. image_folder is left
// empty. Binary is preferred where both are there. Throws InputError; for a camera model beyond Camera's six it names
// it.
Scene ReadColmapModel(const std::filesystem::path& folder);

enum class ColmapFormat { kBinary, kText };
// All of one model's files, each atomically; files of the other format (and rigs and frames) are removed, they would
// contradict them. Ids are positions + 1. Metric scenes only (DataError). COLMAP itself cannot read names with blanks
// from text; from binary it can.
void WriteColmapModel(const Scene& scene, const std::filesystem::path& folder,
                      ColmapFormat format = ColmapFormat::kBinary);

}  // namespace lumi
