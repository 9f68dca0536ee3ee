// Prints every figure that README and docs quote.
#include <CLI/CLI.hpp>
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
  program.app().add_option("--data", data, "Folder of captures: fountain, sceaux, fox")->check(CLI::ExistingDirectory);
  program.app().add_option("--work", work, "Where scenes are kept; a second run reuses them")->capture_default_str();
  program.app()
      .add_option("--views", views, "Photos of each capture rendered at their own cameras")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  program.app().add_option("--only", only, "Captures by name (desk, fountain ...); default: all");

  std::vector<lumi::CaptureFigures> figures;
  return program.Run(
      argc, argv,
      [&] {
        const std::filesystem::path desk = work / "desk-capture";
        lumi::SimulateDesk(desk, program.progress());
        for (const lumi::BenchCapture& capture : lumi::BenchCaptures(data, desk)) {
          const std::string short_name = capture.name.substr(0, capture.name.find(' '));
          if (!only.empty() && std::find(only.begin(), only.end(), short_name) == only.end()) continue;
          figures.push_back(lumi::MeasureCapture(capture, work, views, program.progress()));
        }
        const std::string json = lumi::ToJson(figures);
        lumi::WriteTextAtomically(work / "figures.json", json + "\n");
        lumi::WriteTextAtomically(work / "figures.md", lumi::ToMarkdown(figures));
        return json;
      },
      [&](const std::string&) { return lumi::ToMarkdown(figures); });
}
