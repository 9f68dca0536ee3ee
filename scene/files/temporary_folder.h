// A folder for files that nobody keeps; gone with the object.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "scene/program/error.h"

namespace lumi {

class TemporaryFolder {
 public:
  // In TMPDIR. Throws MachineError where it cannot be made.
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "lumigraph-XXXXXX").string();
    if (!::mkdtemp(pattern.data()))
      throw MachineError("cannot make a temporary folder", "set TMPDIR to a folder with room", pattern);
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace lumi
