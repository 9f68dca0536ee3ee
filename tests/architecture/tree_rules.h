// The arrows between the project's folders, as rules that a machine can hold: who may include whom, which heavy library
// stays where, what a library never does.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lumi {

// "FILE:LINE: what is wrong", sorted; empty for a tree that keeps the rules. `root` holds scene/, render/ ... .
std::vector<std::string> BrokenRules(const std::filesystem::path& root);

}  // namespace lumi
