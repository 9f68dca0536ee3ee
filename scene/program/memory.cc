#include "scene/program/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <condition_variable>
#include <fstream>
#include <limits>
#include <mutex>
#include <optional>

#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kNotAsked = std::uint64_t{1} << 28;
constexpr double kGb = 1e9;

// The number after `key` in a file of lines "key: number kB", in bytes.
std::optional<std::uint64_t> KilobytesOf(const char* file, const std::string& key) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(key + ":")) return std::stoull(line.substr(key.size() + 1)) * 1024;
  return std::nullopt;
}

std::optional<std::uint64_t> NumberIn(const fs::path& file) {
  std::ifstream in(file);
  std::uint64_t value = 0;
  return in >> value ? std::optional(value) : std::nullopt;  // "max": no limit
}

// The page cache counts as used in a group's figures, but makes room when needed: what files hold is therefore added to
// what the limit leaves.
std::optional<std::uint64_t> LeftInGroup(const fs::path& limit, const fs::path& used, const fs::path& statistics,
                                         const std::string& cache) {
  const auto most = NumberIn(limit), now = NumberIn(used);
  if (!most || !now) return std::nullopt;
  std::uint64_t files = 0;
  std::ifstream lines(statistics);
  std::string key;
  for (std::uint64_t value = 0; lines >> key >> value;)
    if (key == cache) files = value;
  const std::uint64_t held = *now - std::min(*now, files);
  return *most - std::min(*most, held);
}

}  // namespace

std::uint64_t AvailableMemory() {
  std::uint64_t least =
      KilobytesOf("/proc/meminfo", "MemAvailable").value_or(std::numeric_limits<std::uint64_t>::max());
  const auto bound = [&](const std::optional<std::uint64_t>& left) { least = std::min(least, left.value_or(least)); };
  const fs::path groups = "/sys/fs/cgroup";
  fs::path own;
  std::ifstream memberships("/proc/self/cgroup");
  for (std::string line; std::getline(memberships, line);)
    if (line.starts_with("0::/")) own = line.substr(4);
  for (const fs::path& group : {groups / own, groups})
    bound(LeftInGroup(group / "memory.max", group / "memory.current", group / "memory.stat", "file"));
  const fs::path old = groups / "memory";
  bound(LeftInGroup(old / "memory.limit_in_bytes", old / "memory.usage_in_bytes", old / "memory.stat", "total_cache"));
  struct rlimit limit = {};
  if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    const std::uint64_t taken = KilobytesOf("/proc/self/status", "VmSize").value_or(0);
    bound(limit.rlim_cur - std::min<std::uint64_t>(limit.rlim_cur, taken));
  }
  return least;
}

std::uint64_t ResidentMemory() { return KilobytesOf("/proc/self/status", "VmRSS").value_or(0); }

void RequireMemory(std::uint64_t bytes, const fs::path& file, const std::string& hint) {
  if (bytes <= kNotAsked) return;
  const std::uint64_t left = AvailableMemory();
  if (bytes > left)
    throw MachineError(fmt::format("takes {:.1f} GB of memory, and {:.1f} GB are free",
                                   static_cast<double>(bytes) / kGb, static_cast<double>(left) / kGb),
                       hint, file);
}

namespace {

// Of this process's turns.
struct Turns {
  std::mutex mutex;
  std::condition_variable ended;
  std::uint64_t bytes = 0, most = 0;
};
Turns& AllTurns() {
  static Turns turns;
  return turns;
}

}  // namespace

MemoryTurn::MemoryTurn(std::uint64_t bytes) : bytes_(bytes) {
  constexpr std::uint64_t kSmall = std::uint64_t{1} << 26;
  if (bytes_ <= kSmall) bytes_ = 0;
  if (bytes_ == 0) return;
  Turns& turns = AllTurns();
  std::unique_lock lock(turns.mutex);
  // What is free is asked while nothing of it is taken.
  if (turns.bytes == 0) turns.most = AvailableMemory() / 2;
  turns.ended.wait(lock, [&] { return turns.bytes == 0 || turns.bytes + bytes_ <= turns.most; });
  turns.bytes += bytes_;
}

MemoryTurn::~MemoryTurn() {
  if (bytes_ == 0) return;
  Turns& turns = AllTurns();
  {
    const std::lock_guard lock(turns.mutex);
    turns.bytes -= bytes_;
  }
  turns.ended.notify_all();
}

}  // namespace lumi
