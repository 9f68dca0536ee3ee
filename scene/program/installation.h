// Where the suite's other files lie: its programs, and the modules that they load.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace lumi {

// The folder of the program, or of the Python module, that this code is in. Empty where the system does not tell.
std::filesystem::path OwnFolder();

// A file of the suite, by its name: beside us, or where a build, an installation or a Python package have it relative
// to us; last where an installed lumi-render, found in PATH, has it. nullopt: in none of these.
std::optional<std::filesystem::path> FindOfSuite(const std::string& name);

}  // namespace lumi
