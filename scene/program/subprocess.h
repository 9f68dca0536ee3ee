// Starts another program (COLMAP, a sibling of this suite), reads its output line by line, and ends it with us: a first
// Ctrl-C is passed on, and the child dies when we die (PR_SET_PDEATHSIG), so that nothing is left running.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lumi {

struct SubprocessOptions {
  // Called for each line of stdout and stderr (merged unless separate_stdout).
  std::function<void(const std::string& line)> on_line;
  bool separate_stdout = false;                    // stdout is collected in SubprocessResult, on_line sees stderr only
  std::map<std::string, std::string> environment;  // added to ours
  std::optional<std::filesystem::path> log_file;   // all lines are appended to it
};

struct SubprocessResult {
  int exit_code = 0;              // 128 + signal when it was killed by one
  int signal = 0;                 // the one that killed it
  std::string out;                // stdout when separate_stdout
  std::vector<std::string> tail;  // the last 40 lines of what on_line saw
  double seconds = 0;
};

// argv[0] is looked up in PATH. Throws MachineError when it cannot be started, Interrupted when the user asked to stop
// (after the child has ended).
SubprocessResult RunSubprocess(const std::vector<std::string>& argv, const SubprocessOptions& options = {});

// Full path of a program in PATH, or nullopt.
std::optional<std::filesystem::path> FindProgram(const std::string& name);

// A sibling of the running program: where the suite lies (installation.h), then PATH. Throws MachineError when it is in
// neither.
std::filesystem::path SiblingProgram(const std::string& name);

}  // namespace lumi
