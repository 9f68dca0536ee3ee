// What COLMAP prints while it works, read as progress (3.8's lines, and those of later versions).
#pragma once

#include <optional>
#include <string>

namespace lumi {

struct ColmapProgressLine {
  long done = 0;
  long total = 0;  // 0: the line does not say
};

// "Processed file [3/11]", "Matching block [1/3, 2/3]", "Matching image [5/40]", "Registering image #5 (3)",
// "Undistorting image [2/11]"; nullopt for any other line.
std::optional<ColmapProgressLine> ParseColmapProgress(const std::string& line);

}  // namespace lumi
