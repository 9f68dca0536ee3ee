// What is wrong with a command line, in the user's words: which option, and which one was probably meant.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace lumi {

struct CommandLineProblem {
  std::string message, hint;
};

// Of a line that `app` has just refused.
CommandLineProblem Explain(const CLI::App& app, const CLI::ParseError& error);

// Of a line that was read: a word after a command that is none of the command's, and was taken for the program's input.
std::optional<CommandLineProblem> WordBesideCommand(const CLI::App& app);

// Of a line that was read: an option of the program itself beside a command that has no use for it, which would be
// read and do nothing. `taken`: the program's options that the command takes, by name ("--effects") or by heading.
std::optional<CommandLineProblem> OptionBesideCommand(const CLI::App& app, const std::vector<std::string>& taken);

// The word of `known` that is nearest to `word` by letters left out, added, changed or swapped (leading dashes and case
// aside), or the only one that begins with it; empty where none is near.
std::string Nearest(const std::string& word, const std::vector<std::string>& known);

}  // namespace lumi
