// One stage: a sibling program, its progress shown as ours, its failure thrown as ours.
#pragma once

#include <string>
#include <vector>

#include "pipeline/executor/executor.h"
#include "scene/files/json_keys.h"
#include "scene/program/progress.h"

namespace lumi {

struct StageResult {
  std::string name;             // "reconstruct", "proxy", ...
  double seconds = 0;           // of this run, wall clock
  bool reused = false;          // nothing had changed since an earlier run
  JsonKeys summary;             // the program's own, handed on as it came (sibling_summaries.h reads it)
  double computed_seconds = 0;  // of the run that did its work, an earlier one where it was reused
  std::string command = {};     // as a shell takes it; empty: no program of its own does this
};

struct SiblingStage {
  std::string name;                    // as shown and reported
  std::string program;                 // "lumi-reconstruct"
  std::vector<std::string> arguments;  // without --json
  int number = 1, count = 1;           // "stage 2/5"
  Executor* executor = nullptr;        // where it runs; none: here
  std::string wanted = {};             // as ExecutedStage has it
};

// The program and its arguments, as a shell takes them.
std::string CommandOf(const std::string& program, const std::vector<std::string>& arguments);

// Throws lumi::Error with the program's own exit code, message, file and hint where it failed; Interrupted on Ctrl-C,
// after the program has ended. Its remarks go to progress.Message.
StageResult RunSiblingStage(const SiblingStage& stage, ProgressSink& progress);

}  // namespace lumi
