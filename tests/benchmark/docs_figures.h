// Figures that README and docs quote. docs/figures.json holds what each part of bench.sh printed last; a marked place
// in a Markdown file holds a piece of it, so that a page cannot say another number than the bench printed.
//
// A table or a block, on lines of their own:
//     <!-- figures PART: HEADING -->
//     what stands below that heading, all of it
//     <!-- end -->
// A number within a sentence, by the first cells of its row and the name of its column, with N decimals where asked:
//     <!-- figure PART: HEADING | ROW | COLUMN | N --> ... <!-- end -->        ROW: "desk", or "desk / dense"
// All parts, who printed them and in how many seconds, and their sum:
//     <!-- figures all -->
// and where something else than a table was printed, the first group of a regular expression:
//     <!-- figure PART: HEADING ~ ([0-9.]+) ms a frame --> ... <!-- end -->
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lumi {

// What one part of bench.sh printed, and what is to be known about that run.
struct PrintedPart {
  std::string command;  // which prints it
  std::string machine;  // compilers, libraries, cores
  std::string version;  // of the suite; empty: not recorded
  double seconds = 0;   // that it took
  std::vector<std::string> lines;
};
constexpr const char* kFiguresFile = "docs/figures.json";
using PrintedFigures = std::map<std::string, PrintedPart>;  // by the part's name

// What a part printed with paths as they are from `root`: files that are kept tell nothing of the machine's folders.
std::vector<std::string> WithoutRoot(std::vector<std::string> lines, const std::filesystem::path& root);

// Throws Error where the file is no such file; an absent file has no parts.
PrintedFigures ReadPrintedFigures(const std::filesystem::path& file);
std::string ToJson(const PrintedFigures& figures);

// README.md and docs/*.md below the project's root, by name.
std::vector<std::filesystem::path> PagesWithFigures(const std::filesystem::path& root);

// `markdown` with all marked places filled in. Throws Error, naming `name` and the line, where a mark is not closed or
// asks for what was not printed.
std::string FillInFigures(const std::string& markdown, const std::string& name, const PrintedFigures& figures);

}  // namespace lumi
