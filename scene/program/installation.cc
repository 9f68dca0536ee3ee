#include "scene/program/installation.h"

#include <dlfcn.h>
#include <link.h>

#include <array>

#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

#ifndef LUMI_MODULES_FROM_PROGRAMS
#define LUMI_MODULES_FROM_PROGRAMS "../lib/lumigraph"
#endif

// Beside us; modules of an installation; programs and modules of the Python package; those of a build, from its
// package.
constexpr std::array kPlaces = {".", LUMI_MODULES_FROM_PROGRAMS, "bin", "../../bin"};
// What tells where an installation is.
constexpr const char* kInstalledProgram = "lumi-render";

std::optional<fs::path> FindFrom(const fs::path& folder, const std::string& name) {
  std::error_code error;
  for (const char* place : kPlaces)
    if (fs::path file = (folder / place / name).lexically_normal(); fs::is_regular_file(file, error)) return file;
  return std::nullopt;
}

}  // namespace

fs::path OwnFolder() {
  Dl_info info{};
  link_map* object = nullptr;
  std::error_code error;
  // The program itself is the one object without a name.
  if (::dladdr1(reinterpret_cast<const void*>(&OwnFolder), &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP) !=
          0 &&
      object != nullptr && object->l_name != nullptr && object->l_name[0] != '\0')
    return fs::canonical(object->l_name, error).parent_path();
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

std::optional<fs::path> FindOfSuite(const std::string& name) {
  if (auto file = FindFrom(OwnFolder(), name)) return file;
  const auto installed = FindProgram(kInstalledProgram);
  std::error_code error;
  return installed ? FindFrom(fs::canonical(*installed, error).parent_path(), name) : std::nullopt;
}

}  // namespace lumi
