// `lumi-render properties`: a figure for each of the nine properties that Table 3.2 asks of an image-based rendering
// algorithm.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/tradeoff/workbench.h"

namespace lumi {

struct Figure {
  std::string key;
  std::optional<double> value;  // nullopt: not available
  bool count = false;           // a whole number
};

struct Property {
  std::string name, figure;  // what the figures are, for people
  std::vector<Figure> values;
};

struct PropertiesSummary {
  std::filesystem::path scene;
  std::string proxy, backend, device;
  RadianceSettings settings;
  bool own_times = true;  // each view is measured at its own moment
  std::vector<Property> properties;
};

// Writes properties.json in OUT where OUT is given.
PropertiesSummary RunProperties(const MeasureOptions& options, ProgressSink& progress);
nlohmann::ordered_json ToJson(const PropertiesSummary& summary);
std::string Describe(const PropertiesSummary& summary);

}  // namespace lumi
