// Runs a program of the suite with one fault: the Nth of its calls on files below a folder fails (fault_injection.cc,
// preloaded), or its Nth allocation.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/child_program.h"

namespace lumi {

enum class FaultKind {
  kWrite,  // open for writing, write, rename, mkdir, fsync, link, truncate, mmap for writing: ENOSPC, EIO, EMFILE
  kRead,   // open for reading, mmap for reading: EMFILE, ENOMEM
  kMemory  // operator new: std::bad_alloc
};

struct FaultRun {
  ProgramResult result;
  std::string failed;  // the call that failed and its file; empty: none did
  std::string stack;   // of an allocation that failed, a line a frame
  std::string crash;   // the stack where the program crashed after it, whatever it said then
  // Without a fault (at = 0): what can fail, by number. Calls on files all; of allocations the first of each call
  // stack.
  std::vector<long> points;
  std::vector<std::string> calls;  // the same, each with its file: "rename /a/b"; "new" with the name of its stack
};

// The program itself is meant, none that it starts. at = 0: nothing fails, calls are counted.
FaultRun RunWithFault(const std::vector<std::string>& argv, FaultKind kind, long at, const std::filesystem::path& below,
                      std::map<std::string, std::string> environment = {});

// Runs with one allocation that fails, of a program that has loaded its libraries once and is forked for each run:
// several times as fast. What these allocate while they are loaded does not count here; numbers are not those of
// RunWithFault.
class FaultServer {
 public:
  FaultServer(const std::vector<std::string>& argv, const std::filesystem::path& below);
  ~FaultServer();
  static constexpr long kNone = -1;  // nothing fails, and nothing is counted, which takes time
  FaultRun Run(long at);

 private:
  TemporaryFolder folder_;
  std::unique_ptr<ChildProgram> program_;
  int asked_ = -1, told_ = -1;
};

// So many of the points, spread evenly with first and last; all of them where there are no more.
std::vector<long> SomePoints(const std::vector<long>& points, std::size_t most);
// Whether a few faults are enough: the environment variable LUMI_FEW_FAULTS is set.
bool FewFaults();

}  // namespace lumi
