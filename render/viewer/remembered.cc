#include "render/viewer/remembered.h"

#include <cstdlib>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kSmallestSide = 160, kLargestSide = 8192;

}  // namespace

void ListKeys(JsonKeys& j, Remembered& r) { j("width", r.width_px, "height", r.height_px, "panel", r.panel); }

fs::path RememberedFile() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder = config != nullptr && config[0] == '/' ? fs::path(config)
                    : home != nullptr && home[0] == '/'   ? fs::path(home) / ".config"
                                                          : fs::path();
  return folder.empty() ? folder : folder / "lumigraph" / "view.json";
}

Remembered Remember(const fs::path& file) {
  std::error_code error;
  if (file.empty() || !fs::is_regular_file(file, error)) return {};
  Remembered kept;
  try {
    kept = JsonKeys::Read(file, "settings of lumi-view").As<Remembered>();
  } catch (const Error&) {
    return {};
  }
  const auto fits = [](int side) { return side >= kSmallestSide && side <= kLargestSide; };
  if (!fits(kept.width_px) || !fits(kept.height_px)) {
    kept.width_px = Remembered().width_px;
    kept.height_px = Remembered().height_px;
  }
  return kept;
}

void Keep(const Remembered& r, const fs::path& file) {
  if (file.empty()) return;
  try {
    WriteTextAtomically(file, JsonKeys(r).Text(1) + "\n");
  } catch (const Error&) {
  }
}

}  // namespace lumi
