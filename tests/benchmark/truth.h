// Published or simulated true cameras, in the forms that captures come with.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "scene/geometry/similarity3.h"
#include "scene/model/scene.h"

namespace lumi {

// Name of a photo without folders and ending -> its true pose.
using TruePoses = std::map<std::string, Rigid3>;

// A folder of NAME.camera files (Strecha's: K, a row of zeros, M = R^T, the centre C; a world point X projects as
// K M^T (X - C)), a transforms.json, or a COLMAP model. Throws InputError.
TruePoses ReadTruePoses(const std::filesystem::path& path);

// Over the photos that both have; nullopt below three.
std::optional<PoseErrors> CompareWithTruth(const Scene& scene, const TruePoses& truth);

// Photos whose camera's centre is off by more than `factor` times the median error, after the better half of all
// cameras was aligned with the truth, whatever the others do.
std::vector<std::string> FarOff(const Scene& scene, const TruePoses& truth, double factor);

// How many cameras are off by ten times the median error, and the summary has no remark on them.
std::size_t FarOffUnnamed(const Scene& scene, const TruePoses& truth, const ReconstructSummary& summary);

}  // namespace lumi
