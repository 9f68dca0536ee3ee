// What is wrong with a command line, in the user's words: which option, and which one was probably meant.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
class ParseError;
}  // namespace CLI

namespace lumi {

struct CommandLineProblem {
  std::string message, hint;
};

// Of each command the options of the program itself that it takes, by name ("--effects") or by heading.
using TakenOptions = std::map<std::string, std::vector<std::string>>;
bool Takes(const TakenOptions& taken, const CLI::App& command, const CLI::Option& of_the_program);

// Of a line that `app` has just refused.
CommandLineProblem Explain(const CLI::App& app, const CLI::ParseError& error, const TakenOptions& taken);

// Of a line that was read: a word after a command that is none of the command's, and was taken for the program's input.
std::optional<CommandLineProblem> WordBesideCommand(const CLI::App& app);

// Of a line that was read: an option of the program itself beside a command that has no use for it, which would be
// read and do nothing.
std::optional<CommandLineProblem> OptionBesideCommand(const CLI::App& app, const TakenOptions& taken);

// The word of `known` that is nearest to `word` by letters left out, added, changed or swapped (leading dashes and case
// aside), or the only one that begins with it; empty where none is near.
std::string Nearest(const std::string& word, const std::vector<std::string>& known);

}  // namespace lumi
