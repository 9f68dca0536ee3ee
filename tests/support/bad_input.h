// What every refusal has to be: the contract's exit code, one line that names what it is about, nothing half-written,
// nothing of the user's changed.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/child_program.h"

namespace lumi {

struct Refusal {
  std::vector<std::string> argv;
  int exit_code = 0;
  std::vector<std::string> line_names;       // each appears in the one line
  std::filesystem::path output;              // must not be there afterwards (or stay as it was)
  std::vector<std::filesystem::path> users;  // must not change
  std::map<std::string, std::string> environment = {};
  std::shared_ptr<void> held = {};  // what is to be there while the program runs
};

// Runs it twice, for a person and with --json, and checks both.
void ExpectRefusal(const Refusal& refusal);

// Names, sizes and contents of all files below `folder`, as text; "absent" where there is nothing.
std::string Contents(const std::filesystem::path& folder);

}  // namespace lumi
