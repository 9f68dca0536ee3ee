// Inside scene/files only.
#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

namespace lumi {

// ".jpg" of "A.JPG".
inline std::string LowerExtension(const std::filesystem::path& path) {
  std::string e = path.extension().string();
  std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return e;
}

}  // namespace lumi
