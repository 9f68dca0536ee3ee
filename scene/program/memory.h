// How much memory there is. Linux grants more memory than it has, and kills a program that uses it without any message;
// code that will take gigabytes therefore checks first.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace lumi {

// Bytes that this process may still take: what the machine has free, and what is left of a container's or a batch
// job's limit (cgroup) and of `ulimit -v`. The largest number where the system does not say.
std::uint64_t AvailableMemory();

// Bytes of this process that are in memory now; 0 where the system does not say.
std::uint64_t ResidentMemory();

// Throws MachineError ("takes 9.3 GB of memory, and 3.1 GB are free") where there is less. Up to 256 MB nothing is
// asked.
void RequireMemory(std::uint64_t bytes, const std::filesystem::path& file, const std::string& hint);

// For loops whose bodies take much memory: as many go on at once as fit into half of what is free, and one in any case.
// The constructor waits until others have ended, unless the body takes 64 MB or less. A thread holds one at a time: of
// two that do not fit together, the second would wait for ever.
class MemoryTurn {
 public:
  explicit MemoryTurn(std::uint64_t bytes);
  ~MemoryTurn();
  MemoryTurn(const MemoryTurn&) = delete;
  MemoryTurn& operator=(const MemoryTurn&) = delete;

 private:
  std::uint64_t bytes_;
};

}  // namespace lumi
