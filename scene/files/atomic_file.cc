#include "scene/files/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "scene/files/open_to_read.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/out_of_memory.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kTemporaryMark = ".lumi-tmp-";
constexpr const char* kRunOfMachine = ".written-in";

// The system's boot id, which changes with each restart; empty where the system does not tell it.
std::string RunOfMachine() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

MachineError CannotWrite(const fs::path& path, int error) {
  const char* hint =
      error == ENOSPC || error == EDQUOT ? "free some space or choose another output" : "choose another output";
  return MachineError(fmt::format("cannot write: {}", std::strerror(error)), hint, path);
}

// A rename would put a file in the place of /dev/null.
void RequireRegular(const fs::path& path) {
  std::error_code error;
  const auto type = fs::status(path, error).type();
  if (type == fs::file_type::none) throw CannotWrite(path, error.value());
  if (type != fs::file_type::regular && type != fs::file_type::not_found)
    throw MachineError("cannot write: it is there already and is no file", "choose another output", path);
}

std::string TemporaryStem(const fs::path& path) {
  return fmt::format(".{}{}", path.stem().string().substr(0, 180), kTemporaryMark);  // names end at 255 bytes
}

fs::path TemporaryFor(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return TemporaryBeside(path, std::to_string(counter++));
}

// The number of the process that a temporary's name tells; nothing: it is no temporary of ours.
std::optional<pid_t> ProcessOf(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::size_t mark = name.rfind(kTemporaryMark);
  if (!name.starts_with('.') || mark == std::string::npos) return std::nullopt;
  pid_t pid = 0;
  const char *digits = name.data() + mark + kTemporaryMark.size(), *end = name.data() + name.size();
  const auto [after, error] = std::from_chars(digits, end, pid);
  return error == std::errc() && pid > 0 && after != end && *after == '-' ? std::optional(pid) : std::nullopt;
}

bool IsTemporary(const fs::path& path) {
  std::error_code error;
  return ProcessOf(path) && fs::is_regular_file(fs::symlink_status(path, error));
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }
  int Close() { return ::close(std::exchange(fd_, -1)); }

 private:
  int fd_;
};

void WriteBytes(const fs::path& shown, const fs::path& path, const char* data, std::size_t size) {
  FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) throw CannotWrite(shown, errno);
  while (size > 0) {
    const ssize_t n = ::write(file.get(), data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw CannotWrite(shown, errno);
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  if (file.Close() != 0) throw CannotWrite(shown, errno);
}

// Whether the process whose number stands in a temporary's name may still run. If another process has that number by
// now, the temporary is kept for a day.
bool MayBeOfALivingProcess(const fs::path& temporary) {
  const std::optional<pid_t> pid = ProcessOf(temporary);
  if (!pid) return true;
  if (::kill(*pid, 0) != 0 && errno == ESRCH) return false;
  std::error_code error;
  const auto written = fs::last_write_time(temporary, error);
  return error || fs::file_time_type::clock::now() - written < std::chrono::hours(24);
}

void RemoveStale(const fs::path& folder, const std::vector<fs::path>& temporaries) {
  const FileDescriptor here(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (here.get() < 0 || (::flock(here.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)) return;  // in use
  std::error_code ignored;
  for (const fs::path& temporary : temporaries)
    if (!MayBeOfALivingProcess(temporary)) fs::remove(temporary, ignored);
}

// Whether only this machine writes there. On a network's file system (NFS, SMB, FUSE ...) a lock on a folder may be
// known to one machine only, and a process of another one looks dead here.
bool IsOfThisMachine(const fs::path& folder) {
  struct statfs status {};
  if (::statfs(folder.empty() ? "." : folder.c_str(), &status) != 0) return false;
  // linux/magic.h; ZFS and bcachefs, which are not in it.
  constexpr std::uint64_t kLocal[] = {
      0xEF53 /* ext4 */,        0x58465342 /* XFS */,  0x9123683E /* Btrfs */, 0x01021994 /* tmpfs */,
      0x794C7630 /* overlay */, 0xF2F52010 /* F2FS */, 0x2FC12FC1 /* ZFS */,   0xCA451A4E /* bcachefs */};
  return std::ranges::find(kLocal, static_cast<std::uint64_t>(status.f_type) & 0xFFFFFFFF) != std::end(kLocal);
}

// What killed runs left right in a folder: removed when this process first writes there, whatever it writes.
void RemoveStaleOnce(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<fs::path> seen;
  std::error_code error;
  const std::lock_guard lock(mutex);
  if (!seen.insert(fs::absolute(folder, error)).second || fs::exists(folder / kMadeInParts, error) ||
      !IsOfThisMachine(folder))
    return;
  std::vector<fs::path> temporaries;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (IsTemporary(it->path())) temporaries.push_back(it->path());
  if (!temporaries.empty()) RemoveStale(folder, temporaries);
}

void Flush(const fs::path& path, int (*flush)(int)) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  // A file that may not be opened, or a file system that cannot flush (EINVAL: some network file systems), is passed
  // over: nothing more can be done for it.
  if (file.get() < 0 && (errno == EACCES || errno == EPERM)) return;
  if (file.get() >= 0 && flush(file.get()) == 0) return;
  if (errno != EINVAL && errno != EROFS && errno != ENOSYS && errno != EOPNOTSUPP) throw CannotWrite(path, errno);
}

}  // namespace

// ".NAME.lumi-tmp-PID-WHO.EXT"
fs::path TemporaryBeside(const fs::path& path, const std::string& who) {
  const std::string ending = path.extension().string().substr(0, 30);
  return path.parent_path() / fmt::format("{}{}-{}{}", TemporaryStem(path), ::getpid(), who, ending);
}

void RequireWritable(const fs::path& path) {
  if (!path.has_filename()) throw MachineError("cannot write: not a file name", {}, path);
  RequireRegular(path);
  std::error_code error;
  fs::path folder = fs::absolute(path, error).parent_path();
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  if (!fs::is_directory(folder, error)) throw CannotWrite(path, ENOTDIR);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) throw CannotWrite(path, errno);
}

void WriteFileAtomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  if (!path.has_filename()) throw MachineError("cannot write: not a file name", {}, path);
  RequireRegular(path);
  std::error_code error;
  if (path.has_parent_path()) {
    fs::create_directories(path.parent_path(), error);
    if (error) throw CannotWrite(path, error.value());
  }
  RemoveStaleOnce(path.has_parent_path() ? path.parent_path() : fs::path("."));
  const fs::path temporary = TemporaryFor(path);
  const FolderInUse in_use(path.parent_path());
  try {
    write(temporary);
    if (!fs::is_regular_file(temporary, error)) throw MachineError("nothing was written", {}, path);
    ThrowIfMemoryRanOut();
    fs::rename(temporary, path, error);
    if (error) throw CannotWrite(path, error.value());
  } catch (...) {
    fs::remove(temporary, error);
    throw;
  }
}

void WriteBytesAtomically(const fs::path& path, const void* data, std::size_t size) {
  WriteFileAtomically(
      path, [&](const fs::path& temporary) { WriteBytes(path, temporary, static_cast<const char*>(data), size); });
}

void WriteTextAtomically(const fs::path& path, const std::string& text) {
  WriteBytesAtomically(path, text.data(), text.size());
}

FolderInUse::FolderInUse(const fs::path& folder)
    : fd_(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  while (fd_ >= 0 && ::flock(fd_, LOCK_SH) != 0 && errno == EINTR) {
  }
}

FolderInUse::~FolderInUse() {
  if (fd_ >= 0) ::close(fd_);
}

void RemoveStaleTemporaries(const fs::path& folder) {
  std::error_code error;
  std::map<fs::path, std::vector<fs::path>> found;  // by folder
  for (fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && it != end; it.increment(error))
    if (fs::is_directory(it->path(), error) && fs::exists(it->path() / kMadeInParts, error))
      it.disable_recursion_pending();
    else if (IsTemporary(it->path()))
      found[it->path().parent_path()].push_back(it->path());
  for (const auto& [in, temporaries] : found) RemoveStale(in, temporaries);
}

void RemoveStaleTemporariesOf(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const std::string start = TemporaryStem(file);
  std::error_code error;
  std::vector<fs::path> temporaries;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::string name = it->path().filename().string();
    if (name.starts_with("..")) name.erase(0, 1);  // the temporary of a temporary: a video on its way into one
    if (name.starts_with(start) && it->path().extension() == file.extension()) temporaries.push_back(it->path());
  }
  if (!temporaries.empty()) RemoveStale(folder, temporaries);
}

void FlushToDisk(const fs::path& folder, const std::vector<fs::path>& written) {
  // Up to kFewFiles files are flushed one after another; for more, the whole file system is flushed at once.
  constexpr std::size_t kFewFiles = 64;
  std::set<fs::path> files, folders;
  const auto add_folders_above = [&](fs::path path) {
    while (path != folder && path.has_parent_path() && folders.insert(path = path.parent_path()).second) {
    }
  };
  std::error_code error;
  for (const fs::path& path : written) {
    const fs::file_type type = fs::symlink_status(path, error).type();
    if (type == fs::file_type::not_found || error) continue;
    add_folders_above(path);
    if (type == fs::file_type::regular) files.insert(path);
    if (type != fs::file_type::directory) continue;
    folders.insert(path);
    for (fs::recursive_directory_iterator it(path, error), end; !error && it != end; it.increment(error)) {
      if (it->is_directory(error) && !it->is_symlink(error)) folders.insert(it->path());
      if (it->is_regular_file(error) && !it->is_symlink(error)) files.insert(it->path());
    }
  }
  folders.insert(folder);
  folders.insert(fs::absolute(folder).lexically_normal().parent_path());  // the folder's own name
  if (files.size() > kFewFiles) {
    Flush(folder, ::syncfs);
    return;
  }
  for (const fs::path& file : files) Flush(file, ::fsync);
  for (const fs::path& each : folders) Flush(each, ::fsync);
}

bool RestartedSince(const fs::path& folder) {
  std::error_code error;
  const fs::path note = folder / kRunOfMachine;
  return fs::exists(note, error) && ReadText(note) != RunOfMachine();
}

void NoteRunOfMachine(const fs::path& folder) {
  const fs::path note = folder / kRunOfMachine;
  std::error_code error;
  if (const std::string run = RunOfMachine(); !fs::exists(note, error) || ReadText(note) != run)
    WriteTextAtomically(note, run);
}

std::string ReadText(const fs::path& path, std::size_t max_bytes) {
  std::error_code error;
  if (fs::is_directory(path, error)) throw InputError(path, "is a folder, not a file");
  std::ifstream in = OpenToRead(path);
  if (!in) throw InputError(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string text;
  // Reads as many bytes as the file system states, then whatever follows (a pipe states no size).
  const auto stated = fs::file_size(path, error);
  if (!error) {
    if (stated > max_bytes)
      throw InputError(path, fmt::format("{} bytes are more than the {} allowed here", stated, max_bytes));
    text.resize(static_cast<std::size_t>(stated));
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(in.gcount()));
  }
  char more[1 << 16];
  while (in) {
    in.read(more, sizeof more);
    text.append(more, static_cast<std::size_t>(in.gcount()));
    if (text.size() > max_bytes) throw InputError(path, fmt::format("more than the {} bytes allowed here", max_bytes));
  }
  if (in.bad()) throw InputError(path, "cannot be read to its end");
  return text;
}

FolderLock::FolderLock(const fs::path& folder, Kind kind) : kind_(kind), path_(folder / "LOCK") {
  // One of several that goes has the lock alone for a moment, and then the file is gone.
  constexpr int kTries = 20;
  constexpr auto kPause = std::chrono::milliseconds(50);
  int tries = kind == kWithOthers ? kTries : 1;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw CannotWrite(folder, error.value());
  for (;;) {
    fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd_ < 0) throw CannotWrite(path_, errno);
    const int wanted = kind == kInTurn ? LOCK_EX : kind == kAlone ? LOCK_EX | LOCK_NB : LOCK_SH | LOCK_NB;
    if (::flock(fd_, wanted) != 0) {
      if (errno == EINTR) {
        ::close(std::exchange(fd_, -1));
        CheckInterrupted();
        continue;
      }
      if (--tries > 0) {
        ::close(std::exchange(fd_, -1));
        std::this_thread::sleep_for(kPause);
        continue;
      }
      char owner[32] = {};
      const ssize_t n = ::pread(fd_, owner, sizeof owner - 1, 0);
      ::close(std::exchange(fd_, -1));
      std::string who(owner, n > 0 ? static_cast<std::size_t>(n) : 0);
      while (!who.empty() && std::isspace(static_cast<unsigned char>(who.back()))) who.pop_back();
      throw MachineError(fmt::format("the folder is being written by process {}", who.empty() ? "(unknown)" : who),
                         "wait for it to end, or end it", folder);
    }
    // The owner removes the file before it lets go: a lock on a file that has no name any more protects nothing.
    struct stat held {
    }, named{};
    if (::fstat(fd_, &held) == 0 && ::stat(path_.c_str(), &named) == 0 && held.st_ino == named.st_ino &&
        held.st_dev == named.st_dev)
      break;
    ::close(std::exchange(fd_, -1));
  }
  const std::string pid = fmt::format("{}\n", ::getpid());
  if (::ftruncate(fd_, 0) != 0 || ::pwrite(fd_, pid.data(), pid.size(), 0) != static_cast<ssize_t>(pid.size())) {
    const int reason = errno;
    if (kind != kWithOthers) ::unlink(path_.c_str());
    ::close(std::exchange(fd_, -1));
    throw CannotWrite(path_, reason);
  }
  if (kind == kAlone) RemoveStaleTemporaries(folder);
}

FolderLock::~FolderLock() {
  if (fd_ < 0) return;
  // The last one removes the file.
  if (kind_ != kWithOthers || ::flock(fd_, LOCK_EX | LOCK_NB) == 0) ::unlink(path_.c_str());
  ::close(fd_);
}

void RequireOurFolder(const fs::path& folder, const std::string& marker, bool others) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found) return;
  if (status.type() != fs::file_type::directory)
    throw UsageError(fmt::format("{} is there already and is no folder", folder.string()), "choose another output");
  if (fs::exists(folder / "lumigraph.json", error) || fs::exists(folder / marker, error)) {
    if (!others) RemoveStaleTemporaries(folder);
    return;
  }
  fs::directory_iterator it(folder, error);
  if (error) throw MachineError(fmt::format("cannot be listed: {}", error.message()), "choose another output", folder);
  for (; it != fs::directory_iterator(); it.increment(error)) {
    if (it->path().filename() == "LOCK" || IsTemporary(it->path())) continue;
    if (fs::is_directory(folder / "provenance", error))
      throw UsageError(
          fmt::format("{} holds what a run of another program of this suite has left ({}): nothing was touched",
                      folder.string(), it->path().filename().string()),
          "run that program again, remove the folder, or choose another");
    throw UsageError(fmt::format("{} holds files that are not ours ({}): nothing was touched", folder.string(),
                                 it->path().filename().string()),
                     "choose a folder that is new or empty");
  }
  if (!others) RemoveStaleTemporaries(folder);
}

}  // namespace lumi
