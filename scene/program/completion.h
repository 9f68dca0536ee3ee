// What may stand next on a program's line, for the completion of bash and zsh (packaging/completion).
#pragma once

#include <string>
#include <vector>

#include "scene/program/command_line_problem.h"

namespace lumi {

// words: those of the line after the program's name, the last one as far as it was typed, perhaps empty. Options, names
// of commands, and the words that an option takes, each beginning as the last one does; empty: a file is as good as
// anything.
std::vector<std::string> Completions(const CLI::App& app, const std::vector<std::string>& words,
                                     const TakenOptions& taken);

}  // namespace lumi
