#include "tests/support/fault_run.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace lumi {
namespace fs = std::filesystem;
namespace {

std::map<std::string, std::string> Environment(const std::vector<std::string>& argv, FaultKind kind, long at,
                                               const fs::path& below, const fs::path& log) {
  return {{"LD_PRELOAD", LUMI_FAULT_LIBRARY},
          {"LUMI_FAULT_BELOW", below.string()},
          {"LUMI_FAULT_PROGRAM", argv.at(0)},
          {"LUMI_FAULT_KIND", kind == FaultKind::kWrite  ? "write"
                              : kind == FaultKind::kRead ? "read"
                                                         : "memory"},
          {"LUMI_FAULT_AT", std::to_string(at)},
          {"LUMI_FAULT_LOG", log.string()}};
}

void ReadLog(const fs::path& log, FaultRun& run) {
  std::ifstream lines(log);
  // After "failed": its call stack, where it is known.
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string what;
    long n = 0;
    words >> what >> n;
    std::string call;
    std::getline(words >> std::ws, call);
    if (what == "failed") run.failed = call;
    const bool has_crashed = what == "crashed" || !run.crash.empty();
    if (has_crashed)
      run.crash += line + "\n";
    else if (!run.failed.empty() && what != "failed")
      run.stack += line + "\n";
    if (what != "call") continue;
    run.points.push_back(n);
    run.calls.push_back(call);
  }
}

std::string Whole(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

FaultRun RunWithFault(const std::vector<std::string>& argv, FaultKind kind, long at, const fs::path& below,
                      std::map<std::string, std::string> environment) {
  const TemporaryFolder folder;
  const fs::path log = folder / "log";
  environment.merge(Environment(argv, kind, at, below, log));
  FaultRun run;
  run.result = RunProgram(argv, environment);
  ReadLog(log, run);
  return run;
}

FaultServer::FaultServer(const std::vector<std::string>& argv, const fs::path& below) {
  for (const char* pipe : {"asked", "told"})
    if (::mkfifo((folder_ / pipe).c_str(), 0600) != 0) throw std::runtime_error("no pipe can be made");
  // For reading and writing: opening waits for no one, and the server sees the end when these are closed.
  asked_ = ::open((folder_ / "asked").c_str(), O_RDWR | O_CLOEXEC);
  told_ = ::open((folder_ / "told").c_str(), O_RDWR | O_CLOEXEC);
  auto environment = Environment(argv, FaultKind::kMemory, 0, below, folder_ / "log");
  environment["LUMI_FAULT_SERVER"] = (folder_ / "").string();
  const std::string bin = LUMI_BIN_DIR;
  environment["LUMI_FAULT_LOAD"] = bin + "/liblumi_codecs.so:" + bin + "/liblumi_video.so";
  program_ = std::make_unique<ChildProgram>(argv, environment);
}

FaultServer::~FaultServer() {
  program_->Signal(SIGKILL);
  ::kill(-program_->pid(), SIGKILL);  // and a run that has not ended
  ::close(asked_);
  ::close(told_);
}

FaultRun FaultServer::Run(long at) {
  fs::remove(folder_ / "log");
  ::dprintf(asked_, "%ld log out err\n", at);
  FaultRun run;
  std::string status;
  for (char c = 0; c != '\n';) {
    pollfd told{told_, POLLIN, 0};
    constexpr int kLimitMs = 300'000;
    if (::poll(&told, 1, kLimitMs) != 1 || ::read(told_, &c, 1) != 1)
      throw std::runtime_error("the run with fault " + std::to_string(at) +
                               " has not ended: " + Whole(folder_ / "err") + Whole(folder_ / "log"));
    status += c;
  }
  const int ended = std::stoi(status);
  run.result.exit_code = WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
  run.result.out = Whole(folder_ / "out");
  run.result.err = Whole(folder_ / "err");
  ReadLog(folder_ / "log", run);
  return run;
}

std::vector<long> SomePoints(const std::vector<long>& points, std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<long> some;
  for (std::size_t i = 0; i < most; ++i)
    some.push_back(points[i * (points.size() - 1) / std::max<std::size_t>(1, most - 1)]);
  return some;
}

bool FewFaults() { return std::getenv("LUMI_FEW_FAULTS") != nullptr; }

}  // namespace lumi
