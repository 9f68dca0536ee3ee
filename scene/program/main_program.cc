#include "scene/program/main_program.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>

#include "scene/program/command_line_problem.h"
#include "scene/program/completion.h"
#include "scene/program/help.h"
#include "scene/program/interrupt.h"
#include "scene/program/out_of_memory.h"
#include "scene/program/parallel.h"
#include "scene/program/printable.h"
#include "scene/program/version.h"
#include "version/git_description.h"

namespace lumi {
namespace {

constexpr const char* kOutOfMemory = "out of memory";
constexpr const char* kUseLess = "use smaller photos or fewer of them";
constexpr const char* kComplete = "--complete";  // for shells alone, and in no help
constexpr const char* kPleaseReport = "please report it with the command line";

void PrintJson(const std::string& name, const JsonKeys& keys) {
  JsonKeys json;
  json.Say("schema", name).Say("version", kVersion).Append(keys);
  std::fputs((json.Text(2) + "\n").c_str(), stdout);
}

int Report(const std::string& name, bool json, ExitCode code, const std::string& said, const std::string& about,
           const std::string& try_this) {
  // One line, whatever a file is called.
  const std::string message = Printable(said), file = Printable(about), hint = Printable(try_this);
  std::string line = name + ": ";
  // A name without a folder or an ending may be a word of the message by chance.
  const bool said_already = file.find_first_of("/.") != std::string::npos && message.find(file) != std::string::npos;
  if (!file.empty() && !said_already) line += file + ": ";
  line += message;
  if (!hint.empty()) line += " (" + hint + ")";
  // Without fmt::print, which throws where nobody reads any more.
  std::fputs((line + "\n").c_str(), stderr);
  if (json) {
    JsonKeys error;
    error.Say("code", static_cast<int>(code)).Say("file", file).Say("message", message).Say("hint", hint);
    PrintJson(name, JsonKeys().Say("error", error));
  }
  return static_cast<int>(code);
}

// What is said where memory runs out inside a function of a library that may not throw: there is no way back from
// there. Made before, so that saying it takes none.
std::string g_last_words, g_last_json;
std::terminate_handler g_terminate_before = nullptr;

void OnTerminate() {
  // After a failed allocation whatever the exception is: a thread that its library did not wait for has none, and what
  // a library cleans up meanwhile throws its own.
  bool out_of_memory = MemoryRanOut();
  try {
    if (const std::exception_ptr failure = std::current_exception()) std::rethrow_exception(failure);
  } catch (const std::bad_alloc&) {
    out_of_memory = true;
  } catch (...) {
  }
  if (out_of_memory) {
    std::fputs(g_last_words.c_str(), stderr);
    std::fputs(g_last_json.c_str(), stdout);
    std::fflush(stdout);
    ::_exit(static_cast<int>(ExitCode::kMachine));
  }
  if (g_terminate_before) g_terminate_before();
  std::abort();
}

// A crash after a failed allocation.
void OnCrash(int) {
  // Without the standard library: what it holds may be what crashed.
  for (const auto& [stream, words] : {std::pair(STDERR_FILENO, &g_last_words), std::pair(STDOUT_FILENO, &g_last_json)})
    if (::write(stream, words->data(), words->size()) < 0) break;
  ::_exit(static_cast<int>(ExitCode::kMachine));
}

void PrepareLastWords(const std::string& name, bool json) {
  g_last_words = fmt::format("{}: {} ({})\n", name, kOutOfMemory, kUseLess);
  if (json) {
    JsonKeys error, whole;
    error.Say("code", static_cast<int>(ExitCode::kMachine)).Say("message", kOutOfMemory).Say("hint", kUseLess);
    g_last_json = whole.Say("schema", name).Say("version", kVersion).Say("error", error).Text(2) + "\n";
  }
  if (!g_terminate_before) g_terminate_before = std::set_terminate(OnTerminate);
}

}  // namespace

Program::Program(std::string name, std::string description)
    : name_(std::move(name)),
      app_(std::make_unique<CLI::App>(std::move(description), name_)),
      options_(app_.get()),
      sink_(MakeStderrProgress(true)) {
  app_->formatter(MakeHelpFormatter());
  app_->set_help_all_flag("--help-all", "All options, and those of the commands");
  app_->set_version_flag("--version", fmt::format("{} {} ({})", name_, kVersion, kGitDescription));
  options_.Flag("--json", json_, "Print a summary as JSON on stdout; messages go to stderr");
  options_.Flag("--quiet", quiet_, "No progress, no remarks; figures that are asked for in one line");
  options_.Add("--threads", threads_, "Threads to use; 0 = all cores").Range(0, 4096).Default();
  options_.Add("--seed", seed_, "Seed of everything random").Default();
  app_->fallthrough();
}
Program::~Program() = default;

Options Program::Command(const std::string& name, const std::string& description, std::function<Answer()> body,
                         std::vector<std::string> also) {
  also.insert(also.end(), {"--json", "--quiet", "--threads", "--seed"});
  taken_[name] = std::move(also);
  commands_.emplace_back(options_.Command(name, description), std::move(body));
  return commands_.back().first;
}

void Program::RunAndExit(int argc, char** argv, const std::function<Answer()>& body) {
  const int code = Run(argc, argv, body);
  // All is said and done. What libraries tear down at the end of a program allocates, waits for their threads and their
  // locks, and can fail: then a run that did all it should would end as one that did not, or never.
  std::fflush(nullptr);
  ::_exit(code);
}

int Program::Run(int argc, char** argv, const std::function<Answer()>& body) {
  WatchAllocations(OnCrash);
  InstallInterruptHandler();
  try {
    PrepareLastWords(name_, false);
    if (argc > 1 && std::string(argv[1]) == kComplete) {
      for (const std::string& word : Completions(*app_, {argv + 2, argv + argc}, taken_)) std::puts(word.c_str());
      return 0;
    }
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app_->exit(e);  // --help, --version
    if (MemoryRanOut()) return Report(name_, false, ExitCode::kMachine, kOutOfMemory, "", kUseLess);
    bool json = false;
    for (int i = 1; i < argc; ++i) json = json || std::string(argv[i]) == "--json";
    const CommandLineProblem problem = Explain(*app_, e, taken_);
    return Report(name_, json, ExitCode::kUsage, problem.message, "", problem.hint);
  } catch (const std::bad_alloc&) {
    return Report(name_, false, ExitCode::kMachine, kOutOfMemory, "", kUseLess);
  }
  for (const auto& problem : {WordBesideCommand(*app_), OptionBesideCommand(*app_, taken_)})
    if (problem) return Report(name_, json_, ExitCode::kUsage, problem->message, "", problem->hint);
  try {
    PrepareLastWords(name_, json_);
    sink_ = MakeStderrProgress(quiet_);
    SetThreadCount(threads_);
    const std::function<Answer()>* what = &body;
    for (const auto& [command, does] : commands_)
      if (command.given()) what = &does;
    const Answer answer = (*what)();
    ThrowIfMemoryRanOut();
    if (json_)
      PrintJson(name_, answer.keys);
    else if (const std::string& text = quiet_ ? answer.result : answer.text; !text.empty())
      std::puts(text.c_str());
    if (std::fflush(stdout) != 0) throw MachineError("cannot write to standard output");
    return 0;
  } catch (const Error& e) {
    // Libraries take a failed allocation for whatever they were doing: "could not open", "corrupt".
    if (MemoryRanOut() && e.code() != ExitCode::kInterrupted)
      return Report(name_, json_, ExitCode::kMachine, kOutOfMemory, e.file().string(), kUseLess);
    return Report(name_, json_, e.code(), e.what(), e.file().string(), e.hint());
  } catch (const std::bad_alloc&) {
    return Report(name_, json_, ExitCode::kMachine, kOutOfMemory, "", kUseLess);
  } catch (const std::filesystem::filesystem_error& e) {
    return Report(name_, json_, ExitCode::kMachine, e.code().message(), e.path1().string(), "");
  } catch (const std::system_error& e) {
    if (e.code() != std::errc::resource_unavailable_try_again && e.code() != std::errc::not_enough_memory)
      return Report(name_, json_, ExitCode::kBug, std::string("a bug of ours: ") + e.what(), "", kPleaseReport);
    return Report(name_, json_, ExitCode::kMachine, std::string("no thread can be started: ") + e.what(), "",
                  "use fewer threads: --threads 1");
  } catch (const std::exception& e) {
    // OpenCV's own allocations fail with an exception of its own.
    if (MemoryRanOut() || std::string(e.what()).find("OutOfMemoryError") != std::string::npos)
      return Report(name_, json_, ExitCode::kMachine, kOutOfMemory, "", kUseLess);
    return Report(name_, json_, ExitCode::kBug, std::string("a bug of ours: ") + e.what(), "", kPleaseReport);
  }
}

}  // namespace lumi
