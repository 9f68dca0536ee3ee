// `lumi-render methods`: this renderer and the published methods (render/comparators/) on the same held-out photos,
// over the same proxy: each with the settings that the choosing fold prefers, judged on the reporting fold, with its
// time beside that of one photo reprojected. docs/methods.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/tradeoff/workbench.h"
#include "scene/program/answer.h"

namespace lumi {

struct MethodsOptions : MeasureOptions {
  std::vector<std::string> methods;  // by name; empty: all
  int most_views = 8;                // of the reporting fold
  bool properties = false;           // the columns of Table 3.1, too
};

// What is compared: this renderer in three ways, and the published methods.
std::vector<std::string> MethodNames();

// Writes OUT/methods.json, .csv (a row a method and view) and .svg where OUT is given, at the end.
Answer RunMethods(const MethodsOptions& options, ProgressSink& progress);

// `lumi-render methods-report`: what `methods` wrote of some scenes, in Markdown: a matrix of held-out errors, and a
// table a scene. `lumi-render table-3-1`: what methods --properties wrote of them, as the thesis's table.
struct TableOptions {
  std::vector<std::filesystem::path> results;  // methods.json of each
  std::filesystem::path output;                // a .md file; empty: none
};
Answer RunTable(const TableOptions& options);
Answer RunMethodsReport(const TableOptions& options);

}  // namespace lumi
