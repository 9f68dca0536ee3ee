#pragma once

#include <filesystem>

namespace lumi {

// Before work of minutes: a name for a plot. Throws UsageError where it does not end in .svg, or where a file of that
// name is no SVG; MachineError where it cannot be written. An empty one asks for no plot.
void RequireSvgFile(const std::filesystem::path& path);

}  // namespace lumi
