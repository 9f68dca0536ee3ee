#include "render/comparators/comparators.h"

#include <fmt/format.h>

#include <array>

#include "render/comparators/methods.h"

namespace lumi {
namespace {

struct Row {
  ComparatorMaker* make = nullptr;
  ComparatorOptions options;
  std::vector<double> counts = {-1}, parameters = {-1};  // to choose from, in all combinations
};

const Row& RowOf(Algorithm method) {
  // One row for each Algorithm, in their order. Each method is chosen from up to 12 settings, as this renderer is
  // (tradeoff/methods.cc).
  static const std::array<Row, 13> rows = {{
      {},
      {MakeChenWilliams, {"photos dissolved; 2", "exponent of 1/distance; 1"}, {-1, 1, 4, 8, 16, 32}, {-1, 2}},
      {MakeLevoyHanrahan,
       {"points of the grid of cameras; as many as cameras", "focal plane, of the harmonic mean distance; 1"},
       {-1, 64, 1024},
       {-1, 0.7, 0.85, 1.2}},
      {MakeGortler, {"points of the grid of cameras; as many as cameras", ""}, {-1, 16, 64, 256, 1024, 4096}},
      {MakeDebevec1996, {"photos averaged, 0: all; all", "exponent of 1/angle; 1"}, {-1, 2, 3, 4}, {-1, 2, 3}},
      {MakeSeitzDyer, {}},
      {MakePulli, {"photos; 3, around the view", "exponent of the cosine; 1"}, {-1, 2, 6, 12}, {-1, 0, 2}},
      {MakeDebevec1998, {"", "parts of an octant's side; 4"}, {-1}, {-1, 1, 2, 6, 8, 16, 32}},
      {MakePighin, {"", "exponent of the cosine; 1"}, {-1}, {-1, 0, 0.5, 2, 4}},
      {MakeHeigl, {}},
      {MakeLhuillierQuan, {}},
      {MakeWood, {"parts of an octant's side; 2", "fairness; 0.1"}, {-1, 1, 3}, {-1, 1e-3, 1e-2, 1}},
      {MakeSibrUlr, {"photos; 4", "share of the resolution's penalty; 0.1"}, {-1, 3, 8, 16}, {-1, 0, 1}},
  }};
  return rows[static_cast<std::size_t>(method)];
}

}  // namespace

std::shared_ptr<const RayMethod> MakeComparator(const Sources& sources, const ProxyTracer& proxy,
                                                const ViewSetup& setup) {
  const Row& row = RowOf(setup.settings.method);
  return row.make ? row.make(sources, proxy, setup) : nullptr;
}

ComparatorOptions OptionsOf(Algorithm method) { return RowOf(method).options; }

std::string ProblemOf(const RadianceSettings& s) {
  const ComparatorOptions reads = OptionsOf(s.method);
  const auto problem = [&](const char* option, double value, std::string_view meaning) {
    return value >= 0 && meaning.empty() ? fmt::format("--{} means nothing to --method {}", option, Name(s.method))
                                         : std::string();
  };
  std::string text = problem("method-count", s.method_count, reads.count);
  return text.empty() ? problem("method-parameter", s.method_parameter, reads.parameter) : text;
}

std::vector<RadianceSettings> SettingsToChooseFrom(Algorithm method, const RadianceSettings& base) {
  std::vector<RadianceSettings> all;
  RadianceSettings s = base;
  s.method = method;
  s.similarity = Similarity::kIdentity;
  s.grid_columns = s.grid_rows = 0;
  for (const double count : RowOf(method).counts)
    for (const double parameter : RowOf(method).parameters) {
      s.method_count = count;
      s.method_parameter = parameter;
      all.push_back(s);
    }
  return all;
}

}  // namespace lumi
