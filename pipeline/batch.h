// Many captures with the same options: each by a run of the whole pipeline of its own, one after the other here, all at
// once where an executor has machines for them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/executor/executor.h"
#include "scene/files/json_keys.h"
#include "scene/program/progress.h"

namespace lumi {

struct BatchOptions {
  std::filesystem::path list;          // a text file: an input a line; blank lines and what begins with # do not count
  std::filesystem::path output;        // OUTPUT/NAME are the scenes, NAME being the input's without its ending
  std::vector<std::string> arguments;  // of lumi-pipeline, but for INPUT and -o
  std::shared_ptr<Executor> executor = nullptr;  // none: here
};

struct BatchCapture {
  std::string name;
  std::filesystem::path input, scene;
  double seconds = 0;
  std::string failed = {};  // why; empty: it did not
  int code = 0;             // and its exit code
};

struct BatchSummary {
  std::vector<BatchCapture> captures;
  double seconds = 0;
};
void ListKeys(JsonKeys& j, BatchCapture& capture);
void ListKeys(JsonKeys& j, BatchSummary& summary);
std::string Describe(const BatchSummary& summary);

// A command line of lumi-pipeline without its name and what is the batch's own (--batch, -o, --executor, --partition,
// --sbatch-option, --json): what each capture's run is given.
std::vector<std::string> CaptureArguments(const std::vector<std::string>& line);

// The inputs of a list, relative ones from its folder, and their names. Throws InputError naming the line: for what is
// not there, and two inputs of one name.
std::vector<BatchCapture> ReadBatch(const std::filesystem::path& list, const std::filesystem::path& output);

// Captures that fail do not stop the others. Throws DataError where one has, after all have run; Interrupted.
BatchSummary RunBatch(const BatchOptions& options, ProgressSink& progress);

}  // namespace lumi
