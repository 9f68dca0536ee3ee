// What a path given as INPUT is, decided by looking at names only.
#pragma once

#include <filesystem>

namespace lumi {

enum class InputKind {
  kCapture,    // photos or a video: cameras are to be found by lumi-reconstruct
  kOurScene,   // a folder with lumigraph.json
  kWorkspace,  // somebody's COLMAP workspace: images + sparse
};

// Throws UsageError where there is nothing at `path`.
InputKind ClassifyInput(const std::filesystem::path& path);

// Whether `inner` is `outer` or lies below it (links resolved; neither needs to exist).
bool IsWithin(const std::filesystem::path& inner, const std::filesystem::path& outer);

}  // namespace lumi
