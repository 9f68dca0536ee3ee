// One stage: a sibling program started with --json, its progress shown as ours, its failure thrown as ours.
#pragma once

#include <string>
#include <vector>

#include "scene/program/child_progress.h"
#include "scene/program/progress.h"

namespace lumi {

struct StageResult {
  std::string name;             // "reconstruct", "proxy", ...
  double seconds = 0;           // of this run, wall clock
  bool reused = false;          // nothing had changed since an earlier run
  std::string json;             // the program's own summary
};

struct SiblingStage {
  std::string name;                      // as shown and reported
  std::string program;                   // "lumi-reconstruct"
  std::vector<std::string> arguments;    // without --json
  int number = 1, count = 1;             // "stage 2/5"
};

// Throws lumi::Error with the program's own exit code, message, file and hint where it failed; Interrupted on Ctrl-C,
// after the program has ended. Its remarks go to progress.Message.
StageResult RunSiblingStage(const SiblingStage& stage, ProgressSink& progress);

}  // namespace lumi
