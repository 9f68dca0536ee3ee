// Progress with rate and time left: a line redrawn in place on a terminal, plain lines in a log, nothing when quiet.
// Libraries take a Progress& and never print themselves.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <string>

namespace lumi {

// Where progress goes. The default prints nothing (tests, libraries used by others).
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  // fraction in [0,1], or < 0 where the total is not known; seconds_left < 0 where it cannot be said yet.
  virtual void Report(const std::string& task, long done, long total, double seconds, double seconds_left) = 0;
  virtual void Finish(const std::string& task, long done, double seconds) = 0;
  virtual void Message(const std::string& line) = 0;  // a remark or a warning, one line
};

ProgressSink& SilentProgress();
// To stderr. Also writes machine-readable lines ("@progress TASK DONE TOTAL") when the environment variable
// LUMI_PROGRESS_PIPE is set: a program that starts another shows the other's progress as its own.
std::unique_ptr<ProgressSink> MakeStderrProgress(bool quiet);

// One task's progress. Thread-safe; throws Interrupted from Step and Set when the user asked to stop.
class Progress {
 public:
  Progress(ProgressSink& sink, std::string task, long total);  // total <= 0: unknown
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void Step(long by = 1);
  void Set(long done);
  void SetTotal(long total);

 private:
  void Emit(bool force);
  ProgressSink& sink_;
  std::string task_;
  long done_ = 0;
  long total_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_;
  std::mutex mutex_;
};

}  // namespace lumi
