// Prints every figure that README and docs quote.
#include <algorithm>
#include <filesystem>

#include "scene/files/atomic_file.h"
#include "scene/program/main_program.h"
#include "tests/benchmark/figures.h"

int main(int argc, char** argv) {
  lumi::Program program(
      "bench_figures",
      "Runs the suite on a simulated desk, and on real captures where DIR is given, and prints what it measures");
  std::filesystem::path data, work = "build/bench";
  std::vector<std::string> only;
  int views = 4;
  lumi::Options options = program.options();
  options.Add("--data", data, "Folder of captures: fountain, sceaux, fox");
  options.Add("--work", work, "Where scenes are kept; a second run reuses them").Default();
  options.Add("--views", views, "Photos of each capture rendered at their own cameras").Range(1, 10000).Default();
  options.Add("--only", only, "Captures by name (desk, fountain ...); default: all");

  program.RunAndExit(argc, argv, [&] {
    if (!data.empty() && !std::filesystem::is_directory(data))
      throw lumi::UsageError("--data: there is no folder " + data.string());
    const std::filesystem::path desk = work / "desk-capture";
    lumi::SimulateDesk(desk, program.progress());
    std::vector<lumi::CaptureFigures> figures;
    for (const lumi::BenchCapture& capture : lumi::BenchCaptures(data, desk)) {
      const std::string short_name = capture.name.substr(0, capture.name.find(' '));
      if (!only.empty() && std::find(only.begin(), only.end(), short_name) == only.end()) continue;
      figures.push_back(lumi::MeasureCapture(capture, work, views, program.progress()));
    }
    const std::string json = lumi::ToJson(figures);
    lumi::WriteTextAtomically(work / "figures.json", json + "\n");
    lumi::WriteTextAtomically(work / "figures.md", lumi::ToMarkdown(figures));
    return lumi::Answer(lumi::JsonKeys::Parse(json).value(), lumi::ToMarkdown(figures));
  });
}
