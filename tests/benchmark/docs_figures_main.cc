// Keeps the figures of README and docs: see docs_figures.h. Started by bench.sh, from the project's root.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>

#include "scene/files/atomic_file.h"
#include "scene/files/open_to_read.h"
#include "scene/program/main_program.h"
#include "tests/benchmark/docs_figures.h"

namespace lumi {
namespace {

struct DocsSummary {
  std::vector<std::string> changed;
};
void ListKeys(JsonKeys& j, DocsSummary& s) { j("changed", s.changed); }
std::string Describe(const DocsSummary& s) {
  std::string text;
  for (const std::string& page : s.changed) text += page + "\n";
  return text;
}

PrintedPart ReadStdin() {
  PrintedPart part;
  for (std::string line; std::getline(std::cin, line);) part.lines.push_back(line);
  while (!part.lines.empty() && part.lines.back().empty()) part.lines.pop_back();
  if (part.lines.empty()) throw DataError("nothing was printed: there is nothing to record");
  return part;
}

DocsSummary Update(const std::filesystem::path& root, const PrintedFigures& figures) {
  // All are filled in before one is written.
  std::vector<std::pair<std::filesystem::path, std::string>> changed;
  for (const std::filesystem::path& page : PagesWithFigures(root)) {
    std::ifstream in = OpenToRead(page);
    const std::string old{std::istreambuf_iterator<char>(in), {}};
    std::string filled = FillInFigures(old, page.string(), figures);
    if (filled != old) changed.emplace_back(page, std::move(filled));
  }
  DocsSummary summary;
  for (const auto& [page, text] : changed) {
    WriteTextAtomically(page, text);
    summary.changed.push_back(page.string());
  }
  return summary;
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  lumi::Program program("docs_figures", "Keeps the figures that README and docs quote");
  std::string part;
  lumi::PrintedPart printed;
  std::filesystem::path root = ".";
  lumi::Options record =
      program.Command("record", "What a part of bench.sh printed, from stdin, into docs/figures.json", [&] {
        lumi::PrintedFigures figures = lumi::ReadPrintedFigures(root / lumi::kFiguresFile);
        printed.lines = lumi::WithoutRoot(lumi::ReadStdin().lines, root);
        printed.seconds = std::round(printed.seconds);
        figures[part] = printed;
        lumi::WriteTextAtomically(root / lumi::kFiguresFile, lumi::ToJson(figures));
        return lumi::Answer(lumi::DocsSummary{});
      });
  record.Add("PART", part, "Its name");
  record.Add("--command", printed.command, "That prints it");
  record.Add("--machine", printed.machine, "Compilers, libraries, cores");
  record.Add("--of", printed.version, "The suite's version");
  record.Add("--seconds", printed.seconds, "That it took").Range(0.0, 1e9);
  program.Command("update", "Fills README.md and docs/*.md in, and lists the pages that changed", [&] {
    return lumi::Answer(lumi::Update(root, lumi::ReadPrintedFigures(root / lumi::kFiguresFile)));
  });
  program.RunAndExit(argc, argv);
}
