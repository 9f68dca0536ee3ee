// Another program of this suite, started with --json: its progress shown as ours, its failure thrown as ours, its
// summary read once.
#pragma once

#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/child_progress.h"
#include "scene/program/progress.h"

namespace lumi {

struct Sibling {
  std::string program;                 // "lumi-reconstruct"
  std::vector<std::string> arguments;  // without --json
  std::string task;                    // before the names of its tasks: "stage 2/5 proxy: "
  std::string speaker;                 // before its remarks: "proxy: "
};

struct SiblingAnswer {
  JsonKeys summary;
  double seconds = 0;  // wall clock
};

// The program's path, its arguments and --json.
std::vector<std::string> SiblingCommand(const Sibling& sibling);

// What a sibling prints, wherever it runs: shown as it comes, and in the end its answer.
class SiblingOutput {
 public:
  SiblingOutput(const Sibling& sibling, ProgressSink& progress);
  void Line(const std::string& line);  // of its stderr, with LUMI_PROGRESS_PIPE set
  // `out`: its stdout. Throws as RunSibling.
  SiblingAnswer Answer(int exit_code, const std::string& out, double seconds);

 private:
  const Sibling sibling_;
  ProgressSink& progress_;
  ChildProgress display_;
  std::string own_line_, last_line_;
};

// Throws lumi::Error with the program's own exit code, message, file and hint where it failed; Interrupted on Ctrl-C,
// after the program has ended.
SiblingAnswer RunSibling(const Sibling& sibling, ProgressSink& progress);

}  // namespace lumi
