#include "scene/program/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "scene/program/interrupt.h"
#include "scene/program/printable.h"

namespace lumi {
namespace {

constexpr double kRedrawSeconds = 0.1;
constexpr double kLogSeconds = 5.0;  // between plain lines in a log
constexpr double kQuietTaskSeconds = 2.0;

std::string Clock(double seconds) {
  const long s = static_cast<long>(seconds + 0.5);
  return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                   : fmt::format("{}:{:02}", s / 60, s % 60);
}

// One whose line can be drawn anew.
bool IsTerminal() {
  const char* kind = std::getenv("TERM");
  return isatty(2) != 0 && kind != nullptr && kind[0] != '\0' && std::string(kind) != "dumb";
}

// As much of a line as stands in one row of the terminal: a longer one would leave its rest behind. Characters are
// counted as the terminal shows them, one for each start of a UTF-8 sequence.
std::string InOneRow(const std::string& line) {
  winsize size{};
  const std::size_t columns = ioctl(2, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
  std::size_t shown = 0, end = 0;
  for (; end < line.size(); ++end)
    if ((static_cast<unsigned char>(line[end]) & 0xC0U) != 0x80U && ++shown >= columns) break;
  return line.substr(0, end);
}

class Silent : public ProgressSink {
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string&) override {}
};

// Errors are ignored: a stderr that nobody reads any more is no reason to stop.
void Print(const std::string& text) { std::fputs(text.c_str(), stderr); }

class Stderr : public ProgressSink {
 public:
  explicit Stderr(bool quiet)
      : quiet_(quiet), terminal_(IsTerminal()), pipe_(std::getenv("LUMI_PROGRESS_PIPE") != nullptr) {}

  void Report(const std::string& task, long done, long total, double seconds, double seconds_left) override {
    const std::lock_guard lock(mutex_);
    if (pipe_) {
      Print(fmt::format("@progress {} {} {}\n", done, total, task));
      return;
    }
    if (quiet_) return;
    if (!terminal_ && seconds - last_logged_ < kLogSeconds && last_task_ == task) return;
    if (!terminal_ && seconds < kQuietTaskSeconds) return;
    last_logged_ = seconds;
    last_task_ = task;
    std::string line = task;
    if (total > 0) {
      line += fmt::format(" {}/{}", done, total);
      if (seconds > 0.5 && done > 0) line += fmt::format("  {:.3g}/s", static_cast<double>(done) / seconds);
      if (seconds_left >= 0 && seconds > 0.5) line += fmt::format("  {} left", Clock(seconds_left));
    } else {
      line += fmt::format(" {}  {}", done, Clock(seconds));
    }
    if (terminal_)
      Print(fmt::format("\r\033[K{}", InOneRow(line)));
    else
      Print(fmt::format("{}\n", line));
    std::fflush(stderr);
    drawn_ = terminal_;
  }

  void Finish(const std::string& task, long done, double seconds) override {
    const std::lock_guard lock(mutex_);
    if (quiet_ || pipe_) return;
    if (drawn_) Print("\r\033[K");
    if (seconds >= kQuietTaskSeconds) Print(fmt::format("{}: {} in {:.1f} s\n", task, done, seconds));
    drawn_ = false;
    last_logged_ = 0;
    last_task_.clear();
  }

  void Message(const std::string& line) override {
    const std::lock_guard lock(mutex_);
    if (quiet_) return;
    if (drawn_) Print("\r\033[K");
    drawn_ = false;
    Print(Printable(line) + "\n");
  }

 private:
  const bool quiet_, terminal_, pipe_;
  bool drawn_ = false;
  double last_logged_ = 0;
  std::string last_task_;
  std::mutex mutex_;
};

double Seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

ProgressSink& SilentProgress() {
  static Silent silent;
  return silent;
}

std::unique_ptr<ProgressSink> MakeStderrProgress(bool quiet) { return std::make_unique<Stderr>(quiet); }

Progress::Progress(ProgressSink& sink, std::string task, long total)
    : sink_(sink), task_(std::move(task)), total_(total), start_(std::chrono::steady_clock::now()), last_(start_) {
  Emit(true);
}

Progress::~Progress() { sink_.Finish(task_, done_, Seconds(std::chrono::steady_clock::now() - start_)); }

void Progress::Step(long by) {
  CheckInterrupted();
  const std::lock_guard lock(mutex_);
  done_ += by;
  Emit(false);
}

void Progress::Set(long done) {
  CheckInterrupted();
  const std::lock_guard lock(mutex_);
  done_ = done;
  Emit(false);
}

void Progress::SetTotal(long total) {
  const std::lock_guard lock(mutex_);
  total_ = total;
}

void Progress::Emit(bool force) {
  const auto now = std::chrono::steady_clock::now();
  if (!force && done_ != total_ && Seconds(now - last_) < kRedrawSeconds) return;
  last_ = now;
  const double seconds = Seconds(now - start_);
  const double left = total_ > 0 && done_ > 0
                          ? seconds * static_cast<double>(std::max(0L, total_ - done_)) / static_cast<double>(done_)
                          : -1;
  sink_.Report(task_, done_, total_, seconds, left);
}

}  // namespace lumi
