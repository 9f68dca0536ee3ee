// A program of the suite run as its user runs it: what it printed on each stream, how it ended. It can be killed on the
// way.
#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "scene/files/temporary_folder.h"

namespace lumi {

struct ProgramResult {
  int exit_code = 0;  // 128 + signal where one ended it
  std::string out, err;
  double seconds = 0;
  double peak_memory_mb = 0;  // resident at once, of it or of the largest program that it waited for

  std::vector<std::string> ErrorLines() const;  // of err, without progress
};

class ChildProgram {
 public:
  // argv[0] is a name in LUMI_BIN_DIR ("lumi-proxy") or a path.
  explicit ChildProgram(std::vector<std::string> argv, const std::map<std::string, std::string>& environment = {});
  ~ChildProgram();  // kills what still runs
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  pid_t pid() const { return pid_; }
  // Waits until stderr holds `text` or the program ended; false in the latter case or after the time limit.
  bool WaitForErrorText(const std::string& text, double limit_s = 120);
  void Signal(int signal) const;
  ProgramResult Wait(double limit_s = 300);

 private:
  bool Ended();
  TemporaryFolder folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  struct rusage usage_ = {};
  bool ended_ = false;
  double start_s_ = 0;
};

ProgramResult RunProgram(const std::vector<std::string>& argv,
                         const std::map<std::string, std::string>& environment = {});

// Running processes whose command line names `path`.
std::vector<pid_t> ProcessesNaming(const std::filesystem::path& path);
// Waits until there are none; false after the time limit.
bool WaitForNoProcessNaming(const std::filesystem::path& path, double limit_s = 20);

}  // namespace lumi
