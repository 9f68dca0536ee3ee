// Features found and matched here, without COLMAP, and written into its database: from there COLMAP's mapper goes on as
// from its own. docs/features.md says how, and what was measured.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/features.h"
#include "reconstruct/photos.h"

namespace lumi {

struct PhotosToSearch {
  std::filesystem::path folder;
  std::vector<InputPhoto> photos;  // in the order of their ids
  std::filesystem::path masks;     // may be empty
  CameraPlan cameras;
  FeatureLimits limits;
  std::string task = "finding features";
};

// Makes the database where there is none (COLMAP does, so that its tables are those of the installed version) and adds
// the photos that it does not have, each as soon as those before it are there. A photo that cannot be read is left out,
// and a message says so. False, and nothing is written, where the installed COLMAP wants tables that are not written
// here (3.12 and later: rigs). Throws MachineError.
bool FindOwnFeatures(const PhotosToSearch& photos, const std::filesystem::path& database, const ColmapJob& job);

// Matches the pairs (of indices into `names`, first < second) that are not in the database yet, verifies them, and
// writes both, some at a time.
void MatchOwnFeatures(const std::vector<std::string>& names, const std::vector<std::pair<int, int>>& pairs,
                      const std::filesystem::path& database, const ColmapJob& job);

}  // namespace lumi
