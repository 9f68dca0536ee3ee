#include "scene/files/svg_file.h"

#include <fstream>
#include <string>

#include "scene/files/atomic_file.h"
#include "scene/files/file_name.h"
#include "scene/program/error.h"

namespace lumi {

void RequireSvgFile(const std::filesystem::path& path) {
  if (path.empty()) return;
  if (LowerExtension(path) != ".svg") throw UsageError(path.string() + ": a plot is an .svg file", "--plot FILE.svg");
  RequireWritable(path);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return;
  std::ifstream file(path, std::ios::binary);
  constexpr std::size_t kHead = 1024;  // an XML declaration and comments may come first
  std::string head(kHead, '\0');
  file.read(head.data(), kHead);
  head.resize(static_cast<std::size_t>(file.gcount()));
  const bool empty = std::filesystem::file_size(path, error) == 0;
  if (!empty && head.find("<svg") == head.npos)
    throw UsageError(path.string() + " is there already, and no SVG", "name another file with --plot");
}

}  // namespace lumi
