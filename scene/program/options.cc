#include "scene/program/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "scene/program/command_line_problem.h"
#include "scene/program/error.h"
#include "scene/program/help.h"

namespace lumi {
namespace {

// A UsageError about a word becomes an error of the command line, which names the option.
template <typename F>
auto Checked(std::string name, F take) {
  return [name = std::move(name), take = std::move(take)](const auto& value) {
    try {
      take(value);
    } catch (const UsageError& e) {
      throw CLI::ValidationError(name, e.what());
    }
  };
}

// Words that an option takes: listed in its help, and in the message about any other word.
void TakeOneOf(CLI::Option& option, const std::vector<std::string>& words) {
  option.type_name(fmt::format("{}", fmt::join(words, "|")));
  option.check(CLI::Validator(
      [words](const std::string& given) -> std::string {
        if (std::ranges::count(words, given) > 0) return {};
        const std::string meant = Nearest(given, words);
        return fmt::format("takes {}, not {}{}", fmt::join(words, ", "), given,
                           meant.empty() ? "" : "; did you mean " + meant + "?");
      },
      ""));
}

}  // namespace

Option& Option::Required() { return option_->required(), *this; }
Option& Option::Default() { return option_->capture_default_str(), *this; }
Option& Option::Default(const std::string& text) { return option_->default_str(text), *this; }
Option& Option::Range(int least, int most) { return option_->check(CLI::Range(least, most)), *this; }
Option& Option::Range(double least, double most) { return option_->check(CLI::Range(least, most)), *this; }
Option& Option::Positive() {
  option_->check(CLI::Validator(
      [](const std::string& given) -> std::string {
        char* end = nullptr;
        const double value = std::strtod(given.c_str(), &end);
        if (end == given.c_str() || *end != '\0' || value > 0) return {};  // what is no number is told elsewhere
        return "takes a number above 0, not " + given;
      },
      "POSITIVE"));
  return *this;
}
Option& Option::OneOf(const std::vector<std::string>& words) { return TakeOneOf(*option_, words), *this; }
Option& Option::Values(int count) { return option_->expected(count), *this; }
Option& Option::Commas() { return option_->delimiter(','), *this; }
Option& Option::Pairs() { return option_->type_size(2), *this; }
Option& Option::OneEach() { return option_->allow_extra_args(false), *this; }
Option& Option::TypeName(const std::string& name) { return option_->type_name(name), *this; }
Option& Option::Group(const std::string& name) { return option_->group(name), *this; }
bool Option::given() const { return option_->count() > 0; }

Option Options::Grouped(CLI::Option* option) {
  if (!group_.empty()) option->group(group_);
  return Option(option);
}

template <typename T>
Option Options::Add(const std::string& names, T& target, const std::string& help) {
  return Grouped(app_->add_option(names, target, help));
}
template Option Options::Add(const std::string&, int&, const std::string&);
template Option Options::Add(const std::string&, std::uint64_t&, const std::string&);
template Option Options::Add(const std::string&, double&, const std::string&);
template Option Options::Add(const std::string&, std::string&, const std::string&);
template Option Options::Add(const std::string&, std::filesystem::path&, const std::string&);
template Option Options::Add(const std::string&, std::optional<double>&, const std::string&);
template Option Options::Add(const std::string&, std::optional<int>&, const std::string&);
template Option Options::Add(const std::string&, std::vector<int>&, const std::string&);
template Option Options::Add(const std::string&, std::vector<double>&, const std::string&);
template Option Options::Add(const std::string&, std::vector<std::string>&, const std::string&);
template Option Options::Add(const std::string&, std::vector<std::filesystem::path>&, const std::string&);

Option Options::Call(const std::string& names, std::function<void(const std::string&)> take, const std::string& help) {
  return Grouped(app_->add_option_function<std::string>(names, Checked(names, std::move(take)), help));
}
Option Options::Call(const std::string& names, std::function<void(int)> take, const std::string& help) {
  return Grouped(app_->add_option_function<int>(names, Checked(names, std::move(take)), help));
}
Option Options::Choice(const std::string& names, std::function<void(int)> set, const std::string& help,
                       const std::vector<std::pair<std::string, int>>& choices) {
  std::map<std::string, int> value_of;
  std::vector<std::string> words;
  for (const auto& [word, value] : choices) {
    value_of[word] = value;
    words.push_back(word);
  }
  CLI::Option* option = app_->add_option_function<std::string>(
      names, [set = std::move(set), value_of](const std::string& word) { set(value_of.at(word)); }, help);
  TakeOneOf(*option, words);
  return Grouped(option);
}
Option Options::Pass(const std::string& name, std::vector<std::string>& arguments, const std::string& help) {
  return Call(
      name,
      [&arguments, name](const std::string& value) {
        arguments.insert(arguments.end(), {name, value});
      },
      help);
}
Option Options::PassFlag(const std::string& name, std::vector<std::string>& arguments, const std::string& help) {
  return Grouped(app_->add_flag_callback(
      name, [&arguments, name] { arguments.push_back(name); }, help));
}
Option Options::Flag(const std::string& names, bool& target, const std::string& help) {
  return Grouped(app_->add_flag(names, target, help));
}

Options Options::Command(const std::string& name, const std::string& description) {
  return Options(app_->add_subcommand(name, description));
}
bool Options::given() const { return app_->parsed(); }
Options& Options::Group(const std::string& name) {
  group_ = name;
  return *this;
}
std::vector<std::string> Options::GivenOf(const std::string& group) const {
  std::vector<std::string> names;
  for (const CLI::Option* o : app_->get_options())
    if (o->get_group() == group && o->count() > 0) names.push_back(o->get_name());
  return names;
}
void Options::RequireCommand() { app_->require_subcommand(1); }
void Options::Common(const std::vector<std::string>& names) { ShowCommon(*app_, names); }
void Options::Examples(const std::string& lines) {
  std::string text = "\nExamples:\n";
  for (std::size_t begin = 0; begin < lines.size();) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size());
    text += "  " + lines.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  app_->footer(text);
}
void Options::Footer(const std::string& text) { app_->footer(text); }

}  // namespace lumi
