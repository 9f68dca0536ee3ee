#include "simulate/examples.h"

#include <nlohmann/json.hpp>

#include "scene/program/error.h"

namespace lumi {

// Name and text of each; made by CMakeLists.txt of examples/*.json.
extern const std::vector<std::pair<std::string, std::string>> kExamples;

std::vector<Example> Examples() {
  std::vector<Example> examples;
  for (const auto& [name, text] : kExamples) examples.push_back({name, nlohmann::json::parse(text)["description"]});
  return examples;
}

std::string ExampleJson(const std::string& name) {
  std::string names;
  for (const auto& [known, text] : kExamples) {
    if (known == name) return text;
    names += (names.empty() ? "" : ", ") + known;
  }
  throw UsageError("there is no example \"" + name + "\"", "there are: " + names);
}

}  // namespace lumi
