// Where stages run: here, as children of this program, or as jobs of a cluster.
#pragma once

#include <string>
#include <vector>

#include "scene/program/progress.h"
#include "scene/program/sibling.h"

namespace lumi {

struct ExecutedStage {
  std::string name;  // "proxy": of its folder, and what is said of it
  Sibling sibling;
  // What the stage reads and with which options, in words, for a program that does not find out by itself that it has
  // nothing to do: the result of a job that ended while no run followed it is used only if this text is the same.
  std::string wanted = {};
};

// Whether a program says that an earlier run had done all.
bool HadNothingToDo(const JsonKeys& summary);

class Executor {
 public:
  virtual ~Executor() = default;
  // As RunSibling. Thread-safe.
  virtual SiblingAnswer Run(const ExecutedStage& stage, ProgressSink& progress) = 0;
  // Stages of one program that do not depend on each other, at the same time; answers in their order. `task`: what is
  // shown of how many are done. After all have ended, throws what the first one that failed did.
  virtual std::vector<SiblingAnswer> RunAll(const std::vector<ExecutedStage>& stages, const std::string& task,
                                            ProgressSink& progress) = 0;
};

}  // namespace lumi
