// Another program of this suite, started with --json: its progress shown as ours, its failure thrown as ours, its
// summary read once.
#pragma once

#include <string>
#include <vector>

#include "scene/files/json_keys.h"
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

// Throws lumi::Error with the program's own exit code, message, file and hint where it failed; Interrupted on Ctrl-C,
// after the program has ended.
SiblingAnswer RunSibling(const Sibling& sibling, ProgressSink& progress);

}  // namespace lumi
