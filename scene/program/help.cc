#include "scene/program/help.h"

#include <CLI/CLI.hpp>
#include <map>
#include <stdexcept>

namespace lumi {
namespace {

class CommonFirst final : public CLI::Formatter {
 public:
  CommonFirst() { column_width(34); }
  void Show(const CLI::App* app, std::vector<std::string> names) { common_[app] = std::move(names); }
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;

 private:
  std::map<const CLI::App*, std::vector<std::string>> common_;
};

// "--no-video{false}" is CLI11's own way of saying what a flag does.
std::string WithoutBraces(std::string text) {
  constexpr std::string_view kFalse = "{false}";
  for (std::size_t at = 0; (at = text.find(kFalse, at)) != std::string::npos;)
    text.replace(at, kFalse.size(), kFalse.size(), ' ');
  return text;
}

std::string CommonFirst::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
  const auto common = common_.find(app);
  if (mode != CLI::AppFormatMode::Normal || common == common_.end())
    return WithoutBraces(CLI::Formatter::make_help(app, std::move(name), mode));
  std::vector<const CLI::Option*> shown;
  for (const std::string& option : common->second) {
    const CLI::Option* known = app->get_option_no_throw(option);
    if (known == nullptr) throw std::logic_error("the help shows " + option + ", which is no option");
    shown.push_back(known);
  }
  for (const char* option : {"--json", "--quiet", "--threads"})
    if (const CLI::Option* known = app->get_option_no_throw(option)) shown.push_back(known);
  std::size_t others = 0;
  for (const CLI::Option* o : app->get_options()) others += o->nonpositional();
  others -= shown.size();
  std::string text = make_description(app) + make_usage(app, name) + make_positionals(app);
  text += make_group("Options that most people use", false, shown);
  text += "\n" + std::to_string(others) + " more: " + name + " --help-all\n";
  return WithoutBraces(text + make_subcommands(app, mode) + make_footer(app));
}

}  // namespace

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter() { return std::make_shared<CommonFirst>(); }

void ShowCommon(CLI::App& app, std::vector<std::string> names) {
  static_cast<CommonFirst&>(*app.get_formatter()).Show(&app, std::move(names));
}

}  // namespace lumi
