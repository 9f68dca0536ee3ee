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

// Whether a name that a file gives stays in the folder it is looked for in, for reading and writing.
inline bool StaysWithin(const std::string& name) {
  const std::filesystem::path path(name);
  return !name.empty() && name.find('\0') == std::string::npos && !path.is_absolute() &&
         std::find(path.begin(), path.end(), "..") == path.end();
}

}  // namespace lumi
