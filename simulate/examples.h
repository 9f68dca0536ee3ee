// Scenes that come with the program: examples/*.json, after those of the thesis (Buehler 2002; docs/simulate.md),
// inside the program so that it stands alone. truth/scene.json of a capture is a template for one's own.
#pragma once

#include <string>
#include <vector>

namespace lumi {

struct Example {
  std::string name;
  std::string description;  // one line
};
std::vector<Example> Examples();

// Throws UsageError naming those that exist.
std::string ExampleJson(const std::string& name);

}  // namespace lumi
