#include "export/own_output.h"

#include <fstream>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr std::size_t kMarkWithin = 4096;  // bytes; a glTF file describes a few arrays before it names its generator

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

void RequireOurExport(const std::filesystem::path& folder, const std::string& marker) {
  if (!std::filesystem::exists(folder / marker) && std::filesystem::exists(folder / "lumigraph.json"))
    throw UsageError(folder.string() + " is a scene: nothing is exported into it", "choose another folder");
  RequireOurFolder(folder, marker);
}

}  // namespace lumi
