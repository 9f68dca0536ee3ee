// Nothing half-written: a file is written beside its name and renamed when complete; a folder likewise. A scene folder
// is locked while it is written.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace lumi {

// Calls `write` with a temporary path in the same folder (hidden, same extension) and renames it over `path`. `write`
// must have closed the file and checked that it could. Removes the temporary when `write` throws. Creates missing
// parent folders. Throws MachineError (disk full, not writable), naming the file.
void WriteFileAtomically(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);
void WriteTextAtomically(const std::filesystem::path& path, const std::string& text);

// As WriteTextAtomically, for any bytes.
void WriteBytesAtomically(const std::filesystem::path& path, const void* data, std::size_t size);

// Removes the temporaries that killed processes left in a folder and below it (those whose process is gone).
void RemoveStaleTemporaries(const std::filesystem::path& folder);

// The whole file; throws InputError when it cannot be read or is larger than max_bytes.
std::string ReadText(const std::filesystem::path& path, std::size_t max_bytes = std::size_t(1) << 30);

// A lock on a folder (LOCK file with the owner's process id, flock: gone with the process, also after kill -9).
// Throws MachineError naming the other process where it is taken.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);  // creates the folder
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
  std::filesystem::path path_;
};

// An output folder that may be written into: absent, empty (but for a lock or temporaries of ours), or one that this
// suite made (it holds a lumigraph.json or `marker`). Anything else is somebody's own: throws UsageError, nothing
// touched.
void RequireOurFolder(const std::filesystem::path& folder, const std::string& marker = "lumigraph.json");

}  // namespace lumi
