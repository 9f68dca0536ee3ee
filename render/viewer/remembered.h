// What the viewer keeps from one day to the next: the window's size, and whether the panel is shown.
#pragma once

#include <filesystem>

#include "scene/files/json_keys.h"

namespace lumi {

struct Remembered {
  int width_px = 1280, height_px = 800;
  bool panel = true;
};
void ListKeys(JsonKeys& j, Remembered& r);

// lumigraph/view.json in the user's folder of settings (XDG_CONFIG_HOME, else ~/.config); empty: there is no such
// folder.
std::filesystem::path RememberedFile();
// What the file says, as far as it can be used: the rest is as by default.
Remembered Remember(const std::filesystem::path& file);
// A file that cannot be written is nobody's loss.
void Keep(const Remembered& r, const std::filesystem::path& file);

}  // namespace lumi
