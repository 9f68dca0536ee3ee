#include "tests/support/child_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>

extern char** environ;

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::chrono::milliseconds kPoll(3);

double Now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::string Slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The command line of a process of /proc; empty where it ended meanwhile: its file can then still be open, but reading
// it fails (ESRCH), which a stream's buffer throws and `read` keeps to itself.
std::string CommandLine(const fs::path& process) {
  std::ifstream in(process / "cmdline", std::ios::binary);
  std::string line;
  char block[4096];
  while (in.read(block, sizeof block) || in.gcount() > 0) line.append(block, static_cast<std::size_t>(in.gcount()));
  return line;
}

}  // namespace

std::vector<std::string> ProgramResult::ErrorLines() const {
  std::vector<std::string> lines;
  std::istringstream text(err);
  for (std::string line; std::getline(text, line);)
    if (!line.empty() && !line.starts_with("@progress")) lines.push_back(line);
  return lines;
}

ChildProgram::ChildProgram(std::vector<std::string> argv, const std::map<std::string, std::string>& environment) {
  if (argv.at(0).find('/') == std::string::npos) argv[0] = std::string(LUMI_BIN_DIR) + "/" + argv[0];
  std::vector<std::string> variables;
  for (char** e = environ; *e; ++e) {
    const std::string entry(*e);
    if (!environment.count(entry.substr(0, entry.find('=')))) variables.push_back(entry);
  }
  for (const auto& [key, value] : environment) variables.push_back(key + "=" + value);
  std::vector<char*> args, env;
  for (std::string& a : argv) args.push_back(a.data());
  args.push_back(nullptr);
  for (std::string& v : variables) env.push_back(v.data());
  env.push_back(nullptr);
  const std::string out = (folder_ / "out").string(), err = (folder_ / "err").string();

  start_s_ = Now();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::setpgid(0, 0);
    ::dup2(::open("/dev/null", O_RDONLY), 0);
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
    ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 2);
    ::execve(args[0], args.data(), env.data());
    ::_exit(127);
  }
  if (pid_ < 0) throw std::runtime_error("fork failed");
}

ChildProgram::~ChildProgram() {
  if (!Ended()) {
    Signal(SIGKILL);
    ::waitpid(pid_, &status_, 0);
  }
}

bool ChildProgram::Ended() {
  if (!ended_) ended_ = ::wait4(pid_, &status_, WNOHANG, &usage_) == pid_;
  return ended_;
}

void ChildProgram::Signal(int signal) const { ::kill(pid_, signal); }

bool ChildProgram::WaitForErrorText(const std::string& text, double limit_s) {
  const double end = Now() + limit_s;
  while (Now() < end) {
    const bool ended = Ended();
    if (Slurp(folder_ / "err").find(text) != std::string::npos) return !ended;
    if (ended) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return false;
}

ProgramResult ChildProgram::Wait(double limit_s) {
  const double end = start_s_ + limit_s;
  while (!Ended()) {
    if (Now() > end) {
      Signal(SIGKILL);
      ADD_FAILURE() << "not ended after " << limit_s << " s; its messages:\n" << Slurp(folder_ / "err");
    }
    std::this_thread::sleep_for(kPoll);
  }
  ProgramResult result;
  result.seconds = Now() - start_s_;
  result.exit_code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  result.peak_memory_mb = static_cast<double>(usage_.ru_maxrss) / 1024;
  result.out = Slurp(folder_ / "out");
  result.err = Slurp(folder_ / "err");
  return result;
}

ProgramResult RunProgram(const std::vector<std::string>& argv, const std::map<std::string, std::string>& environment) {
  return ChildProgram(argv, environment).Wait();
}

std::vector<pid_t> ProcessesNaming(const fs::path& path) {
  std::vector<pid_t> found;
  std::error_code error;
  for (fs::directory_iterator it("/proc", error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.empty() || !std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c); }))
      continue;
    const pid_t pid = std::stoi(name);
    if (pid != ::getpid() && CommandLine(it->path()).find(path.string()) != std::string::npos) found.push_back(pid);
  }
  return found;
}

bool WaitForNoProcessNaming(const fs::path& path, double limit_s) {
  const double end = Now() + limit_s;
  while (!ProcessesNaming(path).empty()) {
    if (Now() > end) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

}  // namespace lumi
