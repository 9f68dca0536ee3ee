#include "scene/program/child_progress.h"

#include <cstdio>
#include <utility>

#include "scene/program/stopwatch.h"

namespace lumi {

std::optional<ProgressLine> ParseProgressLine(const std::string& line) {
  ProgressLine parsed;
  int read = 0;
  if (std::sscanf(line.c_str(), "@progress %ld %ld %n", &parsed.done, &parsed.total, &read) != 2 || read == 0)
    return std::nullopt;
  parsed.task = line.substr(static_cast<std::size_t>(read));
  return parsed;
}

ChildProgress::ChildProgress(ProgressSink& sink, std::string prefix)
    : sink_(sink), prefix_(std::move(prefix)), start_(std::chrono::steady_clock::now()) {}

ChildProgress::~ChildProgress() { Finish(); }

void ChildProgress::Show(const ProgressLine& line) {
  if (line.task != task_) {
    Finish();
    task_ = line.task;
    start_ = std::chrono::steady_clock::now();
  }
  done_ = line.done;
  const double seconds = SecondsSince(start_);
  const double left = line.total > 0 && line.done > 0
                          ? seconds * static_cast<double>(line.total - line.done) / static_cast<double>(line.done)
                          : -1;
  sink_.Report(prefix_ + task_, line.done, line.total, seconds, left);
}

void ChildProgress::Finish() {
  if (!task_.empty()) sink_.Finish(prefix_ + task_, done_, SecondsSince(start_));
  task_.clear();
}

}  // namespace lumi
