#include "scene/program/completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace lumi {
namespace {

// The options of the program, or of a command and those of the program that it takes.
std::vector<const CLI::Option*> OptionsOf(const CLI::App& app, const CLI::App* command, const TakenOptions& taken) {
  std::vector<const CLI::Option*> options;
  if (command != nullptr)
    for (const CLI::Option* o : command->get_options()) options.push_back(o);
  for (const CLI::Option* o : app.get_options())
    if (command == nullptr || Takes(taken, *command, *o)) options.push_back(o);
  return options;
}

// "off|distance|jacobian" as its words.
std::vector<std::string> WordsTaken(const CLI::Option& option) {
  std::vector<std::string> words;
  std::string type = option.get_type_name();
  type.erase(std::min(type.find('='), type.size()));
  if (type.find('|') == std::string::npos) return words;
  for (std::size_t begin = 0; begin <= type.size();) {
    const std::size_t end = std::min(type.find('|', begin), type.size());
    words.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

}  // namespace

std::vector<std::string> Completions(const CLI::App& app, const std::vector<std::string>& words,
                                     const TakenOptions& taken) {
  const std::string typed = words.empty() ? std::string() : words.back();
  const CLI::App* command = nullptr;
  for (std::size_t i = 0; i + 1 < words.size() && command == nullptr; ++i)
    for (const CLI::App* c : app.get_subcommands([](const CLI::App*) { return true; }))
      if (c->get_name() == words[i]) command = c;
  const std::vector<const CLI::Option*> options = OptionsOf(app, command, taken);
  std::vector<std::string> found;
  const auto offer = [&](const std::string& word) {
    if (!word.empty() && word.starts_with(typed) && std::ranges::find(found, word) == found.end())
      found.push_back(word);
  };
  const std::string before = words.size() > 1 ? words[words.size() - 2] : std::string();
  if (before.starts_with("-"))
    for (const CLI::Option* o : options)
      if (o->check_name(before) && TakesValue(*o)) {
        for (const std::string& word : WordsTaken(*o)) offer(word);
        return found;
      }
  if (typed.starts_with("-")) {
    for (const CLI::Option* o : options)
      for (const std::string& name : o->get_lnames()) offer("--" + name);
  } else if (command == nullptr) {
    for (const CLI::App* c : app.get_subcommands([](const CLI::App*) { return true; })) offer(c->get_name());
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace lumi
