#include "pipeline/sibling_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

// "reused": true, or the list of what was, "everything" among it.
bool HadNothingToDo(const json& summary) {
  const auto reused = summary.find("reused");
  if (reused == summary.end()) return false;
  if (reused->is_boolean()) return reused->get<bool>();
  return reused->is_array() && std::find(reused->begin(), reused->end(), "everything") != reused->end();
}

[[noreturn]] void ThrowFailure(const SiblingStage& stage, const SubprocessResult& result, const json& summary,
                               const std::string& last_line) {
  if (summary.is_object() && summary.contains("error") && summary["error"].is_object()) {
    const json& error = summary["error"];
    const int code = error.value("code", result.exit_code);
    const std::string message = stage.name + ": " + error.value("message", "failed");
    if (code == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
    throw Error(static_cast<ExitCode>(code), message, error.value("file", ""), error.value("hint", ""));
  }
  constexpr int kKilled = 128 + 9;
  if (result.exit_code == kKilled)
    throw MachineError(stage.program + " was killed from outside", "the machine may be short of memory; a second run goes on from here");
  if (result.exit_code == static_cast<int>(ExitCode::kInterrupted)) throw Interrupted();
  throw Error(ExitCode::kBug, fmt::format("{} ended with code {}{}", stage.program, result.exit_code,
                                          last_line.empty() ? " without a word" : ": " + last_line));
}

}  // namespace

StageResult RunSiblingStage(const SiblingStage& stage, ProgressSink& progress) {
  CheckInterrupted();
  std::vector<std::string> argv{SiblingProgram(stage.program).string()};
  argv.insert(argv.end(), stage.arguments.begin(), stage.arguments.end());
  argv.push_back("--json");

  ChildProgress display(progress, fmt::format("stage {}/{} {}: ", stage.number, stage.count, stage.name));
  // A failing program says so in a line of its own, which is thrown, not shown: it begins with the program's name.
  std::string own_line;
  SubprocessOptions options;
  options.separate_stdout = true;
  options.environment["LUMI_PROGRESS_PIPE"] = "1";
  options.on_line = [&](const std::string& line) {
    if (const auto parsed = ParseProgressLine(line))
      display.Show(*parsed);
    else if (line.starts_with(stage.program + ": "))
      own_line = line.substr(stage.program.size() + 2);
    else
      progress.Message(stage.name + ": " + line);
  };
  const auto start = Clock::now();
  const SubprocessResult result = RunSubprocess(argv, options);

  const json summary = json::parse(result.out, nullptr, false);
  if (result.exit_code != 0) ThrowFailure(stage, result, summary, own_line.empty() && !result.tail.empty() ? result.tail.back() : own_line);
  if (!summary.is_object()) throw Error(ExitCode::kBug, stage.program + " printed no JSON summary");
  if (!own_line.empty()) progress.Message(stage.name + ": " + own_line);

  StageResult stage_result;
  stage_result.name = stage.name;
  stage_result.seconds = SecondsSince(start);
  stage_result.reused = HadNothingToDo(summary);
  stage_result.json = summary.dump();
  return stage_result;
}

}  // namespace lumi
