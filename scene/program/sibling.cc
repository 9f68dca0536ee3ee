#include "scene/program/sibling.h"

#include <fmt/format.h>

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

[[noreturn]] void ThrowFailure(const std::string& program, int exit_code, const Failure& failure,
                               const std::string& last_line) {
  const bool said = failure.code >= 0;
  if ((said ? failure.code : exit_code) == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  if (said) throw Error(static_cast<ExitCode>(failure.code), failure.message, failure.file, failure.hint);
  constexpr int kKilled = 128 + 9;
  if (exit_code == kKilled)
    throw MachineError(program + " was killed from outside",
                       "the machine may be short of memory; a second run goes on from here");
  throw Error(ExitCode::kBug, fmt::format("{} ended with code {}{}", program, exit_code,
                                          last_line.empty() ? " without a word" : ": " + last_line));
}

}  // namespace

std::vector<std::string> SiblingCommand(const Sibling& sibling) {
  std::vector<std::string> argv{SiblingProgram(sibling.program).string()};
  argv.insert(argv.end(), sibling.arguments.begin(), sibling.arguments.end());
  argv.push_back("--json");
  return argv;
}

SiblingOutput::SiblingOutput(const Sibling& sibling, ProgressSink& progress)
    : sibling_(sibling), progress_(progress), display_(progress, sibling.task) {}

void SiblingOutput::Line(const std::string& line) {
  last_line_ = line;
  if (const auto parsed = ParseProgressLine(line))
    display_.Show(*parsed);
  else if (line.starts_with(sibling_.program + ": "))
    // A failing program says so in a line of its own, which is thrown, not shown: it begins with the program's name.
    own_line_ = line.substr(sibling_.program.size() + 2);
  else
    progress_.Message(sibling_.speaker + line);
}

SiblingAnswer SiblingOutput::Answer(int exit_code, const std::string& out, double seconds) {
  const auto summary = JsonKeys::Parse(out);
  if (exit_code != 0)
    ThrowFailure(sibling_.program, exit_code, summary ? summary->As<FailedSummary>().error : Failure(),
                 own_line_.empty() ? last_line_ : own_line_);
  if (!summary) throw Error(ExitCode::kBug, sibling_.program + " printed no JSON summary");
  if (!own_line_.empty()) progress_.Message(sibling_.speaker + own_line_);
  return {*summary, seconds};
}

SiblingAnswer RunSibling(const Sibling& sibling, ProgressSink& progress) {
  CheckInterrupted();
  SiblingOutput output(sibling, progress);
  SubprocessOptions options;
  options.separate_stdout = true;
  options.environment["LUMI_PROGRESS_PIPE"] = "1";
  options.on_line = [&](const std::string& line) { output.Line(line); };
  const SubprocessResult result = RunSubprocess(SiblingCommand(sibling), options);
  return output.Answer(result.exit_code, result.out, result.seconds);
}

}  // namespace lumi
