// Nothing half-written: a file is written beside its name and renamed when complete; a folder likewise. A scene folder
// is locked while it is written.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace lumi {

// Calls `write` with a temporary path in the same folder (hidden, same extension) and renames it over `path`. `write`
// must have closed the file and checked that it could. Removes the temporary when `write` throws. Creates missing
// parent folders. A process that writes into a folder for the first time also removes the temporaries of killed
// processes there. Throws MachineError (disk full, not writable), naming the file.
void WriteFileAtomically(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);
void WriteTextAtomically(const std::filesystem::path& path, const std::string& text);

// Before work of minutes: throws MachineError where a file of this name cannot be written. Nothing is made.
void RequireWritable(const std::filesystem::path& path);

// Such a temporary's name, for who writes a file in the course of time and puts it into its place himself: hidden,
// beside `path`, with its extension, of at most 255 bytes. `who` tells several of one process apart.
std::filesystem::path TemporaryBeside(const std::filesystem::path& path, const std::string& who);

// As WriteTextAtomically, for any bytes.
void WriteBytesAtomically(const std::filesystem::path& path, const void* data, std::size_t size);

// Held while a temporary stands in a folder, so that no other program takes it for one that a killed run left: a shared
// flock on the folder, which is seen from other containers and gone with the process. WriteFileAtomically holds one;
// whoever lets another program write a temporary holds one, too. Where the file system knows no locks it does nothing.
class FolderInUse {
 public:
  explicit FolderInUse(const std::filesystem::path& folder);
  ~FolderInUse();
  FolderInUse(const FolderInUse&) = delete;
  FolderInUse& operator=(const FolderInUse&) = delete;

 private:
  int fd_ = -1;
};

// Removes the temporaries that killed processes left in a folder and below it. What another run is writing now stays: a
// temporary is kept where its folder is in use (see above) or where the process whose number stands in its name runs.
// If another process has that number by now, the temporary is kept for a day at most. Folders that hold kMadeInParts
// are passed over: processes of other machines may be writing there.
inline constexpr const char* kMadeInParts = "parts.txt";
void RemoveStaleTemporaries(const std::filesystem::path& folder);
// The same for the temporaries of one file, which lie beside it.
void RemoveStaleTemporariesOf(const std::filesystem::path& file);

// Waits until files, folders with all that is in them, and the names of both are on the disk, so that losing power
// loses none of them. `written` lies in `folder`; what is not there is passed over. Throws MachineError where the disk
// refuses.
void FlushToDisk(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& written);

// Whether the machine was restarted since NoteRunOfMachine. For files that a later run goes on from and that are not
// flushed: losing power may have damaged them, so they are checked before they are used.
bool RestartedSince(const std::filesystem::path& folder);
void NoteRunOfMachine(const std::filesystem::path& folder);

// The whole file; throws InputError when it cannot be read or is larger than max_bytes.
std::string ReadText(const std::filesystem::path& path, std::size_t max_bytes = std::size_t(1) << 30);

// A lock on a folder (LOCK file with the owner's process id, flock: gone with the process, also after kill -9).
// Throws MachineError naming the other process where it is taken. Whoever gets it alone also removes what killed runs
// left (RemoveStaleTemporaries).
class FolderLock {
 public:
  // kWithOthers: together with others that say the same, as parts of one work. kInTurn: waits until it is free; for
  // locks that are held for moments.
  enum Kind { kAlone, kWithOthers, kInTurn };
  explicit FolderLock(const std::filesystem::path& folder, Kind kind = kAlone);  // creates the folder
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
  Kind kind_;
  std::filesystem::path path_;
};

// An output folder that may be written into: absent, empty (but for a lock or temporaries of ours), or one that this
// suite made (it holds a lumigraph.json or `marker`). Anything else is somebody's own: throws UsageError, nothing
// touched. What killed runs left in one that may be written into is removed, unless (`others`) runs on other machines
// may be writing there, whose processes nobody here knows.
void RequireOurFolder(const std::filesystem::path& folder, const std::string& marker = "lumigraph.json",
                      bool others = false);

}  // namespace lumi
