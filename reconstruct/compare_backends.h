// Two backends, one capture: what each found is kept beside the scene, and compared when both have run.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "reconstruct/options.h"
#include "scene/model/scene.h"

namespace lumi {

// Where they are kept.
std::filesystem::path CamerasOf(Backend backend, const std::filesystem::path& scene_folder);

// Keeps a metric scene's cameras in SCENE/provenance/cameras-BACKEND.json and compares them with the other backend's,
// where that has run on the same input (`fingerprint`) in this folder; nullopt where it has not, or where fewer than
// three photos have a camera in both.
std::optional<BackendComparison> KeepAndCompare(const Scene& scene, const ReconstructSummary& summary,
                                                const std::string& fingerprint,
                                                const std::filesystem::path& scene_folder);

}  // namespace lumi
