// File names for pictures made from a photo: its path below images/, without the ending, folders joined by '_'.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

namespace lumi {

inline std::string OutputName(const std::string& view_name) {
  std::string name = std::filesystem::path(view_name).replace_extension().generic_string();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace lumi
