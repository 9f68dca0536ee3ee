// A folder for files that nobody keeps; gone with the object.
#pragma once

#include <filesystem>
#include <string>

namespace lumi {

class TemporaryFolder {
 public:
  // In TMPDIR. Removes those that killed processes of this user left there: older than an hour, and nobody's (a lock on
  // the folder is gone with its process). Throws MachineError where the folder cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace lumi
