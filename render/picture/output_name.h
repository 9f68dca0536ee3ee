// File names for pictures made from a photo: its path below images/, without the ending, folders joined by '_'.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

inline std::string OutputName(const std::string& view_name) {
  std::string name = std::filesystem::path(view_name).replace_extension().generic_string();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

// Where another photo of the scene would have that name, too (they differ by their ending), the ending stays.
inline std::string OutputName(const std::vector<View>& views, const std::string& view_name) {
  const std::string name = OutputName(view_name);
  const auto same =
      std::count_if(views.begin(), views.end(), [&](const View& v) { return OutputName(v.name) == name; });
  if (same < 2) return name;
  std::string whole = view_name;
  std::replace(whole.begin(), whole.end(), '/', '_');
  return whole;
}

}  // namespace lumi
