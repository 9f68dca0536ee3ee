#include "scene/files/temporary_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>

#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kPrefix = "lumigraph-";

int OpenFolder(const fs::path& folder) {
  return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

void RemoveAbandoned(const fs::path& among) {
  std::error_code error;
  for (fs::directory_iterator it(among, error), end; !error && it != end; it.increment(error)) {
    if (!it->path().filename().string().starts_with(kPrefix)) continue;
    const int folder = OpenFolder(it->path());
    if (folder < 0) continue;
    struct stat found {};
    std::error_code ignored;
    if (::fstat(folder, &found) == 0 && found.st_uid == ::geteuid() &&
        fs::file_time_type::clock::now() - fs::last_write_time(it->path(), ignored) > std::chrono::hours(1) &&
        ::flock(folder, LOCK_EX | LOCK_NB) == 0)
      fs::remove_all(it->path(), ignored);
    ::close(folder);
  }
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  const fs::path among = fs::temp_directory_path();
  RemoveAbandoned(among);
  std::string pattern = (among / (std::string(kPrefix) + "XXXXXX")).string();
  if (!::mkdtemp(pattern.data()))
    throw MachineError("cannot make a temporary folder", "set TMPDIR to a folder with room", pattern);
  path_ = pattern;
  lock_ = OpenFolder(path_);
  if (lock_ >= 0) ::flock(lock_, LOCK_SH);  // shared: files are written into it under locks of their own
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace lumi
