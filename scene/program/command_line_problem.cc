#include "scene/program/command_line_problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <optional>

namespace lumi {
namespace {

constexpr std::size_t kLettersAnError = 3;  // a word may have one wrong letter for each so many letters

std::string Plain(const std::string& word) {
  std::string plain = word.substr(std::min(word.find_first_not_of('-'), word.size()));
  std::ranges::transform(plain, plain.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return plain;
}

// Damerau and Levenshtein's, of adjacent swaps.
std::size_t Distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::vector<std::string> LongOptions(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* o : app.get_options())
    for (const std::string& name : o->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : CommandsOf(app)) names.push_back(command->get_name());
  return names;
}

// The command that was given, or the program.
const CLI::App& Given(const CLI::App& app) {
  for (const CLI::App* command : CommandsOf(app))
    if (command->parsed()) return *command;
  return app;
}

std::string NameOf(const CLI::App& app, const CLI::App& given) {
  return &given == &app ? app.get_name() : app.get_name() + " " + given.get_name();
}

CommandLineProblem UnknownOption(const CLI::App& app, const std::string& argument, const TakenOptions& taken) {
  const CLI::App& given = Given(app);
  const std::string option = argument.substr(0, argument.find('='));
  std::vector<std::string> known = LongOptions(given);
  if (&given != &app)
    for (const CLI::Option* o : app.get_options())
      if (Takes(taken, given, *o))
        for (const std::string& name : o->get_lnames()) known.push_back("--" + name);
  CommandLineProblem problem{fmt::format("{} is no option of {}", option, NameOf(app, given)), ""};
  std::vector<std::string> elsewhere;
  for (const CLI::App* command : CommandsOf(app))
    if (command != &given && std::ranges::count(LongOptions(*command), option) > 0)
      elsewhere.push_back(NameOf(app, *command));
  if (const std::string meant = Nearest(option, known); !meant.empty())
    problem.hint = fmt::format("did you mean {}? see {} --help", meant, NameOf(app, given));
  else if (!elsewhere.empty())
    problem.hint = fmt::format("it is one of {}", fmt::join(elsewhere, ", "));
  else
    problem.hint = "see " + NameOf(app, given) + " --help";
  return problem;
}

CommandLineProblem UnknownWord(const CLI::App& app, const std::string& word, bool command_missing) {
  const std::vector<std::string> commands = CommandNames(app);
  const std::string meant = Nearest(word, commands);
  CommandLineProblem problem;
  problem.message = command_missing ? fmt::format("\"{}\" is no command of {}", word, app.get_name())
                                    : fmt::format("\"{}\" is one argument too many", word);
  // What was taken for an input may have been meant for a command.
  if (!command_missing)
    for (const CLI::Option* o : app.get_options())
      if (o->get_positional() && o->count() > 0)
        for (const std::string& taken : o->results())
          if (const std::string command = Nearest(taken, commands); !command.empty() && problem.hint.empty())
            problem.hint = fmt::format("did you mean the command {} by {}?", command, taken);
  if (command_missing)
    problem.hint =
        meant.empty() ? fmt::format("one of {}", fmt::join(commands, ", ")) : fmt::format("did you mean {}?", meant);
  return problem;
}

// The kind of value of an option as --help has it: INT, FLOAT, TEXT ... or empty.
std::string TypeOf(const CLI::App& app, const std::string& option) {
  for (const CLI::App* a : {&Given(app), &app})
    for (const CLI::Option* o : a->get_options())
      if (o->get_name() == option) {
        const std::string type = o->get_type_name();
        return type.substr(0, type.find_first_of(": "));
      }
  return "";
}

CommandLineProblem NoValue(const std::string& option, const std::string& type) {
  return {fmt::format("{} takes a value{}, and none follows it", option, type.empty() ? "" : " (" + type + ")"), ""};
}

// "--width: 1 required INT missing", which is all that the library says of a value that is not there.
std::optional<CommandLineProblem> MissingValue(const std::string& text) {
  const auto colon = text.find(": "), required = text.find(" required ");
  constexpr std::string_view kMissing = " missing";
  if (colon == std::string::npos || required == std::string::npos || required < colon || !text.ends_with(kMissing))
    return std::nullopt;
  const std::string option = text.substr(0, colon), count = text.substr(colon + 2, required - colon - 2);
  constexpr std::size_t kAfter = std::string_view(" required ").size();
  std::string type = text.substr(required + kAfter, text.size() - kMissing.size() - required - kAfter);
  type.resize(std::min(type.find(':'), type.size()));
  if (count == "1") return NoValue(option, type);
  return CommandLineProblem{fmt::format("{} takes {} values more ({})", option, count, type), ""};
}

// "Could not convert: --width = abc".
std::optional<CommandLineProblem> WrongType(const CLI::App& app, const std::string& text) {
  constexpr std::string_view kBegin = "Could not convert: ";
  const auto equals = text.find(" = ");
  if (!text.starts_with(kBegin) || equals == std::string::npos) return std::nullopt;
  const std::string option = text.substr(kBegin.size(), equals - kBegin.size()), value = text.substr(equals + 3);
  const std::string type = TypeOf(app, option);
  if (value.starts_with("--")) return NoValue(option, type);  // the next option was taken for it
  const std::string wanted = type == "INT"     ? "a whole number"
                             : type == "UINT"  ? "a whole number of 0 or more"
                             : type == "FLOAT" ? "a number"
                                               : "another kind of value";
  return CommandLineProblem{fmt::format("{} takes {}, not {}", option, wanted, value), ""};
}

// "--width: Value 0 not in range 1 to 100", "... [1 - 100]".
std::optional<CommandLineProblem> OutOfRange(const CLI::App& app, const std::string& text) {
  constexpr std::string_view kValue = ": Value ", kRange = " not in range ";
  const auto value = text.find(kValue), range = text.find(kRange);
  if (value == std::string::npos || range == std::string::npos || range < value) return std::nullopt;
  const std::string option = text.substr(0, value);
  const std::string given = text.substr(value + kValue.size(), range - value - kValue.size());
  if (given.starts_with("--")) return NoValue(option, TypeOf(app, option));
  std::string limits = text.substr(range + kRange.size());
  std::erase_if(limits, [](char c) { return c == '[' || c == ']'; });
  if (const auto dash = limits.find(" - "); dash != std::string::npos) limits.replace(dash, 3, " to ");
  return CommandLineProblem{fmt::format("{} takes {}, not {}", option, limits, given), ""};
}

}  // namespace

std::string Nearest(const std::string& word, const std::vector<std::string>& known) {
  const std::string plain = Plain(word);
  std::string best;
  std::size_t least = plain.size() / kLettersAnError + (plain.size() > 1 ? 1 : 0);
  std::vector<std::string> longer;
  for (const std::string& candidate : known) {
    const std::string other = Plain(candidate);
    if (plain.size() >= 3 && other.starts_with(plain)) longer.push_back(candidate);
    const std::size_t distance = Distance(plain, other);
    // A candidate that keeps nothing of the word is not near: "--k" is no misspelt "--x".
    if (distance >= std::max(plain.size(), other.size())) continue;
    if (distance < least || (distance == least && best.empty())) {
      least = distance;
      best = candidate;
    }
  }
  return best.empty() && longer.size() == 1 ? longer.front() : best;
}

bool Takes(const TakenOptions& taken, const CLI::App& command, const CLI::Option& of_the_program) {
  const auto options = taken.find(command.get_name());
  return options != taken.end() && (std::ranges::count(options->second, of_the_program.get_name()) > 0 ||
                                    std::ranges::count(options->second, of_the_program.get_group()) > 0);
}

CommandLineProblem Explain(const CLI::App& app, const CLI::ParseError& error, const TakenOptions& taken) {
  // An option that does not exist is the likeliest cause of anything else that is missing.
  std::vector<std::string> words;
  for (const std::string& argument : app.remaining(true)) {
    if (argument.size() > 1 && argument.front() == '-' && argument != "--" &&
        std::isdigit(static_cast<unsigned char>(argument[1])) == 0 && argument[1] != '.')
      return UnknownOption(app, argument, taken);
    if (argument != "--") words.push_back(argument);
  }
  const std::string text = error.what();
  CommandLineProblem problem{text, ""};
  if (text.starts_with("A subcommand")) {
    problem = words.empty() ? CommandLineProblem{"a command is missing",
                                                 fmt::format("one of {}", fmt::join(CommandNames(app), ", "))}
                            : UnknownWord(app, words.front(), true);
  } else if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) && !words.empty()) {
    problem = UnknownWord(app, words.front(), false);
  } else if (const auto missing = MissingValue(text)) {
    problem = *missing;
  } else if (const auto type = WrongType(app, text)) {
    problem = *type;
  } else if (const auto range = OutOfRange(app, text)) {
    problem = *range;
  }
  if (problem.hint.empty()) problem.hint = "see " + NameOf(app, Given(app)) + " --help";
  return problem;
}

std::optional<CommandLineProblem> WordBesideCommand(const CLI::App& app) {
  if (&Given(app) == &app) return std::nullopt;
  for (const CLI::Option* o : app.get_options())
    if (o->get_positional() && o->count() > 0)
      return CommandLineProblem{fmt::format("\"{}\" is one argument too many", o->results().front()),
                                "see " + NameOf(app, Given(app)) + " --help"};
  return std::nullopt;
}

std::optional<CommandLineProblem> OptionBesideCommand(const CLI::App& app, const TakenOptions& taken) {
  const CLI::App& given = Given(app);
  if (&given == &app) return std::nullopt;
  for (const CLI::Option* o : app.get_options()) {
    if (o->get_positional() || o->count() == 0 || Takes(taken, given, *o)) continue;
    const std::string name = o->get_name();
    return CommandLineProblem{
        fmt::format("{} is no option of {}", name, NameOf(app, given)),
        std::ranges::count(LongOptions(given), name) > 0
            ? fmt::format("{} has its own, which stands after it", given.get_name())
            : fmt::format("it is one of {} itself; see {} --help", app.get_name(), NameOf(app, given))};
  }
  return std::nullopt;
}

}  // namespace lumi
