// The fixture of fault injection: a program is run once for each call on a file, and each kind of allocation, that can
// fail, and what it leaves is compared with what an undisturbed run leaves.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "scene/files/temporary_folder.h"
#include "tests/support/fault_run.h"

namespace lumi {

// What a program is run on, and what it may touch.
struct FaultCase {
  std::vector<std::string> argv;    // "@/" in an argument is the folder of the run
  std::vector<std::string> inputs;  // paths in it that are only read
  // Files that hold something else while a chain of steps is under way: each is whole all the same.
  std::vector<std::string> in_steps = {};
  std::string counts_work = {};  // a file that says what this run did: one that goes on does less
  bool is_slow = false;          // seconds a run: with few faults only those of writing
  // Files of times that were measured, and what follows from them: there or not, but no two runs write the same.
  std::vector<std::string> measured = {};
};

class FaultInjection : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite();
  static void Make(const std::vector<std::string>& argv);  // runs it; it has to end well
  static std::filesystem::path Template() { return *folder_ / "template"; }
  static std::filesystem::path Work() { return *folder_ / "work"; }
  // The folder as it is before the run: of the template, what the run is given.
  static void Reset(const FaultCase& c);
  static std::vector<std::string> Arguments(const FaultCase& c);
  // What the folder of the run holds; of what was measured only that it is whole: JSON that can be parsed.
  static std::map<std::string, std::string> Files(const FaultCase& c);
  // The allocations whose call stacks no case of this program before had.
  static std::vector<long> NewStacks(const std::string& program, const FaultRun& counted);
  // Those of `counted` that `served` lacks: of libraries while they are loaded, alike in all programs.
  static std::vector<long> NewStacksOfLoading(const FaultRun& counted, const FaultRun& served);
  static bool IsNew(const std::string& stack);
  void KeepSwept();
  // Beside each file that the program writes lies what a killed run left of it: the next run removes it.
  void PlantTemporaries(const FaultCase& c);
  // A run for each fault of this kind (fault_sweep.cc says how many), and one after it that has to do all.
  void Sweep(const FaultCase& c, FaultKind kind);
  // Whether the first frame beyond the C library is of a program or library of this suite.
  static bool CrashIsOurs(const std::string& stack);
  static void ExpectOneLine(const ProgramResult& result, const std::string& program, FaultKind kind);
  // Every file is as it was, or as an undisturbed run leaves it; one in a folder that still waits to take another's
  // place (images.part) as it will be there.
  static void ExpectWhole(const FaultCase& c, const std::map<std::string, std::string>& before,
                          const std::map<std::string, std::string>& wanted,
                          const std::map<std::string, std::string>& found);
  void SweepAll(const FaultCase& c);

  static std::unique_ptr<TemporaryFolder> folder_;
  static int injected_, harmless_;
  static std::set<std::string> stacks_;
  static std::vector<std::string> new_stacks_;  // of the case that runs
};

}  // namespace lumi
