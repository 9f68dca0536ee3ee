#include "scene/files/codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "scene/files/video_codecs.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

void* OpenModule(const char* file, const char* symbol, const char* what) {
  // Beside the program, wherever that was put; else where the system looks.
  std::error_code error;
  const std::filesystem::path beside = std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / file;
  void* module = ::dlopen(beside.c_str(), RTLD_LAZY | RTLD_LOCAL);
  const char* why = module ? nullptr : ::dlerror();
  const std::string said = why ? why : "";
  if (!module) module = ::dlopen(file, RTLD_LAZY | RTLD_LOCAL);
  void* found = module ? ::dlsym(module, symbol) : nullptr;
  if (!found)
    throw MachineError(fmt::format("{} cannot be read: {} cannot be loaded ({})", what, file, said),
                       "it belongs beside the programs: was it moved?");
  return found;
}

}  // namespace

const Codecs& LoadCodecs() {
  static const Codecs* codecs =
      reinterpret_cast<const Codecs* (*)()>(OpenModule("liblumi_codecs.so", "LumigraphCodecs", "pictures"))();
  return *codecs;
}

const VideoCodecs& LoadVideoCodecs() {
  static const VideoCodecs* codecs =
      reinterpret_cast<const VideoCodecs* (*)()>(OpenModule("liblumi_video.so", "LumigraphVideoCodecs", "videos"))();
  return *codecs;
}

}  // namespace lumi
