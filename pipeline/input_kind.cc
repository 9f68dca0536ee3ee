#include "pipeline/input_kind.h"

#include <algorithm>

#include "scene/files/colmap_model.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;

InputKind ClassifyInput(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error))
    throw UsageError(path.string() + " does not exist", "give a folder of photos or a video");
  if (!fs::is_directory(path, error)) return InputKind::kCapture;
  if (fs::exists(path / "lumigraph.json", error)) return InputKind::kOurScene;
  if (FindColmapModel(path)) return InputKind::kWorkspace;
  return InputKind::kCapture;
}

bool IsWithin(const fs::path& inner, const fs::path& outer) {
  fs::path a = fs::weakly_canonical(fs::absolute(inner)), b = fs::weakly_canonical(fs::absolute(outer));
  if (!a.has_filename()) a = a.parent_path();
  if (!b.has_filename()) b = b.parent_path();
  const auto [end_b, unused] = std::mismatch(b.begin(), b.end(), a.begin(), a.end());
  return end_b == b.end();
}

}  // namespace lumi
