#include "scene/program/subprocess.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <optional>

#include "scene/program/error.h"
#include "scene/program/installation.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"

extern char** environ;

namespace lumi {
namespace {

constexpr std::size_t kTailLines = 40;
constexpr int kPollMs = 200;
constexpr double kGraceSeconds = 5;            // from SIGTERM to SIGKILL
constexpr std::size_t kLongestLine = 1 << 16;  // what goes on without an end is no line: it is cut

// Splits a byte stream into lines; a carriage return ends a line too (progress that redraws itself).
class LineSplitter {
 public:
  template <typename F>
  void Feed(const char* data, std::size_t n, F&& emit) {
    for (std::size_t i = 0; i < n; ++i) {
      if (data[i] == '\n' || data[i] == '\r' || line_.size() == kLongestLine) {
        if (!line_.empty()) emit(line_);
        line_.clear();
      }
      if (data[i] != '\n' && data[i] != '\r') line_.push_back(data[i]);
    }
  }
  template <typename F>
  void Flush(F&& emit) {
    if (!line_.empty()) emit(line_);
    line_.clear();
  }

 private:
  std::string line_;
};

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int fd[2];
    if (pipe2(fd, O_CLOEXEC) != 0) throw MachineError(std::string("cannot make a pipe: ") + std::strerror(errno));
    read = fd[0];
    write = fd[1];
  }
  void CloseWrite() {
    if (write >= 0) close(write);
    write = -1;
  }
  ~Pipe() {
    CloseWrite();
    if (read >= 0) close(read);
  }
};

std::vector<std::string> EnvironmentWith(const std::map<std::string, std::string>& more) {
  std::vector<std::string> environment;
  for (char** e = environ; *e; ++e) {
    const std::string entry(*e);
    if (!more.count(entry.substr(0, entry.find('=')))) environment.push_back(entry);
  }
  for (const auto& [key, value] : more) environment.push_back(key + "=" + value);
  return environment;
}

// Whether a child has ended; its status stays to be read.
bool HasEnded(pid_t pid) {
  siginfo_t info{};
  return waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid;
}

}  // namespace

std::optional<std::filesystem::path> FindProgram(const std::string& name) {
  if (name.find('/') != std::string::npos)
    return access(name.c_str(), X_OK) == 0 ? std::optional<std::filesystem::path>(name) : std::nullopt;
  const char* path = std::getenv("PATH");
  std::string_view rest = path ? path : "/usr/local/bin:/usr/bin:/bin";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    const std::filesystem::path candidate = std::filesystem::path(rest.substr(0, colon)) / name;
    std::error_code ec;
    if (std::filesystem::is_regular_file(candidate, ec) && access(candidate.c_str(), X_OK) == 0) return candidate;
    rest = colon == std::string_view::npos ? std::string_view{} : rest.substr(colon + 1);
  }
  return std::nullopt;
}

std::filesystem::path SiblingProgram(const std::string& name) {
  if (const auto own = FindOfSuite(name); own && access(own->c_str(), X_OK) == 0) return *own;
  if (const auto found = FindProgram(name)) return *found;
  throw MachineError("the program " + name + " is neither beside this one nor in PATH",
                     "build or install the whole suite");
}

SubprocessResult RunSubprocess(const std::vector<std::string>& argv, const SubprocessOptions& options) {
  const auto program = FindProgram(argv.at(0));
  if (!program) throw MachineError("cannot find the program " + argv[0], "install it, or put it in PATH");

  std::vector<std::string> environment = EnvironmentWith(options.environment);
  std::vector<char*> env, args;
  for (auto& e : environment) env.push_back(e.data());
  env.push_back(nullptr);
  std::vector<std::string> argv_copy = argv;
  for (auto& a : argv_copy) args.push_back(a.data());
  args.push_back(nullptr);

  Pipe out, err;
  const Stopwatch watch;
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) throw MachineError(std::string("cannot start ") + argv[0] + ": " + std::strerror(errno));
  if (pid == 0) {
    // Its own group: a Ctrl-C in the terminal reaches us, and we pass it on.
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);
    const int null = open("/dev/null", O_RDONLY);
    dup2(null, 0);
    dup2(options.separate_stdout ? out.write : err.write, 1);
    dup2(err.write, 2);
    std::signal(SIGPIPE, SIG_DFL);
    execve(program->c_str(), args.data(), env.data());
    _exit(127);
  }
  out.CloseWrite();
  err.CloseWrite();

  std::ofstream log;
  if (options.log_file) log.open(*options.log_file, std::ios::app);
  SubprocessResult result;
  std::deque<std::string> tail;
  LineSplitter splitter;
  const auto emit = [&](const std::string& line) {
    tail.push_back(line);
    if (tail.size() > kTailLines) tail.pop_front();
    if (log) log << line << '\n';
    if (options.on_line) options.on_line(line);
  };

  std::array<char, 1 << 16> buffer;
  bool out_open = true, err_open = true, ended = false;
  std::optional<Stopwatch> stopping;
  std::exception_ptr failure;
  const auto stop = [&] {
    if (stopping) return;
    kill(-pid, SIGTERM);
    stopping.emplace();
  };
  while (out_open || err_open) {
    if (InterruptRequested()) stop();
    if (stopping && stopping->Seconds() > kGraceSeconds) kill(-pid, SIGKILL);
    pollfd fds[2] = {{out_open ? out.read : -1, POLLIN, 0}, {err_open ? err.read : -1, POLLIN, 0}};
    const int ready = poll(fds, 2, ended ? 0 : kPollMs);
    if (ready < 0 && errno != EINTR) break;
    if (ready == 0) {
      if (ended) {  // all that it said is read: what still holds the pipes is a process that it left behind
        kill(-pid, SIGKILL);
        break;
      }
      ended = HasEnded(pid);  // its last words may have come since
    }
    if (ready <= 0) continue;
    if (fds[0].revents) {
      const ssize_t n = read(out.read, buffer.data(), buffer.size());
      if (n > 0)
        result.out.append(buffer.data(), static_cast<std::size_t>(n));
      else if (n == 0)
        out_open = false;
    }
    if (fds[1].revents) {
      const ssize_t n = read(err.read, buffer.data(), buffer.size());
      try {
        if (n > 0)
          splitter.Feed(buffer.data(), static_cast<std::size_t>(n), emit);
        else if (n == 0)
          err_open = false;
      } catch (...) {  // a callback stopped the run: end the child first
        if (!failure) failure = std::current_exception();
        stop();
      }
    }
  }
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (failure) std::rethrow_exception(failure);
  splitter.Flush(emit);
  CheckInterrupted();
  if (!WIFEXITED(status)) result.signal = WTERMSIG(status);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + result.signal;
  result.tail.assign(tail.begin(), tail.end());
  result.seconds = watch.Seconds();
  if (result.exit_code == 127 && result.tail.empty() && result.out.empty())
    throw MachineError("cannot start " + program->string());
  return result;
}

}  // namespace lumi
