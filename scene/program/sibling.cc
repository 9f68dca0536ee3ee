#include "scene/program/sibling.h"

#include <fmt/format.h>

#include "scene/program/child_progress.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace {

// What a program that failed prints.
struct Failure {
  int code = -1;  // it printed none
  std::string message = "failed", file, hint;
};
void ListKeys(JsonKeys& j, Failure& f) { j("code", f.code, "message", f.message, "file", f.file, "hint", f.hint); }
struct FailedSummary {
  Failure error;
};
void ListKeys(JsonKeys& j, FailedSummary& s) { j("error", s.error); }

[[noreturn]] void ThrowFailure(const std::string& program, const SubprocessResult& result, const Failure& failure,
                               const std::string& last_line) {
  const bool said = failure.code >= 0;
  if ((said ? failure.code : result.exit_code) == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  if (said) throw Error(static_cast<ExitCode>(failure.code), failure.message, failure.file, failure.hint);
  constexpr int kKilled = 128 + 9;
  if (result.exit_code == kKilled)
    throw MachineError(program + " was killed from outside",
                       "the machine may be short of memory; a second run goes on from here");
  throw Error(ExitCode::kBug, fmt::format("{} ended with code {}{}", program, result.exit_code,
                                          last_line.empty() ? " without a word" : ": " + last_line));
}

}  // namespace

SiblingAnswer RunSibling(const Sibling& sibling, ProgressSink& progress) {
  CheckInterrupted();
  std::vector<std::string> argv{SiblingProgram(sibling.program).string()};
  argv.insert(argv.end(), sibling.arguments.begin(), sibling.arguments.end());
  argv.push_back("--json");

  ChildProgress display(progress, sibling.task);
  // A failing program says so in a line of its own, which is thrown, not shown: it begins with the program's name.
  std::string own_line;
  SubprocessOptions options;
  options.separate_stdout = true;
  options.environment["LUMI_PROGRESS_PIPE"] = "1";
  options.on_line = [&](const std::string& line) {
    if (const auto parsed = ParseProgressLine(line))
      display.Show(*parsed);
    else if (line.starts_with(sibling.program + ": "))
      own_line = line.substr(sibling.program.size() + 2);
    else
      progress.Message(sibling.speaker + line);
  };
  const SubprocessResult result = RunSubprocess(argv, options);
  const auto summary = JsonKeys::Parse(result.out);
  if (result.exit_code != 0)
    ThrowFailure(sibling.program, result, summary ? summary->As<FailedSummary>().error : Failure(),
                 own_line.empty() && !result.tail.empty() ? result.tail.back() : own_line);
  if (!summary) throw Error(ExitCode::kBug, sibling.program + " printed no JSON summary");
  if (!own_line.empty()) progress.Message(sibling.speaker + own_line);
  return {*summary, result.seconds};
}

}  // namespace lumi
