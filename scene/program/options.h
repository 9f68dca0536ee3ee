// The options of a program or of one of its commands: a name, what it sets, its line of help. The command line's
// library is known to options.cc, command_line_problem.cc and main_program.cc alone.
//
//   options.Add("--faces", request.faces, "Faces wanted, >= 1").Default();
//   options.Add("--format", o.format, "Of the pictures").OneOf({"png", "jpg"});
//   options.Flag("!--no-repair", request.repair, "Refuse a mesh that is not sound instead of mending it");
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lumi {

// What may be said of an option beside its name, its target and its help.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option& Required();
  Option& Default();                         // the target's value stands in the help
  Option& Default(const std::string& text);  // this text stands in the help
  Option& Range(int least, int most);        // inclusive
  Option& Range(double least, double most);
  Option& Positive();
  Option& OneOf(const std::vector<std::string>& words);
  Option& Values(int count);                  // takes so many
  Option& Commas();                           // values may be joined by commas
  Option& Pairs();                            // of values, and it may be given several times
  Option& OneEach();                          // a value each time that it is given
  Option& TypeName(const std::string& name);  // in the help
  Option& Group(const std::string& name);
  bool given() const;

 private:
  CLI::Option* option_;
};

class Options {
 public:
  explicit Options(CLI::App* app) : app_(app) {}

  // The target is an int, a std::uint64_t, a double, a std::string, a path, an optional double, or a list of ints,
  // doubles, strings or paths.
  template <typename T>
  Option Add(const std::string& names, T& target, const std::string& help);
  // One of these words.
  template <typename Enum>
  Option Add(const std::string& names, Enum& target, const std::string& help,
             std::initializer_list<std::pair<const char*, Enum>> words) {
    std::vector<std::pair<std::string, int>> choices;
    for (const auto& [word, value] : words) choices.emplace_back(word, static_cast<int>(value));
    return Choice(
        names, [&target](int value) { target = static_cast<Enum>(value); }, help, choices);
  }
  // `take` throws UsageError for a word that it does not take.
  Option Call(const std::string& names, std::function<void(const std::string&)> take, const std::string& help);
  Option Call(const std::string& names, std::function<void(int)> take, const std::string& help);
  // Appends the name and the value: another program's option, which that program checks.
  Option Pass(const std::string& name, std::vector<std::string>& arguments, const std::string& help);
  Option PassFlag(const std::string& name, std::vector<std::string>& arguments, const std::string& help);
  // "--name" sets, "!--no-name" and "--no-name{false}" unset.
  Option Flag(const std::string& names, bool& target, const std::string& help);

  Options Command(const std::string& name, const std::string& description);
  bool given() const;  // the command
  // Options that are added from here on stand under this heading.
  Options& Group(const std::string& name);
  // Names of the options under this heading that were given.
  std::vector<std::string> GivenOf(const std::string& group) const;
  void RequireCommand();
  void Common(const std::vector<std::string>& names);  // options that --help shows; --help-all shows the others, too
  void Examples(const std::string& lines);             // at the end of the help, below "Examples:"
  void Footer(const std::string& text);                // of the help

 private:
  Option Grouped(CLI::Option* option);
  Option Choice(const std::string& names, std::function<void(int)> set, const std::string& help,
                const std::vector<std::pair<std::string, int>>& choices);
  CLI::App* app_;
  std::string group_;
};

}  // namespace lumi
