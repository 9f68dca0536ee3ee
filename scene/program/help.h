// The text of --help: of a program with many options those that most people use; --help-all shows all of them.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class FormatterBase;
}  // namespace CLI

namespace lumi {

// Shows all options of an app until ShowCommon was called for it.
std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter();
// The options of `app`, whose formatter is one of these, that --help shows, in this order.
void ShowCommon(CLI::App& app, std::vector<std::string> names);

}  // namespace lumi
