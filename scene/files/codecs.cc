#include "scene/files/codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kModule = "liblumi_codecs.so";

const Codecs* OpenModule() {
  // Beside the program, wherever that was put; else where the system looks.
  std::error_code error;
  const std::filesystem::path beside = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / kModule;
  void* module = ::dlopen(beside.c_str(), RTLD_LAZY | RTLD_LOCAL);
  const char* why = module ? nullptr : ::dlerror();
  const std::string said = why ? why : "";
  if (!module) module = ::dlopen(kModule, RTLD_LAZY | RTLD_LOCAL);
  void* symbol = module ? ::dlsym(module, "LumigraphCodecs") : nullptr;
  if (!symbol)
    throw MachineError(fmt::format("pictures cannot be read: {} cannot be loaded ({})", kModule, said),
                       "it belongs beside the programs: was it moved?");
  return reinterpret_cast<const Codecs* (*)()>(symbol)();
}

}  // namespace

const Codecs& LoadCodecs() {
  static const Codecs* codecs = OpenModule();
  return *codecs;
}

}  // namespace lumi
