#include "export/own_output.h"

#include <fstream>

#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr std::size_t kMarkWithin = 4096;  // bytes: glTF names its parts first

}  // namespace

void RequireOurFile(const std::filesystem::path& file, const std::string& mark, const std::string& what) {
  if (std::filesystem::is_directory(file)) throw UsageError(file.string() + " is a folder", "name a file");
  std::ifstream in(file, std::ios::binary);
  std::string head(kMarkWithin, ' ');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (std::filesystem::exists(file) && head.find(mark) == std::string::npos)
    throw UsageError(file.string() + " is there, and is no " + what + " of ours: nothing was touched",
                     "choose another name");
}

}  // namespace lumi
