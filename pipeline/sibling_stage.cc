#include "pipeline/sibling_stage.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/program/error.h"
#include "scene/program/shell_word.h"
#include "scene/program/sibling.h"

namespace lumi {
namespace {

// "reused": true, or the list of what was, "everything" among it.
struct Reuse {
  bool all = false;
  std::vector<std::string> parts;
};
void ListKeys(JsonKeys& j, Reuse& r) { j("reused", r.all, "reused", r.parts); }

}  // namespace

bool HadNothingToDo(const JsonKeys& summary) {
  const Reuse reuse = summary.As<Reuse>();
  return reuse.all || std::ranges::find(reuse.parts, "everything") != reuse.parts.end();
}

std::string CommandOf(const std::string& program, const std::vector<std::string>& arguments) {
  std::string command = program;
  for (const std::string& a : arguments) command += " " + ShellWord(a);
  return command;
}

StageResult RunSiblingStage(const SiblingStage& stage, ProgressSink& progress) {
  try {
    const Sibling sibling{
        stage.program, stage.arguments,
        stage.count > 1 ? fmt::format("stage {}/{} {}: ", stage.number, stage.count, stage.name) : stage.name + ": ",
        stage.name + ": "};
    const SiblingAnswer answer = stage.executor ? stage.executor->Run({stage.name, sibling, stage.wanted}, progress)
                                                : RunSibling(sibling, progress);
    return {stage.name,     answer.seconds, HadNothingToDo(answer.summary),
            answer.summary, answer.seconds, CommandOf(stage.program, stage.arguments)};
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    throw Error(e.code(), stage.name + ": " + e.what(), e.file(), e.hint());
  }
}

}  // namespace lumi
