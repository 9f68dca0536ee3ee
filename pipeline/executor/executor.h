// Where stages run: here, as children of this program, or as jobs of a cluster.
#pragma once

#include <string>

#include "scene/program/progress.h"
#include "scene/program/sibling.h"

namespace lumi {

struct ExecutedStage {
  std::string name;  // "proxy": of its folder, and what is said of it
  Sibling sibling;
  // What the stage reads and with which options, in words, where the program does not find out by itself that it has
  // nothing to do: a job that ended while nobody followed it is taken for this run only where they are the same.
  std::string wanted = {};
};

// Whether a program says that an earlier run had done all.
bool HadNothingToDo(const JsonKeys& summary);

class Executor {
 public:
  virtual ~Executor() = default;
  // As RunSibling. Thread-safe.
  virtual SiblingAnswer Run(const ExecutedStage& stage, ProgressSink& progress) = 0;
};

}  // namespace lumi
