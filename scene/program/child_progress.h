// The progress of a sibling program that was started, shown as ours.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "scene/program/progress.h"

namespace lumi {

// A line "@progress DONE TOTAL TASK" of a program that runs with LUMI_PROGRESS_PIPE set; nullopt for any other line.
struct ProgressLine {
  long done = 0, total = 0;
  std::string task;
};
std::optional<ProgressLine> ParseProgressLine(const std::string& line);

// Shows a child's tasks, `prefix` before their names.
class ChildProgress {
 public:
  ChildProgress(ProgressSink& sink, std::string prefix);
  ~ChildProgress();
  ChildProgress(const ChildProgress&) = delete;
  ChildProgress& operator=(const ChildProgress&) = delete;
  void Show(const ProgressLine& line);

 private:
  void Finish();
  ProgressSink& sink_;
  std::string prefix_, task_;
  long done_ = 0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace lumi
